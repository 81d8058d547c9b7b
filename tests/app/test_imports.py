"""Import of items: a whole file, or nothing of it."""

import json
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

import pytest

from tests.app.service import Service

NDJSON = "application/x-ndjson"
MODEL = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.9],
    "prior": [0.5, 0.5],
}
BROKEN_CSV = [
    ("id,model,colour\na,pop,red\n", "line 1"),
    ("id,model,id\na,pop,b\n", "line 1"),
    ("id,model\na\n", "line 2"),
    ("id,model\n\na,pop,x\n", "line 3"),
    ('id,model,title\na,pop,"two\nlines"\nb,pop\n', "line 2: title"),
    ('id,model,title\na,pop,"never closed\n', "line 2"),
    ('id,model\na,"pop"x\n', "line 2"),
    ("id,model,payload\na,pop,[1]\n", "line 2: payload"),
    ("id,model,payload\na,pop,{\n", "line 2: payload"),
    ("id,title\na,x\n", "line 2: model"),
    ("id,model,active\na,pop,perhaps\n", "line 2: active"),
    ("id,model\na\x00,pop\n", "line 2: id"),
    ("id,model\ra,pop\r", "line 1"),
    ("id,model\na,pop," + "x" * 200_000 + "\n", "line 2"),
]


@pytest.fixture
def catalogue(service: Service) -> Service:
    service.put_model("pop", MODEL)
    return service


def ndjson(*records: Mapping[str, Any]) -> bytes:
    return b"".join(json.dumps(record).encode() + b"\n" for record in records)


def post(
    service: Service, body: bytes | Iterable[bytes], kind: str = NDJSON, **query: bool
) -> tuple[int, dict[str, Any]]:
    answer = service.client.post(
        "/v1/items/import",
        content=body,
        headers={"Content-Type": kind},
        params=query,
    )
    told: dict[str, Any] = answer.json()
    return answer.status_code, told


def changes(told: Mapping[str, Any]) -> tuple[int, int, int, int]:
    return told["created"], told["replaced"], told["unchanged"], told["retired"]


def names(service: Service, **query: object) -> list[str]:
    page = service.client.get("/v1/items", params=query).json()  # type: ignore[arg-type]
    return [item["id"] for item in page["items"]]


def test_an_import_creates_replaces_and_leaves_alone(catalogue: Service) -> None:
    catalogue.put_item("same", "pop")
    catalogue.put_item("other", "pop", tags=["calm"])
    catalogue.put_item("missing", "pop")
    file = ndjson(
        {"id": "same", "model": "pop", "title": "same"},
        {"id": "new", "model": "pop", "payload": {"url": "x"}},
        {"id": "other", "model": "pop", "title": "changed"},
    )

    status, told = post(catalogue, file)

    assert (status, changes(told), told["dry_run"]) == (200, (1, 1, 1, 0), False)
    assert names(catalogue) == ["missing", "new", "other", "same"]
    assert catalogue.client.get("/v1/items/other").json()["title"] == "changed"
    assert catalogue.client.get("/v1/items/other").json()["tags"] == []
    assert changes(post(catalogue, file)[1]) == (0, 0, 3, 0)


def test_what_the_file_leaves_out_is_retired_on_request(catalogue: Service) -> None:
    catalogue.put_item("kept", "pop")
    catalogue.put_item("gone", "pop", payload={"still": "here"})

    _, told = post(
        catalogue,
        ndjson({"id": "kept", "model": "pop", "title": "kept"}),
        retire_missing=True,
    )

    gone = catalogue.client.get("/v1/items/gone").json()
    assert changes(told) == (0, 0, 1, 1)
    assert names(catalogue) == ["kept"]
    assert (gone["active"], gone["payload"]) == (False, {"still": "here"})
    assert catalogue.next("ann")["item"] == "kept"


def test_a_dry_run_tells_all_and_changes_nothing(catalogue: Service) -> None:
    catalogue.put_item("old", "pop")
    file = ndjson({"id": "new", "model": "pop"})

    _, told = post(catalogue, file, dry_run=True, retire_missing=True)

    assert (changes(told), told["dry_run"]) == ((1, 0, 0, 1), True)
    assert names(catalogue) == ["old"]
    assert post(catalogue, b"{}", dry_run=True)[0] == 422


def test_csv_says_the_same_as_ndjson(catalogue: Service) -> None:
    file = (
        "\ufefftags,id,model,title,payload\r\n"
        'calm;late,a,pop,"Night, ""Drive""\u00fc","{""bpm"": 90}"\r\n'
        "\r\n"
        ",b,pop,,\r\n"
    ).encode()

    status, told = post(catalogue, file, "text/csv; charset=utf-8")
    same = ndjson(
        {
            "id": "a",
            "model": "pop",
            "title": 'Night, "Drive"\u00fc',
            "tags": ["calm", "late"],
            "payload": {"bpm": 90},
        },
        {"id": "b", "model": "pop"},
    )

    assert (status, changes(told)) == (200, (2, 0, 0, 0))
    assert changes(post(catalogue, same)[1]) == (0, 0, 2, 0)


def test_every_line_in_error_is_told_and_nothing_is_changed(catalogue: Service) -> None:
    lines = [
        b'\xef\xbb\xbf{"id": "good", "model": "pop"}\r',
        b'{"id": "good", "model": "pop"}',
        b'{"id": "a", "model": "jazz"}',
        b"",
        b'{"id": "b"}',
        b'{"id": "c", "model": "pop", "title": 7}',
        b'{"id": "d e", "model": "pop"}',
        b'{"id": "\\u0000", "model": "pop"}',
        b'{"id": "e", "model": "pop", "title": "\\ud800"}',
        b'{"id": "f", "model": "pop", "payload": {"x": NaN}}',
        b'{"id": "g", "model": "pop", "payload": {"x": 1e999}}',
        b'{"id": "h", "model": "pop", "colour": "red"}',
        b'["i"]',
        b"{",
        b'{"id": "\xff"}',
        b'{"id": "j", "model": "pop", "payload": ' + b"[" * 100_000,
        b'{"id": "k", "title": "' + b"x" * 1_000_000 + b'"}',
        b'{"id": "l", "model": "pop", "tags": ["calm", "calm"]}',
        b'{"id": "m", "model": "pop", "active": "no"}',
        b'{"id": "n", "model": "pop", "payload": {"x": ' + b"9" * 5000 + b"}}",
    ]

    status, told = post(catalogue, b"\n".join(lines))

    assert (status, told["code"]) == (422, "invalid_import")
    assert "18 faults" in told["detail"]
    assert [fault["field"] for fault in told["errors"]] == [
        "line 2: id",
        "line 3: model",
        "line 5: model",
        "line 6: title",
        "line 7: id",
        "line 8: id",
        "line 9: title",
        "line 10: payload",
        "line 11: payload",
        "line 12: colour",
        *(f"line {line}" for line in range(13, 18)),
        "line 18: tags",
        "line 19: active",
        "line 20",
    ]
    assert told["errors"][1]["value"] == "jazz"
    assert told["errors"][1]["message"] == "unknown model 'jazz'"
    assert told["errors"][0]["message"] == "is also on line 1"
    assert names(catalogue) == []


def test_only_the_first_faults_are_listed_and_all_are_counted(
    catalogue: Service,
) -> None:
    file = ndjson(*({"id": f"i{n}", "model": "jazz"} for n in range(250)))

    _, told = post(catalogue, b"oops\n" + file)

    assert "251 faults" in told["detail"]
    assert len(told["errors"]) == 100
    assert told["errors"][0]["field"] == "line 1"
    assert told["errors"][-1]["field"] == "line 100: model"


def test_a_broken_csv_is_told_by_line(catalogue: Service) -> None:
    for text, field in BROKEN_CSV:
        status, told = post(catalogue, text.encode(), "text/csv")

        assert (status, told["code"]) == (422, "invalid_import"), text
        assert told["errors"][0]["field"] == field
    assert names(catalogue) == []


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("id,titel", "unknown column 'titel'; known are id, model, title, tags"),
        ("id;model", "unknown column 'id;model'; known are id, "),
    ],
)
def test_a_column_that_is_unknown_is_told_with_those_that_are_known(
    catalogue: Service, header: str, message: str
) -> None:
    _, told = post(catalogue, f"{header}\na,pop\n".encode(), "text/csv")

    (fault,) = told["errors"]
    assert fault["message"].startswith(message)
    assert ("separated by commas" in fault["message"]) is (";" in header)


def test_an_empty_file_is_no_error(catalogue: Service) -> None:
    for kind, body in product([NDJSON, "text/csv"], [b"", b"\n\n", b"\xef\xbb\xbf"]):
        assert changes(post(catalogue, body, kind)[1]) == (0, 0, 0, 0)


def test_what_is_no_known_text_is_refused(catalogue: Service) -> None:
    file = ndjson({"id": "a", "model": "pop"})

    assert post(catalogue, file, "application/json")[0] == 415
    assert post(catalogue, file, "text/csv; charset=latin-1")[0] == 415
    assert post(catalogue, file, "")[1]["code"] == "unsupported_media_type"
    assert post(catalogue, "id,model".encode("utf-16"), "text/csv")[0] == 422


def test_an_import_needs_an_admin_key(catalogue: Service) -> None:
    made = catalogue.client.post(
        "/v1/admin/keys", json={"scope": "serve", "name": "app"}
    ).json()
    with catalogue.with_key(made["key"]) as client:
        answer = client.post(
            "/v1/items/import", content=b"", headers={"Content-Type": NDJSON}
        )
        assert answer.status_code == 403
        assert client.get("/v1/items").status_code == 200


def test_ten_thousand_items_land_whole(catalogue: Service) -> None:
    """Sent in chunks, without saying how many; the service answers meanwhile."""
    file = ndjson(*(_track(number) for number in range(10_000)))
    chunks = [file[start : start + 60_000] for start in range(0, len(file), 60_000)]

    _, created = post(catalogue, iter(chunks))
    _, unchanged = post(catalogue, file)
    other = file.replace(b'"Track', b'"Song')
    _, replaced = post(catalogue, other, retire_missing=True)

    assert changes(created) == (10_000, 0, 0, 0)
    assert changes(unchanged) == (0, 0, 10_000, 0)
    assert changes(replaced) == (0, 10_000, 0, 0)
    assert catalogue.next("ann")["title"].startswith("Song")


def _track(number: int) -> dict[str, Any]:
    return {
        "id": f"track-{number}",
        "model": "pop",
        "title": f"Track {number}",
        "tags": ["calm", f"year-{number % 50}"],
        "payload": {"url": f"https://example.com/{number}.mp3", "length": number},
    }


def test_a_file_without_items_retires_nothing(catalogue: Service) -> None:
    post(catalogue, ndjson(_track(1)))

    status, told = post(catalogue, b"", retire_missing=True)

    assert (status, told["code"]) == (422, "invalid_import")
    assert catalogue.client.get("/v1/items/track-1").json()["active"]
