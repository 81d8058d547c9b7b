"""What other policies would have earned, of a log and of models."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

from app.domain import ItemModel
from app.services.entrants import Entrant
from app.services.items import NewItem
from app.services.mathematics import mathematical
from app.services.mood_rules import common
from app.services.new_models import NewModel, check
from learning import Plays
from learning.em import Spread
from learning.fitting import Recipe, fit
from learning.off_policy import (
    CannotAnswer,
    Catalogue,
    Report,
    Rules,
    catalogue,
    evaluate,
    learned,
)
from policies import Model


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """A log, and the catalogue that policies choose from.

    models: where those come from, for people
    """

    plays: Plays
    catalogue: Catalogue
    models: str


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What a log says of a policy: a report, or why there is none."""

    entrant: Entrant
    report: Report | None
    why: CannotAnswer | None = None

    @property
    def refused(self) -> bool:
        """Whether nothing tells what the policy would have earned."""
        return self.report is None or self.report.refused

    def plain(self) -> Mapping[str, object]:
        """What JSON can hold."""
        why = self.why and {"reason": str(self.why.reason), "detail": self.why.detail}
        return {
            "policy": self.entrant.label,
            "name": self.entrant.name,
            "params": self.entrant.params,
            "refused": self.refused,
            "why": why,
            "report": self.report and self.report.plain(),
        }


def by_kept_models(
    plays: Plays, models: Sequence[ItemModel], items: Sequence[NewItem]
) -> Question:
    """A question about the service's own log, by its models as they are now."""
    known = {model.id: mathematical(model) for model in models}
    return _by_models(plays, known, items, "the models of the database")


def by_new_models(
    plays: Plays, models: Sequence[NewModel], items: Sequence[NewItem]
) -> Question:
    """A question by models and items of files."""
    common((model.id, model.mood) for model in models)
    known = {model.id: check(model) for model in models}
    return _by_models(plays, known, items, "the models given")


def by_learned_models(plays: Plays, recipe: Recipe, spread: Spread) -> Question:
    """A question about half of the users, by models that the other half teaches."""
    half = plays.user % 2 == 0
    fitted = fit(plays.of(half), recipe, spread)
    rest = plays.of(~half)
    return Question(rest, learned(rest, fitted), "models learned from the other users")


def _by_models(
    plays: Plays, models: Mapping[str, Model], items: Sequence[NewItem], told: str
) -> Question:
    known = {*plays.arms}
    more = [item.id for item in items if item.id not in known]
    plays = replace(plays, arms=[*plays.arms, *more])
    model_of = {item.id: item.model for item in items}
    offered = {item.id for item in items if item.active}
    return Question(plays, catalogue(plays, models, model_of, offered), told)


def judge(
    question: Question, entrant: Entrant, rules: Rules, spread: Spread
) -> Verdict:
    """Say what a policy would have earned."""
    try:
        report = evaluate(
            question.plays, question.catalogue, entrant.policy, rules, spread
        )
    except CannotAnswer as why:
        return Verdict(entrant, None, why)
    return Verdict(entrant, report)


def plain(
    question: Question, rules: Rules, verdicts: Sequence[Verdict]
) -> Mapping[str, object]:
    """What JSON can hold of all verdicts."""
    return {
        "plays": len(question.plays),
        "items": int(question.catalogue.offered.sum()),
        "models": question.models,
        "rules": asdict(rules),
        "policies": [verdict.plain() for verdict in verdicts],
    }
