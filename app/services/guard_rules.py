"""When the guard raises an alarm, and when it ends it.

A model is looked at each time that a number of new answers has come in. It takes two
looks in a row, each sure, to raise an alarm, and to end it again two that are sure of
the contrary, on answers that came later. Between the two nothing changes: a model that
is about as good as a simple rate keeps the state it has.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta

from app.domain import ItemModel
from app.services import guard_scores
from app.services.guard_scores import Scores
from app.storage.judgements import Judgement, State

MOST_DOUBLINGS = 5


@dataclass(frozen=True, slots=True)
class Terms:
    """What it takes.

    window: answers that are looked at, at most
    least:  and at least
    step:   new answers between two looks
    looks:  in a row that change a state
    margin: excess loss that is no fault, in nats
    worse:  standard errors of excess above which a model is worse than a simple rate
    better: and of the contrary
    share:  of all answers, those of models in alarm that are worth another policy
    pause:  least time from one policy of the guard's to the next
    lag:    longest time that an answer is waited for
    reach:  age of plays that are left out if nobody checked for so long
    """

    window: int = 2000
    least: int = 500
    step: int = 250
    looks: int = 2
    margin: float = 0.01
    worse: float = 3.0
    better: float = 2.0
    share: float = 0.1
    pause: timedelta = timedelta(minutes=10)
    lag: timedelta = timedelta(minutes=30)
    reach: timedelta = timedelta(days=1)


TERMS = Terms()


def opened(model: ItemModel, before: Judgement | None, at: datetime) -> Judgement:
    """The judgement of a version: that before, or a new one without any evidence."""
    if before is not None and before.version == model.version:
        return before
    trusted = before is None or before.state is State.CALM
    state = State.CALM if trusted else State.TRIAL
    return Judgement(model.id, model.version, policy=0, state=state, since=at)


def under(judgement: Judgement, policy: int) -> Judgement:
    """The same state; under another policy, there is no evidence yet on its plays."""
    if judgement.policy == policy:
        return judgement
    return replace(judgement, policy=policy, streak=0, answers=0, fresh=0, outcomes=b"")


def is_due(judgement: Judgement, terms: Terms) -> bool:
    """Whether there is enough, and enough new, to look at."""
    known = guard_scores.size(judgement.outcomes)
    return known >= terms.least and judgement.fresh >= terms.step


def looked(
    judgement: Judgement, scores: Scores, terms: Terms, at: datetime
) -> Judgement:
    """The judgement after a look."""
    found = _found(judgement.state, scores, terms)
    goes_on = found * judgement.streak > 0
    streak = judgement.streak + found if goes_on else found
    judgement = replace(judgement, streak=streak, fresh=0, scores=asdict(scores))
    if judgement.state is not State.ALARM and streak >= terms.looks:
        return _changed(judgement, State.ALARM, streak, at)
    if judgement.state is not State.CALM and -streak >= needed(judgement, terms):
        return _changed(judgement, State.CALM, 0, at)
    return judgement


def needed(judgement: Judgement, terms: Terms) -> int:
    """Looks in a row that change the state.

    Each fall of a version doubles those that end its alarm: a model may predict well
    what the fallback plays, and not what its own policy would.
    """
    if judgement.state is not State.ALARM:
        return terms.looks
    return terms.looks << min(max(judgement.falls - 1, 0), MOST_DOUBLINGS)


def faulty(judged: Sequence[Judgement], policy: int, terms: Terms) -> Sequence[str]:
    """Models in alarm by what was answered under a policy; none if they matter little.

    What was answered under another does not count: whoever swapped has the last word.
    """
    under = [one for one in judged if one.policy == policy]
    worse = [
        one for one in under if one.state is State.ALARM and one.streak >= terms.looks
    ]
    of_all = sum(one.answers for one in under)
    much = sum(one.answers for one in worse) >= terms.share * of_all
    return [one.model for one in worse] if much else []


def _found(state: State, scores: Scores, terms: Terms) -> int:
    """1: worse than a simple rate, -1: fit to leave the state, 0: neither."""
    excess, error = scores.excess, scores.error
    if excess > terms.margin and excess > terms.worse * error:
        return 1
    fit = state is State.TRIAL or excess < -terms.better * error
    return -1 if fit and state is not State.CALM else 0


def _changed(
    judgement: Judgement, state: State, streak: int, at: datetime
) -> Judgement:
    """Another state, from which only answers that come from now on lead on."""
    return replace(judgement, state=state, since=at, streak=streak, outcomes=b"")
