"""What a policy would have earned, by all methods that a log allows."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from learning.em import Spread
from learning.off_policy.cannot import CannotAnswer, Reason
from learning.off_policy.catalogue import Catalogue
from learning.off_policy.choices import Choices, choices
from learning.off_policy.estimators import (
    Ratio,
    direct,
    doubly_robust,
    ips,
    logged,
    replay,
    snips,
)
from learning.off_policy.intervals import Resampled, resampled
from learning.off_policy.report import MATCHES, Answer, Refusal, Report
from learning.off_policy.rules import RULES, Rules
from learning.off_policy.support import (
    Support,
    check,
    check_chance,
    check_effective,
    check_propensities,
    check_uniform,
    clipped,
    effective,
    support,
)
from learning.plays import Plays
from policies import Policy


def evaluate(
    plays: Plays,
    catalogue: Catalogue,
    policy: Policy,
    rules: Rules = RULES,
    spread: Spread = map,
) -> Report:
    """Say what a policy would have earned, in place of the one that chose.

    One choice is weighed against the log's in the situation in which it was made. A
    policy that is followed for longer meets others, which its own plays lead to; that
    is what several choices in a row are for: of each play, the user's last ones,
    weighed together (per-decision importance sampling, Precup, Sutton and Singh 2000).
    Plays that users chose themselves happen to any policy.

    Args:
        plays: the log. Plays whose propensity is not known only teach what is believed.
        catalogue: of its arms.
        policy: the other policy.
        rules: how to ask.
        spread: how users are shared out, over threads at most.

    Returns:
        A report; each method's estimate, or why it has none.

    Raises:
        CannotAnswer: no method could have any.
    """
    known = np.empty(0) if plays.propensity is None else plays.propensity
    check_propensities(known[~np.isnan(known)])
    found = choices(plays, catalogue, policy, rules.seed, spread)
    return report(found, rules)


def report(found: Choices, rules: Rules = RULES) -> Report:
    """Say what choices tell; see `evaluate`.

    Raises:
        CannotAnswer: there are too few.
    """
    given = found.of(found.answered)
    users = len(np.unique(given.user))
    _check_size(len(given.user), users, rules)
    supports = [
        support(found, found.weights(n + 1), rules.clip) for n in range(rules.in_a_row)
    ]
    asked = [*_asked(found, given, rules, supports)]
    ratios = [each.ratio for each in asked if each.refusal is None]
    drawn = resampled(
        [logged(given), direct(given), *ratios], given.user, rules.draws, rules.seed
    )
    return Report(
        len(found.user),
        len(given.user),
        users,
        drawn.estimate(0),
        drawn.estimate(1),
        supports,
        [*_answers(asked, drawn)],
    )


class _Asked(NamedTuple):
    method: str
    in_a_row: int
    ratio: Ratio
    effective: float
    refusal: CannotAnswer | None


def _check_size(plays: int, users: int, rules: Rules) -> None:
    if plays < rules.least_plays:
        raise CannotAnswer(
            Reason.TOO_FEW_PLAYS, f"{plays} were answered; it takes {rules.least_plays}"
        )
    if users < rules.least_users:
        raise CannotAnswer(
            Reason.TOO_FEW_USERS, f"{users} gave answers; it takes {rules.least_users}"
        )


def _asked(
    found: Choices, given: Choices, rules: Rules, supports: list[Support]
) -> Iterator[_Asked]:
    certain = _refusal(partial(check_chance, found))
    worth = effective(given.target)
    few = _refusal(partial(check_effective, worth, rules.least_effective))
    uneven = certain or _refusal(partial(check_uniform, found))
    yield _Asked("replay", 1, replay(given), worth, uneven or few)
    if certain:
        yield _Asked(MATCHES, 1, replay(given), worth, few)
    for row, each in enumerate(supports, 1):
        weights = clipped(found.weights(row), rules.clip)[found.answered]
        refusal = certain or _refusal(partial(check, each, rules.least_effective))
        methods = {"ips": ips, "snips": snips, "dr": doubly_robust}
        if row > 1:
            methods = {"pdis": ips, "weighted_pdis": snips}
        for name, method in methods.items():
            yield _Asked(name, row, method(given, weights), each.effective, refusal)


def _refusal(test: Callable[[], None]) -> CannotAnswer | None:
    try:
        test()
    except CannotAnswer as why:
        return why.with_traceback(None)
    return None


def _answers(asked: list[_Asked], drawn: Resampled) -> Iterator[Answer | Refusal]:
    row = 2
    for each in asked:
        if each.refusal is not None:
            yield Refusal(each.method, each.in_a_row, each.refusal)
            continue
        estimate, gain = drawn.estimate(row), drawn.gain(row)
        yield Answer(each.method, each.in_a_row, estimate, gain, each.effective)
        row += 1
