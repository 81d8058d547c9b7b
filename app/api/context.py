"""What a request needs of the process that serves it."""

import asyncio
from dataclasses import dataclass, field
from typing import Annotated
from urllib.parse import unquote

from fastapi import Depends, Request, Security
from fastapi.openapi.models import HTTPBearer
from fastapi.routing import APIRoute
from fastapi.security.base import SecurityBase

from app.domain import Key, Scope
from app.errors import Fault, InvalidRequest, Unauthorized, UnknownOrigin
from app.services import guard_fallback
from app.services.guard_watch import GuardWatch
from app.services.index_builder import IndexBuilder
from app.services.keys import KeyRing
from app.services.live import Live
from app.services.overviews import Overviews
from app.services.pending import PendingPlays
from app.services.rates import Rate
from app.services.shadow_watch import ShadowWatch
from app.services.simulations import Simulator
from app.services.tally_watch import TallyWatch
from app.settings import Settings
from app.storage.database import Database


@dataclass(slots=True)
class Context:
    """What is opened once and serves all requests."""

    settings: Settings
    database: Database
    live: Live
    keyring: KeyRing
    key_rate: Rate = field(init=False)
    user_rate: Rate = field(init=False)
    warm: asyncio.Event = field(default_factory=asyncio.Event)
    pending: PendingPlays = field(init=False)
    overviews: Overviews = field(init=False)
    index_builder: IndexBuilder = field(init=False)
    guard: GuardWatch = field(init=False)
    tallies: TallyWatch = field(init=False)
    shadows: ShadowWatch = field(init=False)
    simulator: Simulator = field(init=False)

    def __post_init__(self) -> None:
        burst_s = self.settings.rate_burst.total_seconds()
        self.key_rate = Rate("key", self.settings.key_rate, burst_s)
        self.user_rate = Rate("user", self.settings.user_rate, burst_s)
        self.pending = PendingPlays(self.database)
        self.overviews = Overviews(self.database)
        self.index_builder = IndexBuilder(self.database)
        self.guard = GuardWatch(self.database, guard_fallback.in_use(self.settings))
        self.tallies = TallyWatch(self.database, self.settings.pending_ttl)
        self.shadows = ShadowWatch(self.database, self.live)
        self.simulator = Simulator(
            self.database, self.live, self.settings.simulation_budget
        )


@dataclass(frozen=True, slots=True)
class Caller:
    """Who asks, and what serves it."""

    context: Context
    key: Key

    @property
    def database(self) -> Database:
        return self.context.database

    @property
    def live(self) -> Live:
        return self.context.live


def context_of(request: Request) -> Context:
    context: Context = request.app.state.context
    return context


class Allowed(SecurityBase):
    """Lets callers in whose key allows a scope; a dependency of its own, for speed."""

    def __init__(self, scope: Scope) -> None:
        self.scope = scope
        self.scheme_name = "HTTPBearer"
        self.model = HTTPBearer(
            description="a key, as `encore demo` or `encore keys` prints it"
        )

    async def __call__(self, request: Request) -> Caller:
        sent = request.headers.get("authorization", "")
        kind, _, secret = sent.partition(" ")
        if kind.lower() != "bearer" or not secret:
            raise Unauthorized("Send a key: 'Authorization: Bearer …'.")
        context = context_of(request)
        key = await context.keyring.check(secret, self.scope)
        if key.origins:
            _check_origin(request, key)
        if context.user_rate.per_second is None:
            context.key_rate.take(key.id)
        else:
            _take_both(request, context, key)
        if not context.warm.is_set():
            await context.warm.wait()
        if request.scope["query_string"]:
            _refuse_unknown(request)
        return Caller(context, key)


def _check_origin(request: Request, key: Key) -> None:
    """A key that is seen in one page is of no use to another."""
    origin = request.headers.get("origin")
    if origin is None:
        return
    if origin not in key.origins:
        raise UnknownOrigin("This key is for pages of other origins.")
    request.scope["encore.origin"] = origin


def _take_both(request: Request, context: Context, key: Key) -> None:
    """Count a request of a key and about a user, if there is one: both or neither.

    Else whoever asks too often about one user would be in the way of all others.
    """
    user = request.path_params.get("user")
    if user is not None:
        user = unquote(user)
        context.user_rate.check(user)
    context.key_rate.take(key.id)
    if user is not None:
        context.user_rate.take(user)


def _refuse_unknown(request: Request) -> None:
    """A misspelt filter must not be taken for none."""
    route: APIRoute = request.scope["route"]
    known = {parameter.alias for parameter in route.dependant.query_params}
    unknown = [name for name in request.query_params if name not in known]
    if unknown:
        names = ", ".join(sorted(known)) or "none"
        faults = [Fault(name, f"unknown; known here: {names}") for name in unknown]
        raise InvalidRequest("The query holds what is not known here.", *faults)


Serving = Annotated[Caller, Depends(Allowed(Scope.SERVE))]
Administering = Annotated[Caller, Security(Allowed(Scope.ADMIN), scopes=[Scope.ADMIN])]
