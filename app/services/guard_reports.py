"""What the guard knows, and what would happen next."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from app.domain import PolicyVersion
from app.services import guard_regime, guard_rules, guard_scores, policy
from app.services.guard_fallback import Fallback
from app.services.guard_regime import Regime
from app.services.guard_rules import TERMS
from app.services.guard_scores import Scores
from app.settings import Settings
from app.storage import judgements, revision
from app.storage.judgements import Judgement
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Judged:
    """A model: how it stands, how many looks would change that, and its scores."""

    judgement: Judgement
    known: int
    needed: int
    scores: Scores | None


@dataclass(frozen=True, slots=True)
class Report:
    """The guard, as all processes see it.

    instead_of: the version of the policy that it replaced and would put back
    """

    mode: str
    fallback: Fallback
    in_force: PolicyVersion
    instead_of: int | None
    outlook: str
    checked_at: datetime | None
    models: Sequence[Judged]


def report(store: Store, settings: Settings) -> Report:
    regime = guard_regime.present(store, revision.current(store))
    present = regime.present
    before = None
    if present.is_fallback:
        before = policy.find_before(store, present.version).version
    progress = judgements.progress(store)
    fallback = Fallback.of(settings)
    return Report(
        settings.guard,
        fallback,
        present,
        before,
        _outlook(settings.guard, fallback, regime, before),
        None if progress is None else progress.checked_at,
        [_judged(judgement) for judgement in judgements.every(store)],
    )


def _judged(judgement: Judgement) -> Judged:
    kept = judgement.scores
    return Judged(
        judgement,
        guard_scores.size(judgement.outcomes),
        guard_rules.needed(judgement, TERMS),
        None if kept is None else guard_scores.of(kept),
    )


def _outlook(mode: str, fallback: Fallback, regime: Regime, before: int | None) -> str:
    """What would happen next, in words."""
    if mode == "off":
        return "Nothing: the guard is off."
    if mode == "watch":
        return "An alarm would be told, and change nothing."
    if before is not None:
        return f"Version {before} is put back once every model is calm."
    if not any(map(fallback.would_help, regime.policies)):
        return "An alarm would be told: the policy in force asks no model."
    return f"An alarm would put {fallback.name} in force."
