"""Import of plays that users made before there was Encore, in the order of a file."""

import asyncio
import hashlib
import json
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from itertools import islice

from app.domain import Answer, Clock, ItemModel, Play
from app.errors import Fault, UnknownSignal
from app.services import clocks
from app.services.answers import answer_of, reply_of
from app.services.catalogue import Catalogue
from app.services.lines import LineFile
from app.services.live import Live
from app.services.staging import Staging
from app.services.standing import Standing
from app.settings import Settings
from app.storage import plays, revision, users
from app.storage.database import Database
from app.storage.store import Store

FIELDS = ("user", "item", "signal", "fraction", "at", "together", "slot")
TOGETHER = 64  # users whose plays may share one group commit


@dataclass(frozen=True, slots=True)
class PastPlay:
    """A play and its answer: a signal, else the share that was played; `at` as ISO.

    together: it took place in the slot of the user's play before it
    slot:     in which it took place, where slots follow a clock; else that is of `at`
    """

    user: str
    item: str
    signal: str | None
    fraction: float | None
    at: str | None
    together: bool = False
    slot: int | None = None


@dataclass(frozen=True, slots=True)
class HistoryImported:
    """What an import of plays did.

    users:   that the file names
    entered: plays that are new
    known:   plays that an earlier import of the same lines had entered
    """

    users: int
    entered: int
    known: int


@dataclass(slots=True)
class Histories:
    """The plays of a file, by user, in order."""

    staged: Staging[PastPlay]
    by_user: dict[str, "array[int]"] = field(default_factory=dict)

    def add(self, line: int, play: PastPlay) -> None:
        self.by_user.setdefault(play.user, array("q")).append(len(self.staged))
        self.staged.add(line, play)

    def of(self, user: str) -> list[PastPlay]:
        return [self.staged[number] for number in self.by_user[user]]


async def import_history(  # noqa: PLR0913 - what to enter where, and how
    database: Database,
    live: Live,
    settings: Settings,
    file: LineFile[PastPlay],
    *,
    any_signal: bool = False,
    dry_run: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> HistoryImported:
    """Enter the plays of a file, once all its lines are found good.

    Each user's plays are one unit of work; those that an import of the same lines has
    entered before are left out. `any_signal`: take also signals that an item's model
    does not have. `progress` is told how many are done, and of how many.
    """
    catalogue = await database.run(partial(_catalogue, live=live))
    with Staging(FIELDS, PastPlay) as staged:
        histories = Histories(staged)
        check = partial(_check, settings, any_signal=any_signal)
        await asyncio.to_thread(_stage, file, histories, catalogue, check)
        users_ = len(histories.by_user)
        if dry_run:
            return HistoryImported(users_, 0, 0)
        entered = done = 0
        for some in _in_groups(histories.by_user):
            work = (
                partial(
                    _enter, live=live, settings=settings, history=histories.of(user)
                )
                for user in some
            )
            entered += sum(await asyncio.gather(*map(database.run, work)))
            done += sum(len(histories.by_user[user]) for user in some)
            if progress is not None:
                progress(done, len(staged))
        return HistoryImported(users_, entered, len(staged) - entered)


def _catalogue(store: Store, live: Live) -> Catalogue:
    return live.catalogue(store, revision.current(store))


def _stage(
    file: LineFile[PastPlay],
    histories: Histories,
    catalogue: Catalogue,
    check: Callable[[ItemModel, PastPlay], object],
) -> None:
    faults = file.faults()
    for line, play in file.entries(faults):
        serial = catalogue.serial_of(play.item)
        if serial is None:
            faults.add(line, Fault("item", f"unknown item {play.item!r}", play.item))
            continue
        try:
            check(catalogue.model_of(serial), play)
        except UnknownSignal as error:
            faults.add(line, *error.faults)
        else:
            histories.add(line, play)
    faults.refuse()


def _check(
    settings: Settings, model: ItemModel, play: PastPlay, *, any_signal: bool
) -> None:
    if play.signal is None or not any_signal:
        answer_of(model, reply_of(settings, play.signal, play.fraction))


def _in_groups(names: Iterable[str]) -> Iterator[list[str]]:
    rest = iter(names)
    while some := list(islice(rest, TOGETHER)):
        yield some


def _enter(
    store: Store, live: Live, settings: Settings, history: Sequence[PastPlay]
) -> int:
    """Enter those plays of one user that were not entered before; tell how many."""
    known, user = users.by_id(store, history[0].user)
    catalogue = live.catalogue(store, known)
    before = plays.idempotency_keys(store, user.id)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    entered = 0
    last: Play | None = None
    for key, play in _keyed(history):
        if key in before:
            last = None
            continue
        at = None if play.at is None else datetime.fromisoformat(play.at)
        if not play.together:
            last = None
            _move_on(standing, known.clock, play.slot, at)
            standing.forget()
        serial = catalogue.listing.serials[play.item]
        answer = _answer(settings, catalogue.model_of(serial), play)
        last = standing.report(serial, answer, key, at, beside=last)
        standing.learn(last, last.slot, answer)
        entered += 1
    if entered:
        standing.save()
    return entered


def _move_on(
    standing: Standing, clock: Clock, slot: int | None, at: datetime | None
) -> None:
    """Go to the slot of a play, where slots follow a clock."""
    if clock.slot_s is None:
        return
    if slot is not None:
        standing.slot = max(standing.slot, slot)
        if at is not None:
            at = min(at, standing.at)
            standing.anchor = clocks.tied(standing.slot, at, clock)
    elif at is not None:
        standing.keep_time(clock, at)


def _keyed(history: Iterable[PastPlay]) -> Iterator[tuple[str, PastPlay]]:
    """Each play with a key of its own: what it says, and the how-manieth it is."""
    count: Counter[PastPlay] = Counter()
    for play in history:
        count[play] += 1
        plain = [play.item, play.signal, play.fraction, play.at, count[play]]
        together = ["together"] if play.together else []
        slot = [] if play.slot is None else [play.slot]
        said = json.dumps(plain + together + slot)
        digest = hashlib.sha256(said.encode()).hexdigest()
        yield f"import:{digest}", play


def _answer(settings: Settings, model: ItemModel, play: PastPlay) -> Answer:
    if play.signal is not None:
        return Answer(play.signal, play.fraction)
    return answer_of(model, reply_of(settings, None, play.fraction))
