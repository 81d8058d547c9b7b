"""What the gate asks of a candidate beside its forecasts."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

from app.domain import ItemModel
from app.errors import MoodsDiffer, SamplesApart, TooManyStates
from app.services import index_tables, models
from app.services.candidates import Candidate
from app.services.changes import Change
from app.services.index_coverage import Need, check_usable, is_small
from app.services.index_tables import Built
from app.services.models import Outcome
from app.services.mood_rules import common
from learning import Plays


@dataclass(frozen=True, slots=True)
class Check:
    """Something that was asked of a candidate."""

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True, slots=True)
class Setting:
    """What is in force, and what would become of it.

    outcomes: of the models of the candidate
    discount: of the tables that are wanted
    needs:    what tables policies in force look scores up in
    versions: models in force
    follows:  which of them each arm of the log follows
    known:    items of the candidate that are in the catalogue
    slot_s:   seconds of a slot, None: slots are counted by plays
    """

    outcomes: Sequence[Outcome]
    discount: float
    needs: Sequence[Need]
    versions: Sequence[ItemModel]
    follows: Sequence[str]
    known: int
    slot_s: float | None


def items(candidate: Candidate, setting: Setting) -> Check:
    there = {model.id for model in setting.versions}
    there |= {new.id for new in candidate.models}
    lacking = sorted(set(candidate.items.values()) - there)
    detail = f"{setting.known} of {len(candidate.items)} are in the catalogue"
    if lacking:
        detail += f"; there is no model {lacking[0]!r}"
    return Check("items", setting.known > 0 and not lacking, detail)


def clock(candidate: Candidate, setting: Setting) -> Check:
    told = [
        "by plays" if slot_s is None else f"by slots of {slot_s:g} s"
        for slot_s in (candidate.slot_s, setting.slot_s)
    ]
    detail = f"interest rests {told[0]}"
    if candidate.slot_s != setting.slot_s:
        detail += f", and in the service {told[1]}: see /v1/admin/clock"
    return Check("clock", candidate.slot_s == setting.slot_s, detail)


def signals(plays: Plays, setting: Setting) -> Check:
    ours = tuple(plays.signals), tuple(plays.reward)
    for outcome in setting.outcomes:
        told = models.signals(outcome.model)
        if (tuple(told.names), tuple(told.reward)) != ours:
            detail = f"the model {outcome.model.id!r} has others than those in force"
            return Check("signals", passed=False, detail=detail)
    return Check("signals", passed=True, detail=", ".join(plays.signals))


def moods(setting: Setting) -> Check:
    there = {model.id: model for model in setting.versions}
    learned = {each.model.id: each.model for each in setting.outcomes}
    try:
        rule = common((each.id, each.mood) for each in (there | learned).values())
    except MoodsDiffer as error:
        return Check("mood", passed=False, detail=error.detail)
    return Check("mood", passed=True, detail="none" if rule is None else "one")


def policy(setting: Setting) -> Check:
    """Whether the policy in force can choose plays by such models."""
    learned = [each.model for each in setting.outcomes]
    try:
        check_usable(learned, setting.needs)
    except (SamplesApart, TooManyStates) as error:
        return Check("policy", passed=False, detail=error.detail)
    return Check("policy", passed=True, detail="the one in force can use them")


def tables(setting: Setting) -> tuple[Sequence[Built], Check]:
    """Tables of the models that change, and whether these are indexable."""
    changed = [
        outcome.model
        for outcome in setting.outcomes
        if outcome.change is not Change.UNCHANGED
    ]
    chains = [
        (model, sample)
        for model in changed
        if is_small(model)
        for sample in range(model.chains)
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        build = partial(_table, discount=setting.discount)
        built = [*pool.map(build, chains)]
    large = [model.id for model in changed if not is_small(model)]
    faulty = sorted({each.record.model for each in built if not each.record.indexable})
    detail = f"at discount {setting.discount}"
    if faulty:
        detail += f", not so: {', '.join(faulty)}"
    if large:
        detail += f", of too many states to tell: {', '.join(large)}"
    return built, Check("indexable", not faulty, detail)


def _table(chain: tuple[ItemModel, int], discount: float) -> Built:
    """As fine as it gets; of samples, of which there are many, a rough one."""
    model, sample = chain
    if model.samples is not None:
        return index_tables.rough(model, sample, discount)
    return index_tables.full(model, sample, discount, progress=lambda _: None)
