"""The guard: models that predict worse than a simple rate do not choose for long.

What was predicted and answered is in the log of plays. One check at a time, of
whatever process, reads on in it, and keeps how each model stands: all see the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import partial
from uuid import UUID

from app.domain import GUARD, PolicyVersion
from app.play_ids import since
from app.services import (
    guard_reading,
    guard_regime,
    guard_rules,
    guard_scores,
    policy,
)
from app.services.guard_fallback import Fallback
from app.services.guard_regime import Regime
from app.services.guard_rules import TERMS, Terms
from app.services.guard_scores import Outcome
from app.storage import judgements, models, revision
from app.storage.judgements import Judgement, Progress, State
from app.storage.store import Store

NAMED = 5  # models that a note names


@dataclass(frozen=True, slots=True)
class Checked:
    """What a check changed.

    changed:  models whose state is another now
    replaced: the policy put in force, if any
    more:     whether there is more of the log to read
    """

    changed: Sequence[Judgement]
    replaced: PolicyVersion | None
    more: bool


def is_due(store: Store, now: datetime, every: timedelta) -> bool:
    """Whether no process has checked for a while, also if the clock went back."""
    progress = judgements.progress(store)
    return progress is None or abs(now - progress.checked_at) >= every


def check(
    store: Store, now: datetime, fallback: Fallback | None, terms: Terms = TERMS
) -> Checked:
    """Read on in the log, judge the models, act on it.

    fallback: None: no policy is replaced
    """
    count = revision.checks(store)
    known = revision.current(store)
    regime = guard_regime.present(store, known)
    before = {judgement.model: judgement for judgement in judgements.every(store)}
    present = models.at(store, known.catalogue)
    after = _read_to(store, now, terms)
    reading = guard_reading.read(store, after, present, now - terms.lag)
    judged = []
    for model in present:
        judgement = guard_rules.opened(model, before.get(model.id), now)
        told = regime.of(reading.told.get(model.id, ()))
        if told:
            judgement = guard_rules.under(judgement, regime.number)
        judged.append(_judged(store, judgement, told, terms, now))
    replaced = None
    if fallback is not None:
        judged, replaced = _act(store, regime, judged, fallback, terms, now)
    _keep(store, before, judged)
    judgements.go_on(store, Progress(reading.after, now))
    revision.advance_checks(store, count)
    return Checked(_changed(before, judged), replaced, reading.more)


def _read_to(store: Store, now: datetime, terms: Terms) -> UUID:
    """The last play that was read; what came long ago is left out."""
    progress = judgements.progress(store)
    first = since(now - terms.reach)
    return first if progress is None else max(progress.after, first)


def _judged(
    store: Store,
    judgement: Judgement,
    new: Sequence[Outcome],
    terms: Terms,
    now: datetime,
) -> Judgement:
    """The judgement of a model after further plays."""
    if not new:
        return judgement
    judgement = replace(
        judgement,
        answers=judgement.answers + len(new),
        fresh=judgement.fresh + len(new),
        outcomes=guard_scores.appended(judgement.outcomes, new, terms.window),
    )
    if not guard_rules.is_due(judgement, terms):
        return judgement
    look = partial(guard_scores.scored, guard_scores.unpacked(judgement.outcomes))
    return guard_rules.looked(judgement, store.aside(look), terms, now)


def _act(
    store: Store,
    regime: Regime,
    judged: list[Judgement],
    fallback: Fallback,
    terms: Terms,
    now: datetime,
) -> tuple[list[Judgement], PolicyVersion | None]:
    """Replace the policy in force if that is called for."""
    known, present = regime.known, regime.present
    if present.by == GUARD and now - present.activated_at < terms.pause:
        return judged, None
    if present.is_fallback:
        if any(judgement.state is not State.CALM for judgement in judged):
            return judged, None
        note = "No model is in alarm any more."
        return judged, policy.put_back(store, known, note).version
    faulty = guard_rules.faulty(judged, regime.number, terms)
    if not faulty or not any(map(fallback.would_help, regime.policies)):
        return judged, None
    fell = [
        replace(one, falls=one.falls + 1) if one.model in faulty else one
        for one in judged
    ]
    name, params = fallback.name, fallback.params
    replaced = policy.fall_back(store, known, name, params, _note(faulty))
    return fell, replaced.version


def _note(faulty: Sequence[str]) -> str:
    names = ", ".join(map(repr, faulty[:NAMED]))
    others = len(faulty) - NAMED
    rest = f" and {others} others" if others > 0 else ""
    return f"Predicted worse than a simple rate: {names}{rest}."


def _keep(
    store: Store, before: Mapping[str, Judgement], judged: Sequence[Judgement]
) -> None:
    """Note what has changed, and drop what is of no model any more."""
    for judgement in judged:
        if judgement != before.get(judgement.model):
            judgements.keep(store, judgement)
    for model in before.keys() - {judgement.model for judgement in judged}:
        judgements.drop(store, model)


def _changed(
    before: Mapping[str, Judgement], judged: Sequence[Judgement]
) -> Sequence[Judgement]:
    """Judgements whose state is another than it was."""
    return [
        one
        for one in judged
        if one.model in before and one.state is not before[one.model].state
    ]
