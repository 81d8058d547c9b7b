"""The API's document, and the page that shows it: complete, and all our own."""

import hashlib
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import httpx

import app.web
from tests.app.service import Service

VENDOR = Path(app.web.__file__).parent / "static" / "vendor"
LISTED = re.compile(r"\| (\S+) \| (\S+) \| (\S+) \| (\S+) \| ([0-9a-f]{64}) \|")


class Loaded(HTMLParser):
    """What a page loads, and what script or style it holds itself."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.inline = False
        self._in_code = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.inline |= any(name.startswith("on") or name == "style" for name in given)
        self.addresses += [given[n] or "" for n in ("src", "href") if n in given]
        self._in_code = tag in {"script", "style"}

    def handle_data(self, data: str) -> None:
        self.inline |= self._in_code and bool(data.strip())


def test_the_page_loads_nothing_from_elsewhere(service: Service) -> None:
    page = httpx.get(f"{service.url}/docs")
    loaded = Loaded()
    loaded.feed(page.text)

    assert page.headers["content-security-policy"].startswith("default-src 'self';")
    assert "unsafe" not in page.headers["content-security-policy"]
    assert page.headers["x-content-type-options"] == "nosniff"
    assert not loaded.inline
    assert "//" not in re.sub("<!.*?>", "", page.text)
    for address in loaded.addresses:
        if not address.startswith("data:"):
            answer = httpx.get(f"{service.url}/{address}")
            assert answer.status_code == 200, address
    script = httpx.get(f"{service.url}/static/docs.js")
    assert "//" not in re.sub(r"// .*", "", script.text)
    assert script.headers["cache-control"] == "public, max-age=3600"
    again = {"If-None-Match": script.headers["etag"]}
    assert httpx.get(f"{service.url}/static/docs.js", headers=again).status_code == 304


def test_vendored_files_are_those_that_are_listed() -> None:
    listed = LISTED.findall((VENDOR / "README.md").read_text())

    files = {p for p in VENDOR.rglob("*") if p.is_file() and p.name != "README.md"}
    assert {VENDOR / row[3] for row in listed} == files
    for _package, _version, licence, name, digest in listed:
        assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() == digest
        assert licence in {"Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "MIT"}
        assert (VENDOR / name).parent.joinpath("LICENSE").exists()


def operations(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        operation for path in document["paths"].values() for operation in path.values()
    ]


def test_every_call_tells_what_it_may_be_answered_with(service: Service) -> None:
    document = httpx.get(f"{service.url}/openapi.json").json()

    assert "HTTPValidationError" not in document["components"]["schemas"]
    for operation in operations(document):
        answers = operation["responses"]
        for status, answer in answers.items():
            problem = {"$ref": "#/components/schemas/Problem"}
            if status >= "400" and operation["operationId"] != "ready":
                (media_type,) = answer["content"]
                assert media_type == "application/problem+json"
                assert answer["content"][media_type]["schema"] == problem
        if "security" in operation:
            assert {"401", "403", "413", "429", "503"} <= answers.keys()
            assert ("`forbidden`" in answers["403"]["description"]) is (
                "admin" in operation["security"][0]["HTTPBearer"]
            )
            assert ("415" in answers) is ("requestBody" in operation)
        if "requestBody" in operation or "parameters" in operation:
            assert "422" in answers


def test_every_call_is_described_and_named_once(service: Service) -> None:
    document = httpx.get(f"{service.url}/openapi.json").json()
    tags = {tag["name"]: tag["description"] for tag in document["tags"]}
    found = operations(document)

    names = [operation["operationId"] for operation in found]
    assert len(set(names)) == len(names)
    assert {tag for operation in found for tag in operation["tags"]} == set(tags)
    for operation in found:
        assert re.fullmatch("[a-z]+(_[a-z]+)*", operation["operationId"])
        assert len(operation["summary"].split()) >= 3
        for answer in operation["responses"].values():
            for link in answer.get("links", {}).values():
                assert link["operationId"] in names
