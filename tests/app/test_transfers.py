"""What is exported can be imported elsewhere: models, items, history."""

import asyncio
import json
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import pytest

from app.api.schemas.lines import HISTORY, ITEMS, MODELS
from app.errors import InvalidImport
from app.services.changes import Imported
from app.services.exports import export_history, export_items, export_models
from app.services.formats import Format
from app.services.histories import HistoryImported, import_history
from app.services.imports import import_items
from app.services.lines import LineFile
from app.services.live import Live
from app.services.model_imports import import_models
from app.settings import Settings
from app.storage.database import Database
from tests.app.service import ADMIN, Service
from tests.catalogues import SERIES, SIMPLE

T = TypeVar("T")


@pytest.fixture
def elsewhere(sqlite_template: Path, tmp_path: Path) -> Iterator[Service]:
    """Another service, empty."""
    path = tmp_path / "elsewhere.db"
    shutil.copy(sqlite_template, path)
    settings = Settings(
        database_url=f"sqlite:///{path}", port=0, bootstrap_key=ADMIN, log_level="error"
    )
    running = Service.start(settings)
    yield running
    running.stop()


def with_database(service: Service, work: Callable[[Database], Awaitable[T]]) -> T:
    async def run() -> T:
        database = Database(service.settings)
        try:
            return await work(database)
        finally:
            await database.close()

    return asyncio.run(run())


def exported(
    service: Service, export: Callable[[Database], AsyncIterator[str]]
) -> list[str]:
    async def lines(database: Database) -> list[str]:
        return [line async for line in export(database)]

    return with_database(service, lines)


def models_in(
    service: Service, text: str, format_: Format = Format.NDJSON, **query: bool
) -> Imported:
    file = LineFile(BytesIO(text.encode()), format_, MODELS)
    return with_database(
        service, lambda database: import_models(database, file, by="test", **query)
    )


def items_in(service: Service, text: str) -> Imported:
    file = LineFile(BytesIO(text.encode()), Format.NDJSON, ITEMS)
    live = Live(service.settings.pending_ttl)
    return with_database(
        service, lambda database: import_items(database, live, file, by="test")
    )


def history_in(
    service: Service,
    text: str,
    format_: Format = Format.NDJSON,
    *,
    dry_run: bool = False,
    any_signal: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> HistoryImported:
    file = LineFile(BytesIO(text.encode()), format_, HISTORY)
    settings = service.settings
    live = Live(settings.pending_ttl)
    return with_database(
        service,
        lambda database: import_history(
            database,
            live,
            settings,
            file,
            any_signal=any_signal,
            dry_run=dry_run,
            progress=progress,
        ),
    )


def test_a_service_can_be_moved_with_all_its_beliefs(
    example: Service, elsewhere: Service
) -> None:
    for user in ("ann", "bob", "日本"):
        for turn in range(7):
            play = example.next(user)
            signal = ("like", "skip", "none")[turn % 3]
            example.answer(play["play"], signal)
    slate = example.next("bob", count=3)["plays"]
    example.answer(slate[1]["play"], "like")
    example.client.post(
        "/v1/users/bob/plays", json={"item": "item-2", "fraction": 0.93}
    )
    for play in slate[::2]:
        example.answer(play["play"], "skip")
    example.put_item("späť", "item-1", tags=["calm"], payload={"n": [1, {"x": "é"}]})
    example.next("ann")
    example.client.delete("/v1/items/item-3")

    files = [exported(example, e) for e in (export_models, export_items)]
    models_in(elsewhere, "".join(files[0]))
    items_in(elsewhere, "".join(files[1]))
    history = exported(example, export_history)
    entered = history_in(elsewhere, "".join(history))

    assert entered == HistoryImported(users=3, entered=25, known=0)
    assert any(json.loads(line).get("together") for line in history)
    assert [exported(elsewhere, e) for e in (export_models, export_items)] == files
    assert exported(elsewhere, export_history) == history
    for user in ("ann", "bob", "日本"):
        assert elsewhere.beliefs(user) == example.beliefs(user)
    assert elsewhere.client.get("/v1/items/item-3").json()["active"] is False


def test_models_of_signals_are_moved_with_all_that_was_told(
    service: Service, elsewhere: Service
) -> None:
    service.put_model("series", SERIES | {"fractions": {"skip": 0, "partial": 0.2}})
    service.put_model("film", SERIES)
    for item, model in (("a", "series"), ("b", "film")):
        service.put_item(item, model)
    plays: list[dict[str, Any]] = [
        {"item": "a", "signal": "complete"},
        {"item": "b", "signal": "partial"},
        {"item": "a", "fraction": 0.3},
    ]
    for play in plays:
        service.client.post("/v1/users/ann/plays", json=play).raise_for_status()
    service.put_model("film", SIMPLE)

    files = [exported(service, e) for e in (export_models, export_items)]
    models_in(elsewhere, "".join(files[0]))
    items_in(elsewhere, "".join(files[1]))
    history = "".join(exported(service, export_history))
    with pytest.raises(InvalidImport) as refused:
        history_in(elsewhere, history)
    entered = history_in(elsewhere, history, any_signal=True)

    assert [fault.field for fault in refused.value.faults] == ["line 2: signal"]
    assert entered == HistoryImported(users=1, entered=3, known=0)
    assert [exported(elsewhere, e) for e in (export_models, export_items)] == files
    assert "".join(exported(elsewhere, export_history)) == history
    assert elsewhere.beliefs("ann") == service.beliefs("ann")


def test_a_share_in_a_history_needs_a_model_that_takes_shares(
    service: Service,
) -> None:
    service.put_model("series", SERIES)
    service.put_item("a", "series")
    lines = [
        {"user": "ann", "item": "a", "signal": "partial"},
        {"user": "ann", "item": "a", "fraction": 0.3},
        {"user": "ann", "item": "a", "signal": "like", "fraction": 0.3},
    ]
    text = "".join(json.dumps(line) + "\n" for line in lines)

    with pytest.raises(InvalidImport) as refused:
        history_in(service, text)
    with pytest.raises(InvalidImport) as still:
        history_in(service, text, any_signal=True)

    fields = [fault.field for fault in refused.value.faults]
    assert fields == ["line 2: fraction", "line 3: signal"]
    assert [fault.field for fault in still.value.faults] == ["line 2: fraction"]


def test_a_history_imported_twice_is_entered_once(example: Service) -> None:
    lines = [
        {"user": "ann", "item": "item-1", "signal": "like"},
        {"user": "bob", "item": "item-1", "fraction": 0.9},
        {"user": "ann", "item": "item-1", "signal": "like"},
        {"user": "ann", "item": "item-2", "signal": "skip", "at": "2025-03-01T10:00Z"},
    ]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    more = text + json.dumps(lines[0]) + "\n"
    done: list[tuple[int, int]] = []

    dry = history_in(example, text, dry_run=True)
    first = history_in(example, text, progress=lambda *some: done.append(some))
    again = history_in(example, text)
    longer = history_in(example, more)

    assert dry == HistoryImported(users=2, entered=0, known=0)
    assert first == HistoryImported(users=2, entered=4, known=0)
    assert again == HistoryImported(users=2, entered=0, known=4)
    assert longer == HistoryImported(users=2, entered=1, known=4)
    assert done == [(4, 4)]
    plays = example.client.get("/v1/users/ann/plays").json()["plays"]
    assert [(play["slot"], play["item"], play["signal"]) for play in plays] == [
        (3, "item-1", "like"),
        (2, "item-2", "skip"),
        (1, "item-1", "like"),
        (0, "item-1", "like"),
    ]
    assert {play["source"] for play in plays} == {"reported"}
    assert plays[1]["answered_at"] == "2025-03-01T10:00:00Z"
    assert example.client.get("/v1/users/bob/plays").json()["plays"][0]["fraction"]


def test_a_history_waits_for_no_pending_play(example: Service) -> None:
    offered = example.next("ann")

    history_in(
        example,
        "user,item,signal,fraction,at\nann,item-4,like,,\nann,item-4,,0.2,\n",
        Format.CSV,
    )

    again = example.next("ann")
    assert (again["play"], again["slot"], again["pending"]) == (
        offered["play"],
        2,
        True,
    )
    assert example.answer(offered["play"], "like")["slot"] == 3


def test_plays_of_one_line_after_another_can_share_a_slot(example: Service) -> None:
    text = """user,item,signal,together
ann,item-1,like,true
ann,item-2,skip,true
ann,item-2,none,true
ann,item-3,like,false
ann,item-4,like,
ann,item-5,none,TRUE
"""

    first = history_in(example, text, Format.CSV)
    again = history_in(example, text, Format.CSV)

    assert (first.entered, again.entered) == (6, 0)
    plays = example.client.get("/v1/users/ann/plays").json()["plays"]
    assert [(play["slot"], play["place"], play["item"]) for play in plays[::-1]] == [
        (0, 0, "item-1"),
        (0, 1, "item-2"),
        (1, 0, "item-2"),  # no item is played twice in a slot
        (2, 0, "item-3"),
        (3, 0, "item-4"),
        (3, 1, "item-5"),
    ]


def test_no_play_is_entered_unless_all_lines_are_good(example: Service) -> None:
    lines: list[dict[str, Any]] = [
        {"user": "ann", "item": "item-1", "signal": "like"},
        {"user": "ann", "item": "item-9", "signal": "like"},
        {"user": "ann", "item": "item-1"},
        {"user": "ann", "item": "item-1", "signal": "love"},
        {"user": "ann", "item": "item-1", "fraction": 2},
        {"user": "ann", "item": "item-1", "fraction": True},
        {"user": "ann", "item": "item-1", "signal": "skip", "at": "yesterday"},
        {"user": "ann", "item": "item-1", "signal": "skip", "at": "2025-03-01T10:00"},
        {"user": "a b", "item": "item-1", "signal": "skip"},
    ]

    with pytest.raises(InvalidImport) as refused:
        history_in(example, "".join(json.dumps(line) + "\n" for line in lines))

    assert [fault.field for fault in refused.value.faults] == [
        "line 2: item",
        "line 3",
        "line 4: signal",
        "line 5: fraction",
        "line 6: fraction",
        "line 7: at",
        "line 8: at",
        "line 9: user",
    ]
    assert example.beliefs("ann")["slot"] == 0


def test_models_are_imported_all_or_none(service: Service) -> None:
    pop: dict[str, Any] = {
        "id": "pop",
        "states": ["low", "high"],
        "play": [[0.9, 0.1], [0.4, 0.6]],
        "rest": [[0.7, 0.3], [0.1, 0.9]],
        "like": [0.2, 0.9],
        "prior": [0.5, 0.5],
    }
    jazz = pop | {"id": "jazz", "source": "by ear"}
    bad = [
        pop,
        pop | {"id": "a", "prior": [1, 1]},
        pop,
        7,
        pop | {"id": "b", "like": 1},
    ]

    with pytest.raises(InvalidImport) as refused:
        models_in(service, json.dumps(bad, indent=2), Format.JSON)
    dry = models_in(service, json.dumps([pop, jazz]), Format.JSON, dry_run=True)
    first = models_in(service, json.dumps([pop, jazz]), Format.JSON)
    again = models_in(service, json.dumps(jazz | {"source": "by eye"}))

    assert [fault.field for fault in refused.value.faults] == [
        "entry 2: prior",
        "entry 3: id",
        "entry 4",
        "entry 5: like",
    ]
    assert dry == Imported(2, 0, 0, 0, dry_run=True)
    assert first == Imported(2, 0, 0, 0, dry_run=False)
    assert again == Imported(0, 1, 0, 0, dry_run=False)
    assert service.client.get("/v1/models/jazz").json()["version"] == 2


def test_an_import_beside_a_running_service_loses_nothing(example: Service) -> None:
    """Each runs again when the other was first."""
    text = "".join(
        json.dumps({"id": f"new-{number}", "model": "item-1"}) + "\n"
        for number in range(2000)
    )

    with ThreadPoolExecutor(1) as beside:
        imported = beside.submit(items_in, example, text)
        for number in range(40):
            example.put_item(f"put-{number}", "item-2")
        created = imported.result().created

    found = [json.loads(line)["id"] for line in exported(example, export_items)]
    assert created == 2000
    assert len(found) == len(set(found)) == 5 + 40 + 2000
    example.next("ann", candidate="new-1999")
