"""The service as its users meet it: over HTTP, on a real database."""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import httpx
import uvicorn

from app.main import create_app
from app.settings import Settings

ADMIN = "an-admin-key-for-tests"


def settings_of(database_url: str) -> Settings:
    """A service that does nothing unasked, whatever else the machine has to do."""
    return Settings(
        database_url=database_url,
        port=0,
        bootstrap_key=ADMIN,
        log_level="error",
        index_tables="off",
        guard="off",
        decision_budget=60_000,
    )


@dataclass
class Service:
    """A running service, and a client that may do everything."""

    url: str
    settings: Settings
    client: httpx.Client
    _server: uvicorn.Server
    _thread: threading.Thread

    @classmethod
    def start(cls, settings: Settings) -> "Service":
        app = create_app(settings)
        config = uvicorn.Config(
            app, host="127.0.0.1", port=settings.port, log_config=None, access_log=False
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, daemon=True)
        thread.start()
        while not server.started:
            if not thread.is_alive():
                raise RuntimeError("the service did not start")
            time.sleep(0.005)
        port = server.servers[0].sockets[0].getsockname()[1]
        url = f"http://127.0.0.1:{port}"
        client = client_of(url, ADMIN)
        return cls(url, settings, client, server, thread)

    def stop(self) -> None:
        self.client.close()
        self._server.should_exit = True
        self._thread.join()

    def with_key(self, key: str) -> httpx.Client:
        return client_of(self.url, key)

    def put_model(self, name: str, model: Mapping[str, Any]) -> None:
        answer = self.client.put(f"/v1/models/{name}", json=model)
        assert answer.is_success, answer.text

    def put_item(self, name: str, model: str, **fields: Any) -> None:  # noqa: ANN401
        answer = self.client.put(
            f"/v1/items/{name}", json={"model": model, "title": name, **fields}
        )
        assert answer.is_success, answer.text

    def set_policy(self, name: str, **params: object) -> dict[str, Any]:
        answer = self.client.put(
            "/v1/admin/policy", json={"name": name, "params": params, "note": "test"}
        )
        assert answer.is_success, answer.text
        policy: dict[str, Any] = answer.json()
        return policy

    def next(self, user: str, **filters: object) -> dict[str, Any]:
        answer = self.client.get(f"/v1/users/{user}/next", params=filters)  # type: ignore[arg-type]
        assert answer.is_success, answer.text
        play: dict[str, Any] = answer.json()
        return play

    def answer(self, play: str, signal: str, **query: object) -> dict[str, Any]:
        answer = self.client.post(
            f"/v1/plays/{play}/feedback",
            json={"signal": signal},
            params=query,  # type: ignore[arg-type]
        )
        assert answer.is_success, answer.text
        taken: dict[str, Any] = answer.json()
        return taken

    def beliefs(self, user: str, **query: object) -> dict[str, Any]:
        answer = self.client.get(f"/v1/users/{user}/beliefs", params=query)  # type: ignore[arg-type]
        assert answer.is_success, answer.text
        beliefs: dict[str, Any] = answer.json()
        return beliefs


def client_of(url: str, key: str) -> httpx.Client:
    return httpx.Client(
        base_url=url, headers={"Authorization": f"Bearer {key}"}, timeout=60
    )
