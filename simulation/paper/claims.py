"""What the paper says, and what was found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import hypot

import numpy as np

from policies import Floats
from simulation.examples import example
from simulation.paper.labels import (
    EXACT,
    EXPECTED,
    MYOPIC,
    PAPER,
    WHITTLE,
    WHITTLE_MC,
)
from simulation.paper.parts import BELIEF, STATE
from simulation.paper.rows import Part, Row

Parts = Mapping[str, Part]
SLACK = 1e-12
NEGLIGIBLE = 0.01  # share of a reward
SOON = 100_000  # microseconds that nobody waits for


class Verdict(StrEnum):
    """How a claim of the paper stands.

    reproduced:     found here, too
    explained:      found as the paper has it in part, or for another reason
    not reproduced: found otherwise
    cannot be checked: the paper says too little, or too little was simulated
    """

    REPRODUCED = "reproduced"
    EXPLAINED = "explained"
    NOT_REPRODUCED = "not reproduced"
    CANNOT_BE_CHECKED = "cannot be checked"


Judged = tuple[Verdict, str]


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim. `figure`: the one that shows it. `evidence`: what was found."""

    claim: str
    figure: str
    verdict: Verdict
    evidence: str


def claims(parts: Parts) -> Sequence[Claim]:
    """Judge what the paper says, in its order."""
    return [
        _judged(
            "example-1",
            _myopic_ahead(parts),
            "Example 1: the myopic policy performs better than Monte Carlo "
            "rollout with H = 5 and L = 100.",
        ),
        _judged(
            "noise",
            _because_of_structure(parts),
            "Myopic performs better whenever there is structure on the "
            "transition probabilities.",
        ),
        _judged(
            "example-1",
            _structure(parts),
            "Example 1 has the structure that Lovejoy (1987) asks for, and "
            "like chances rise with interest.",
        ),
        _judged(
            "example-2",
            _rollout_ahead(parts),
            "Example 2: Monte Carlo rollout performs better than myopic.",
        ),
        _judged(
            "example-2",
            _myopic_plays(parts),
            "Example 2: myopic plays items 3 and 5 most frequently.",
        ),
        _judged(
            "example-2",
            _rollout_plays(parts),
            "Example 2: Monte Carlo rollout plays item 4 most frequently.",
        ),
        _judged(
            "example-3",
            _behind(parts, MYOPIC),
            "Example 3: myopic performs better than the Whittle index policy.",
        ),
        _judged(
            "truncation",
            _behind(parts, PAPER),
            "Example 3: Monte Carlo rollout performs better than the Whittle "
            "index policy.",
        ),
        _judged(
            "example-3",
            _whittle_dear(parts),
            "An index policy without a closed form is more expensive than "
            "Monte Carlo rollout and myopic.",
        ),
        _judged(
            "example-4",
            _eight_percent(parts),
            "Example 4 (15 items): Monte Carlo rollout performs better than "
            "myopic, by up to 8 %.",
        ),
        _judged(
            "example-4",
            _arbitrary(parts),
            "Monte Carlo rollout performs better for arbitrary transition dynamics.",
        ),
        _judged(
            "items",
            _hundreds(parts),
            "The method can be extended to a few hundred items.",
        ),
    ]


def _judged(figure: str, judged: Judged, claim: str) -> Claim:
    return Claim(claim, figure, *judged)


def shown(mean: float, half: float, *, sign: bool = True) -> str:
    """Return a number with its interval."""
    return f"{mean:+.3f} ± {half:.3f}" if sign else f"{mean:.3f} ± {half:.3f}"


def _order(row: Row) -> int:
    """Return 1 if a policy is ahead of the first, -1 if behind, 0 if it is not sure."""
    if abs(row.difference) <= row.difference_ci95:
        return 0
    return 1 if row.difference > 0 else -1


def _apart(one: Row, other: Row) -> tuple[float, float]:
    """Return how far a policy is ahead of another, and half the interval."""
    return one.mean - other.mean, hypot(one.ci95, other.ci95)


def _ahead(part: Part, label: str, order: int) -> Judged:
    rows = {start: part.row(start, label) for start in (BELIEF, STATE)}
    told = " and ".join(f"{_more(row)} (start={start})" for start, row in rows.items())
    evidence = f"Rollout as in the paper earns {told} more than myopic."
    orders = [_order(row) for row in rows.values()]
    if all(found == order for found in orders):
        return Verdict.REPRODUCED, evidence
    if -order in orders:
        return Verdict.NOT_REPRODUCED, evidence
    return Verdict.CANNOT_BE_CHECKED, evidence


def _myopic_ahead(parts: Parts) -> Judged:
    return _ahead(parts["example-1"], PAPER, -1)


def _rollout_ahead(parts: Parts) -> Judged:
    return _ahead(parts["example-2"], PAPER, 1)


def _because_of_structure(parts: Parts) -> Judged:
    """Judge by instances that have the structure, and by example 1, which has not."""
    part, drawings = parts["noise"], parts["structure"]
    paper = part.row("clicks", PAPER, 100)
    same = part.row("expected", EXPECTED, 100)
    exact = part.row("exact", EXACT)
    longest = part.group("clicks")[-1]
    ordered = [drawings.row("instances", label) for label in (PAPER, EXACT)]
    gains = np.array(drawings.series["gain, exact"])
    errors = np.array(drawings.series["error, exact"])
    evidence = (
        f"Over {drawings.marks['instances']:.0f} drawn instances with all of that"
        f" structure, rollout as in the paper earns"
        f" {_more(ordered[0])} more than myopic, exact rollout"
        f" {_more(ordered[1])}, beyond its interval behind in"
        f" {np.mean(gains < -errors):.0%} of them."
        f" Example 1: with the same H and L, but expected rewards and common random"
        f" numbers in place of independent clicks, rollout earns {_more(same)} more"
        f" than myopic, and without any sampling {_more(exact)}; with sampled clicks"
        f" {_more(paper)} at L = 100 and {_more(longest)} at L = {longest.x:.0f}."
        " Sampling noise decides, not structure."
    )
    clicks = {_order(row) for row in (paper, ordered[0])}
    without = {_order(row) for row in (same, exact, ordered[1])}
    if without == {-1}:
        return Verdict.REPRODUCED, evidence
    if _order(paper) < 0 and -1 not in without:
        return Verdict.EXPLAINED, evidence
    if 1 in clicks:
        return Verdict.NOT_REPRODUCED, evidence
    return Verdict.CANNOT_BE_CHECKED, evidence


def _more(row: Row) -> str:
    return shown(row.difference, row.difference_ci95)


def _structure(_parts: Parts) -> Judged:
    models = example(1).models
    matrices = {f"P1 of item {n}": model.play for n, model in enumerate(models, 1)}
    matrices["P0"] = models[0].rest
    unordered = [name for name, matrix in matrices.items() if not is_monotone(matrix)]
    positive = [name for name, matrix in matrices.items() if is_tp2(matrix)]
    tied = [
        f"item {n}"
        for n, model in enumerate(models, 1)
        if (np.diff(model.like) <= SLACK).any()
    ]
    evidence = (
        f"Rows that do not rise stochastically: {_listed(unordered)}. Totally positive"
        f" of order 2, as Lovejoy asks: {_listed(positive)} of {len(matrices)}"
        f" matrices. Like chances that do not rise strictly: {_listed(tied)}."
    )
    holds = not unordered and len(positive) == len(matrices) and not tied
    return (Verdict.REPRODUCED if holds else Verdict.NOT_REPRODUCED), evidence


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"


def is_monotone(matrix: Floats) -> bool:
    """Say whether each row is stochastically above the one before it."""
    tails = np.cumsum(matrix[:, ::-1], axis=1)
    return bool((np.diff(tails, axis=0) >= -SLACK).all())


def is_tp2(matrix: Floats) -> bool:
    """Say whether no 2 by 2 minor is negative."""
    rows, columns = np.triu_indices(len(matrix), 1), np.triu_indices(len(matrix), 1)
    return all(
        matrix[i, j] * matrix[k, m] >= matrix[i, m] * matrix[k, j] - SLACK
        for i, k in zip(*rows, strict=True)
        for j, m in zip(*columns, strict=True)
    )


def _plays(part: Part, label: str, wanted: set[int]) -> Judged:
    """Judge which items are played most, from both starts."""
    told, found = [], []
    for start in (BELIEF, STATE):
        shares = part.row(start, label).shares
        ranked = (np.argsort(shares)[::-1][: len(wanted)] + 1).tolist()
        items = ", ".join(f"item {n} {shares[n - 1]:.1%}" for n in ranked)
        told.append(f"{items} (start={start})")
        found.append(set(ranked) == wanted)
    verdict = Verdict.REPRODUCED if all(found) else Verdict.NOT_REPRODUCED
    return verdict, f"Of its plays: {'; '.join(told)}."


def _myopic_plays(parts: Parts) -> Judged:
    return _plays(parts["example-2"], MYOPIC, {3, 5})


def _rollout_plays(parts: Parts) -> Judged:
    return _plays(parts["example-2"], PAPER, {4})


def _behind(parts: Parts, label: str) -> Judged:
    """Judge whether Whittle is behind a policy: converged, or as the paper had it.

    That is by Monte Carlo, with its horizon of 5.
    """
    part, told, found = parts["example-3"], [], {}
    for whittle in (WHITTLE, WHITTLE_MC):
        for start in (BELIEF, STATE):
            ahead, half = _apart(part.row(start, whittle), part.row(start, label))
            told.append(f"{shown(ahead, half)} ({whittle}, start={start})")
            found[whittle, start] = ahead < -half
    evidence = f"Ahead of {label}: {', '.join(told)}."
    if all(found.values()):
        return Verdict.REPRODUCED, evidence
    if not any(found.values()):
        return Verdict.NOT_REPRODUCED, evidence
    behind = "; ".join(f"{w}, start={start}" for (w, start), so in found.items() if so)
    return Verdict.EXPLAINED, (
        f"{evidence} Whittle is behind only so: {behind}. By Monte Carlo the index is"
        " cut short; and the states that the paper's listeners begin in contradict the"
        " beliefs by which it is looked up. The converged index, believed rightly,"
        f" reaches the optimum {part.marks['optimum']:.4f}."
    )


def _whittle_dear(parts: Parts) -> Judged:
    part = parts["example-3"]
    whittle, rollout, sampled = (
        part.row(BELIEF, label).decision_us for label in (WHITTLE, PAPER, WHITTLE_MC)
    )
    evidence = (
        f"A decision takes {whittle:.0f} µs by the converged index, which is worked out"
        f" once for a model and then looked up, {rollout:.0f} µs by Monte Carlo"
        f" rollout, {sampled:.0f} µs by the Monte Carlo index."
    )
    if whittle > rollout:
        return Verdict.REPRODUCED, evidence
    return (
        Verdict.EXPLAINED if sampled > rollout else Verdict.NOT_REPRODUCED
    ), evidence


def _eight_percent(parts: Parts) -> Judged:
    part = parts["example-4"]
    gains = np.array(part.series["gain, paper"])
    exact = np.array(part.series["gain, exact"])
    evidence = (
        f"The paper prints no numbers of its instance. Over {len(gains)} drawn ones,"
        f" rollout as in the paper gains {gains.min():+.1f} to {gains.max():+.1f} %"
        f" (median {np.median(gains):+.1f} %), {np.mean(gains > 8):.0%} of them more"  # noqa: PLR2004
        f" than 8 %; exact rollout {exact.min():+.1f} to {exact.max():+.1f} % (median"
        f" {np.median(exact):+.1f} %)."
    )
    return Verdict.CANNOT_BE_CHECKED, evidence


def _arbitrary(parts: Parts) -> Judged:
    part = parts["example-4"]
    told = []
    for name, label in (("paper", PAPER), ("exact", EXACT)):
        gains = np.array(part.series[f"gain, {name}"])
        errors = np.array(part.series[f"error, {name}"])
        row = part.row("instances", label)
        told.append(
            f"{label} {_more(row)} on average, beyond"
            f" its interval ahead in {np.mean(gains > errors):.0%} of the drawn"
            f" instances and behind in {np.mean(gains < -errors):.0%}"
        )
    evidence = f"Above myopic: {'; '.join(told)}."
    order = _order(part.row("instances", PAPER))
    if order > 0:
        return Verdict.REPRODUCED, evidence
    if order < 0:
        noise = " What it loses is sampling noise: exact rollout does not."
        exact = _order(part.row("instances", EXACT)) > 0
        return Verdict.NOT_REPRODUCED, evidence + (noise if exact else "")
    return Verdict.CANNOT_BE_CHECKED, evidence


def _hundreds(parts: Parts) -> Judged:
    most = [row for row in parts["items"].rows if row.label == EXPECTED][-1]
    evidence = (
        f"With {most.x:.0f} items, each with a model of its own, a decision of Monte"
        f" Carlo rollout with expected rewards takes {most.decision_us / 1000:.2f} ms,"
        f" and earns"
        f" {_more(most)} more than myopic."
    )
    least = most.difference - most.difference_ci95
    fast, good = most.decision_us < SOON, least > -NEGLIGIBLE * most.mean
    return (Verdict.REPRODUCED if fast and good else Verdict.NOT_REPRODUCED), evidence
