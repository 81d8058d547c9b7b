"""What a request needs of the process that serves it."""

import asyncio
from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends, Request, Security
from fastapi.routing import APIRoute
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from app.domain import Key, Scope
from app.errors import Fault, InvalidRequest, Unauthorized
from app.services.keys import KeyRing
from app.services.live import Live
from app.services.pending import PendingPlays
from app.settings import Settings
from app.storage.database import Database

bearer = HTTPBearer(
    auto_error=False, description="a key, as `encore demo` or `encore keys` prints it"
)
Credentials = Annotated[HTTPAuthorizationCredentials | None, Depends(bearer)]


@dataclass(slots=True)
class Context:
    """What is opened once and serves all requests."""

    settings: Settings
    database: Database
    live: Live
    keyring: KeyRing
    warm: asyncio.Event = field(default_factory=asyncio.Event)
    pending: PendingPlays = field(init=False)

    def __post_init__(self) -> None:
        self.pending = PendingPlays(self.database)


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


async def serving(request: Request, credentials: Credentials) -> Caller:
    """A caller with any valid key."""
    return await _caller(request, credentials, Scope.SERVE)


async def administering(request: Request, credentials: Credentials) -> Caller:
    """A caller with an admin key."""
    return await _caller(request, credentials, Scope.ADMIN)


async def _caller(
    request: Request, credentials: HTTPAuthorizationCredentials | None, scope: Scope
) -> Caller:
    if credentials is None:
        raise Unauthorized("Send a key: 'Authorization: Bearer …'.")
    context = context_of(request)
    key = await context.keyring.check(credentials.credentials, scope)
    if not context.warm.is_set():
        await context.warm.wait()
    if request.scope["query_string"]:
        _refuse_unknown(request)
    return Caller(context, key)


def _refuse_unknown(request: Request) -> None:
    """A misspelt filter must not be taken for none."""
    route: APIRoute = request.scope["route"]
    known = {parameter.alias for parameter in route.dependant.query_params}
    unknown = [name for name in request.query_params if name not in known]
    if unknown:
        names = ", ".join(sorted(known)) or "none"
        faults = [Fault(name, f"unknown; known here: {names}") for name in unknown]
        raise InvalidRequest("The query holds what is not known here.", *faults)


Serving = Annotated[Caller, Depends(serving)]
Administering = Annotated[Caller, Security(administering, scopes=[Scope.ADMIN])]
