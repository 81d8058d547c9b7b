"""Every error is a problem with a stable code, and the document lists them all."""

import asyncio
import json
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st
from structlog.contextvars import merge_contextvars
from structlog.testing import capture_logs

from app.api.middleware import Observed
from app.api.problems import response
from app.errors import ClientError, Fault, InvalidRequest
from tests.app.service import Service

LISTED = Path(__file__).parents[2] / "docs" / "errors.md"
ROW = re.compile(r"^\| `(\w+)` \| (\d+) \|", re.MULTILINE)
OF_THE_FRAMEWORK = {
    ("internal_error", "500"),
    ("not_found", "404"),
    ("method_not_allowed", "405"),
}
POLICY = "/v1/admin/policy"


def errors(base: type[ClientError] = ClientError) -> Iterator[type[ClientError]]:
    for error in base.__subclasses__():
        yield error
        yield from errors(error)


def test_the_document_lists_every_code_with_its_status() -> None:
    ours = {(e.code, str(int(e.status))) for e in errors() if hasattr(e, "code")}

    assert set(ROW.findall(LISTED.read_text())) == ours | OF_THE_FRAMEWORK


def problem_of(answer: httpx.Response) -> tuple[int, str, list[str]]:
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-request-id"]
    problem = answer.json()
    assert problem["status"] == answer.status_code
    assert problem["type"] == f"urn:encore:problem:{problem['code']}"
    return (
        answer.status_code,
        problem["code"],
        [error["field"] for error in problem["errors"]],
    )


BODIES: list[tuple[str, bytes, tuple[int, str, list[str]]]] = [
    ("application/json", b"", (422, "invalid_request", ["body"])),
    ("application/json", b"{", (422, "malformed_body", [])),
    ("application/json", b"\xff", (422, "malformed_body", [])),
    ("application/json", b"[" * 100_000, (422, "malformed_body", [])),
    ("application/json", b"9" * 5_000, (422, "malformed_body", [])),
    ("application/json", b"[]", (422, "invalid_request", ["body"])),
    ("application/json", b'{"name": NaN}', (422, "invalid_request", ["name"])),
    (
        "application/json",
        b'{"name": "myopic", "\\ud800": 1}',
        (422, "invalid_request", ["body"]),
    ),
    ("application/json", b'{"name": "\\ud800"}', (422, "invalid_request", ["name"])),
    ("text/plain", b'{"name": "myopic"}', (415, "unsupported_media_type", [])),
    ("", b'{"name": "myopic"}', (415, "unsupported_media_type", [])),
    ("application/json", b" " * 1_000_001, (413, "body_too_large", [])),
]


def test_a_body_in_error_is_told_what_is_wrong(service: Service) -> None:
    for content_type, body, expected in BODIES:
        headers = {"Content-Type": content_type} if content_type else {}
        answer = service.client.put(POLICY, content=body, headers=headers)
        assert problem_of(answer) == expected, body[:100]


def test_a_body_of_unknown_length_is_cut_off(service: Service) -> None:
    chunks = (b" " * 100_000 for _ in range(100))

    answer = service.client.put(
        POLICY, content=chunks, headers={"Content-Type": "application/json"}
    )

    assert problem_of(answer) == (413, "body_too_large", [])


def test_a_path_or_method_that_does_not_exist_is_a_problem_too(
    service: Service,
) -> None:
    client = service.client

    wrong_method = client.patch(POLICY)

    assert problem_of(client.get("/nowhere")) == (404, "not_found", [])
    assert problem_of(client.get("/v1/items/")) == (404, "not_found", [])
    assert problem_of(wrong_method) == (405, "method_not_allowed", [])
    assert wrong_method.headers["allow"] == "GET, PUT"


ODD = [
    b"GET /v1/users/%ff/next HTTP/1.1",
    b"GET /v1/users/a%00b/next HTTP/1.1",
    b"GET /v1/users/%ed%a0%80/next HTTP/1.1",
    b"GET /v1/users/ann/next?tag=%00&candidate=%ff HTTP/1.1",
    b"GET /v1/admin/policies?limit=99999999999999999999 HTTP/1.1",
    b"GET /v1/admin/policies?cursor=%ff HTTP/1.1",
    b"GET /static/%00 HTTP/1.1",
    b"GET /static/..%2f..%2fsettings.py HTTP/1.1",
    b"GET //v1/items HTTP/1.1",
    b"BREW /v1/items HTTP/1.1",
]


def test_odd_requests_are_the_clients_fault(service: Service) -> None:
    key = service.client.headers["Authorization"].encode()

    for line in ODD:
        assert 400 <= raw(service, line, b"Authorization: " + key) < 500, line


def raw(service: Service, *lines: bytes) -> int:
    """Send lines as they are; return the status."""
    address = urlsplit(service.url)
    request = (*lines, b"Host: x", b"Connection: close", b"", b"")
    with socket.create_connection((address.hostname, address.port), 10) as connection:
        connection.sendall(b"\r\n".join(request))
        answer = connection.makefile("rb").read()
    return int(answer.split(b" ", 2)[1])


NO_KEYS = [
    b"",
    b"Authorization:",
    b"Authorization: Bearer",
    b"Authorization: Basic YTpi",
    b"Authorization: Bearer unknown",
    b"Authorization: Bearer " + b"x" * 50_000,
    b"Authorization: Bearer \xed\xa0\x80\xff",
    "Authorization: Bearer ключ".encode(),
    b"Authorization: Bearer a\tb",
    b"Authorization: bearer \xff \xfe",
]


def test_whatever_is_sent_as_a_key_is_refused(service: Service) -> None:
    for header in NO_KEYS:
        lines = [header] if header else []
        status = raw(service, b"GET /v1/admin/keys HTTP/1.1", *lines)
        assert status == 401, header


@given(
    field=st.text() | st.characters(categories=["Cs"]),
    value=st.recursive(
        st.none()
        | st.booleans()
        | st.integers()
        | st.floats()
        | st.text()
        | st.characters(categories=["Cs"]),
        st.lists,
    ),
)
def test_any_value_at_fault_is_shown_as_short_json(field: str, value: object) -> None:
    answer = response(InvalidRequest(field, Fault(field, field, value)))

    shown = json.loads(bytes(answer.body))["errors"][0]

    assert len(json.dumps(shown)) < 8_000
    assert not isinstance(shown["value"], dict | list)


def test_a_secret_at_fault_is_not_shown() -> None:
    secret = "encore_" + "x" * 43

    answer = response(InvalidRequest(secret, Fault(secret, secret, secret)))

    assert secret.encode() not in bytes(answer.body)


def test_a_fault_of_ours_is_told_with_the_id_under_which_it_was_logged() -> None:
    app = FastAPI()

    @app.get("/broken")
    async def broken() -> None:
        raise RuntimeError("a detail that is not for clients")

    app.add_middleware(Observed)
    transport = httpx.ASGITransport(app)

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=transport) as client:
            headers = {"X-Request-ID": "mine"}
            return await client.get("http://service/broken", headers=headers)

    with capture_logs([merge_contextvars]) as logged:
        answer = asyncio.run(ask())

    assert problem_of(answer) == (500, "internal_error", [])
    assert answer.headers["x-request-id"] == "mine"
    assert "a detail" not in answer.text
    assert logged[0]["request_id"] == "mine"
    assert "a detail" in str(logged[0]["exc_info"])
