"""The gate: what learned models must show before they go live.

They are judged by plays that they were not learned from, each foretold from those
before it: beside the models in force, and beside the user's rate of likes of the item,
shrunk, which knows nothing of interest that moves.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial

import numpy as np

from app.domain import ItemModel
from app.services import gate_checks, index_builds, logs, models
from app.services.candidates import Candidate
from app.services.gate_checks import Check, Setting
from app.services.in_force import needs
from app.services.index_tables import Built
from app.services.live import Live
from app.services.mathematics import mood_rule, stacked
from app.services.models import Outcome
from app.services.mood_rules import common
from app.storage import revision
from app.storage.database import Database
from app.storage.store import Store
from learning import NONE, Bools, Floats, Plays
from learning.chain import Chain
from learning.evaluation import Score, compare
from learning.evaluation.rates import arm_rate
from learning.fitting import moods_of
from learning.prediction import liked, predicted
from policies import Mood

LEARNED, PRESENT, RATE = "candidate", "present", "rate"


@dataclass(frozen=True, slots=True)
class Terms:
    """What it takes.

    plays:  that are answered and held out, at least
    users:  who have such plays, at least
    margin: of log loss in nats; the 95 % interval of what the candidate loses more
            than another must end below
    """

    plays: int = 500
    users: int = 10
    margin: float = 0.005


@dataclass(frozen=True, slots=True)
class Verdict:
    """What was found.

    since:  plays from then on were held out
    plays:  of them, those that were answered
    users:  who answered them
    scores: log loss and more, by forecaster; empty where there were too few plays
    """

    since: datetime
    plays: int
    users: int
    checks: Sequence[Check]
    scores: Mapping[str, Mapping[str, object]]

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)

    def plain(self) -> Mapping[str, object]:
        """What JSON can hold."""
        return asdict(self) | {"since": self.since.isoformat(), "passed": self.passed}


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A candidate that was judged, and what it would become.

    outcomes: of its models
    discount: of the tables
    tables:   of the models that change, as fine as they get
    """

    verdict: Verdict
    outcomes: Sequence[Outcome]
    discount: float
    tables: Sequence[Built]


async def judge(
    database: Database,
    live: Live,
    candidate: Candidate,
    terms: Terms,
    progress: Callable[[str], object] = lambda _: None,
) -> Judged:
    """Judge a candidate by the log of plays; `progress` is told what is done next.

    Raises CannotLearn if there is no log to judge by.
    """
    progress("plays")
    plays = await logs.log(database)
    look = partial(_setting, live=live, candidate=candidate, arms=plays.arms)
    setting = await database.run(look)
    progress("forecasts")
    checks = [
        gate_checks.items(candidate, setting),
        gate_checks.clock(candidate, setting),
        gate_checks.signals(plays, setting),
        gate_checks.moods(setting),
        gate_checks.policy(setting),
    ]
    held = _held(plays, candidate)
    users = len(np.unique(plays.user[held]))
    scores: Sequence[Score] = ()
    checks.append(_evidence(int(held.sum()), users, candidate, terms))
    if all(check.passed for check in checks):
        scores = _scores(plays, held, setting, candidate)
        checks += [_not_worse(score, scores[0], terms) for score in scores[1:]]
    tables: Sequence[Built] = ()
    if all(check.passed for check in checks):
        progress("index tables")
        tables, indexable = await asyncio.to_thread(gate_checks.tables, setting)
        checks.append(indexable)
    verdict = Verdict(
        candidate.judged_from,
        int(held.sum()),
        users,
        checks,
        {score.forecaster: score.summary() for score in scores},
    )
    return Judged(verdict, setting.outcomes, setting.discount, tables)


def _setting(
    store: Store, live: Live, candidate: Candidate, arms: Sequence[str]
) -> Setting:
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    serials = [catalogue.known_serial(arm) for arm in arms]
    return Setting(
        [models.outcome(store, new) for new in candidate.models],
        index_builds.in_use(store, known)[0].discount,
        needs(store, known),
        catalogue.versions,
        [catalogue.listing.model[serial] for serial in serials],
        sum(catalogue.serial_of(item) is not None for item in candidate.items),
        known.clock.slot_s,
    )


def _held(plays: Plays, candidate: Candidate) -> Bools:
    if plays.seconds is None:
        raise ValueError("plays: need times")
    since = candidate.judged_from.timestamp()
    held: Bools = (plays.seconds >= since) & (plays.answer != NONE)
    return held


def _evidence(plays: int, users: int, candidate: Candidate, terms: Terms) -> Check:
    enough = plays >= terms.plays and users >= terms.users
    detail = (
        f"{plays} answered plays of {users} users since"
        f" {candidate.judged_from:%Y-%m-%d %H:%M}"
    )
    if not enough:
        detail += f"; it takes {terms.plays} of {terms.users}"
    return Check("evidence", enough, detail)


def _scores(
    plays: Plays, held: Bools, setting: Setting, candidate: Candidate
) -> Sequence[Score]:
    present = {model.id: model for model in setting.versions}
    learned = {each.model.id: each.model for each in setting.outcomes}
    becomes = [
        candidate.items.get(arm, model)
        for arm, model in zip(plays.arms, setting.follows, strict=True)
    ]
    clocked = plays if candidate.slot_s is None else plays.by_clock(candidate.slot_s)
    chances = {
        LEARNED: _chance(clocked, present | learned, becomes),
        PRESENT: _chance(plays, present, setting.follows),
        RATE: arm_rate(plays, ~held),
    }
    return compare(plays, held, chances)[2]


def _chance(
    plays: Plays, there: Mapping[str, ItemModel], follows: Sequence[str]
) -> Floats:
    """(P,) chance that each play is liked, if arms follow these models."""
    number = {model: place for place, model in enumerate(dict.fromkeys(follows))}
    rule = common((model, there[model].mood) for model in there)
    mood = None if rule is None else mood_rule(rule)
    chains = [chain_of(there[model], mood) for model in number]
    rows = np.array([number[model] for model in follows])
    return liked(plays, predicted(plays, chains, rows, moods_of(plays, mood)))


def chain_of(model: ItemModel, mood: Mood | None = None) -> Chain:
    """A model as learning has it, in all moods that there are; with all its samples."""
    plain = stacked([model])
    classes = 1 if mood is None else mood.classes
    by_state = plain.observe_in.swapaxes(1, 2)
    shape = (classes, *by_state.shape[1:])
    observe = np.ascontiguousarray(np.broadcast_to(by_state, shape))
    return Chain(plain.play[0], plain.rest[0], observe, plain.prior[0])


def _not_worse(other: Score, learned: Score, terms: Terms) -> Check:
    gain = other.difference
    low, high = other.difference_ci95
    name = f"not worse than {other.forecaster}"
    detail = (
        f"log loss {learned.log_loss:.4f} against {other.log_loss:.4f}: gains"
        f" {gain:+.4f} ({low:+.4f} to {high:+.4f})"
    )
    passed = low >= -terms.margin
    if not passed:
        detail += f"; it may lose {terms.margin:g} at most"
    return Check(name, passed, detail)
