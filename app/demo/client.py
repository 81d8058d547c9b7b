"""The calls that the demo makes, as any application would make them."""

import asyncio
import ssl
from collections.abc import Mapping
from typing import Self

import httpx
from prometheus_client.parser import text_string_to_metric_families

from app.api.schemas.items import ItemPage, ItemView
from app.api.schemas.listening import FeedbackTaken, NextPlay
from app.api.schemas.model_views import ModelPage, ModelView
from app.api.schemas.policy import PresentPolicy

PAGE = 1000
TLS = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # made once: it takes time, even unused


class Client:
    """A connection to a service on this machine, with an admin key."""

    def __init__(self, url: str, key: str) -> None:
        self._url = url
        self._key = key
        self._http = httpx.AsyncClient(
            base_url=url,
            headers={"Authorization": f"Bearer {key}"},
            timeout=60,
            verify=TLS,
            trust_env=False,  # no proxy stands between
        )

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._http.aclose()

    def another(self) -> "Client":
        """A connection of its own: a shared pool is slow when many use it at once."""
        return Client(self._url, self._key)

    async def until_ready(self) -> None:
        while not await self._is_ready():  # noqa: ASYNC110 - another process may serve
            await asyncio.sleep(0.05)

    async def _is_ready(self) -> bool:
        try:
            return (await self._http.get("/health/ready")).is_success
        except httpx.TransportError:
            return False

    async def next_play(self, user: str) -> NextPlay:
        answer = await self._call("GET", f"/v1/users/{user}/next")
        return NextPlay.model_validate_json(answer.content)

    async def answer(self, play: NextPlay, signal: str, *, then: bool) -> FeedbackTaken:
        """Answer a play; `then`: ask for the next one in the same call."""
        answer = await self._call(
            "POST",
            f"/v1/plays/{play.play}/feedback?next={str(then).lower()}",
            {"signal": signal},
        )
        return FeedbackTaken.model_validate_json(answer.content)

    async def policy(self) -> PresentPolicy:
        answer = await self._call("GET", "/v1/admin/policy")
        return PresentPolicy.model_validate_json(answer.content)

    async def swap(self, name: str, params: Mapping[str, object], note: str) -> None:
        policy = {"name": name, "params": params, "note": note}
        await self._call("PUT", "/v1/admin/policy", policy)

    async def models(self) -> list[ModelView]:
        found: list[ModelView] = []
        cursor = ""
        while True:
            answer = await self._call("GET", f"/v1/models?limit={PAGE}{cursor}")
            page = ModelPage.model_validate_json(answer.content)
            found += page.models
            if page.next is None:
                return found
            cursor = f"&cursor={page.next}"

    async def items(self) -> list[ItemView]:
        found: list[ItemView] = []
        cursor = ""
        while True:
            answer = await self._call("GET", f"/v1/items?limit={PAGE}{cursor}")
            page = ItemPage.model_validate_json(answer.content)
            found += page.items
            if page.next is None:
                return found
            cursor = f"&cursor={page.next}"

    async def decisions(self, policy: str) -> tuple[float, float]:
        """How many decisions a policy has taken, and in how many seconds."""
        families = text_string_to_metric_families(
            (await self._call("GET", "/metrics")).text
        )
        totals = {
            sample.name: sample.value
            for family in families
            if family.name == "encore_decision_seconds"
            for sample in family.samples
            if sample.labels["policy"] == policy
        }
        return (
            totals.get("encore_decision_seconds_count", 0),
            totals.get("encore_decision_seconds_sum", 0),
        )

    async def _call(
        self, method: str, path: str, body: Mapping[str, object] | None = None
    ) -> httpx.Response:
        answer = await self._http.request(method, path, json=body)
        return answer.raise_for_status()
