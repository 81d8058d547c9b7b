"""What a log can tell at all: how many states, and play from rest.

Four hidden states and two signals are not known from neighbouring plays alone: what
m answers say of the next m has a rank of at most S, and its singular values show how
many states a log tells apart (Hsu, Kakade and Zhang 2012). How interest rests is known
only through rests of different lengths.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from learning.em import Climb, Effort, Learned, Spread, Terms
from learning.maximization import Bond, Smoothing
from learning.plays import NONE
from learning.streams import Streams
from policies import Floats, Ints

HALVES = 50  # ways to cut users into two halves
SURE = 2.0  # standard deviations
GROUPS = 1000  # of users, that are halved as they are
MOST_ROWS = 64  # of the matrix: different pasts


@dataclass(frozen=True, slots=True)
class Told:
    """How much worse a log is explained under a bond.

    Attributes:
        bond: what is not learned.
        lost: nats of likelihood that are lost.
        needed: nats that its parameters would lose by chance, by the Bayesian
            information criterion: half of ln(answers) for each.
    """

    bond: Bond
    lost: float
    needed: float

    @property
    def sure(self) -> bool:
        """Return whether the log tells that the bond is wrong."""
        return self.lost > self.needed


@dataclass(frozen=True, slots=True)
class Identification:
    """What a log tells.

    Attributes:
        window: m, answers of a past and of a future.
        singular_values: of their matrix, as half of the users foretell the other's.
        errors: standard deviations of these.
        told: by bond.
    """

    window: int
    singular_values: Sequence[float]
    errors: Sequence[float]
    told: Sequence[Told]

    @property
    def states(self) -> int:
        """Return how many states the log tells apart, at least."""
        pairs = zip(self.singular_values, self.errors, strict=True)
        sure = [value > SURE * error for value, error in pairs]
        return sure.index(False) if False in sure else len(sure)

    @property
    def warnings(self) -> Sequence[str]:
        """Return what the log does not tell, in sentences."""
        said = {
            Bond.REST: "The log does not tell that interest moves while items rest.",
            Bond.PLAY: "The log does not tell that plays move interest.",
            Bond.SAME: "The log cannot tell play from rest.",
        }
        return [said[each.bond] for each in self.told if not each.sure]


def identify(
    streams: Streams,
    learned: Learned,
    smoothing: Smoothing,
    spread: Spread = map,
    seed: int = 0,
) -> Identification:
    """Say what a log tells of the chain that was learned from it."""
    size, signals = learned.chain.observe.shape[1:]
    window = max(int(np.log(MOST_ROWS) / np.log(max(signals, 2))) // 2, 1)
    values, errors = singular_values(streams, signals, window, seed)
    bonds = [Bond.REST, Bond.PLAY, Bond.SAME]
    if learned.chain.in_time:
        bonds.remove(Bond.SAME)
    answers = int((streams.answer != NONE).sum())
    needed = 0.5 * size * (size - 1) * float(np.log(max(answers, 2)))
    lost = partial(_lost, streams, learned, smoothing, spread)
    told = [Told(bond, lost(bond), needed) for bond in bonds]
    return Identification(window, values.tolist(), errors.tolist(), told)


def _lost(
    streams: Streams,
    learned: Learned,
    smoothing: Smoothing,
    spread: Spread,
    bond: Bond,
) -> float:
    """Return how much lower a climb ends that keeps to a bond."""
    terms = Terms(smoothing, bond)
    climb = Climb(streams.parts(), learned.chain, terms, spread)
    effort = Effort()
    climb.on(effort.steps, effort.tolerance)
    return learned.counts.likelihood - climb.counts.likelihood


def singular_values(
    streams: Streams, signals: int, window: int, seed: int
) -> tuple[Floats, Floats]:
    """Return how strongly pasts foretell futures, and standard deviations.

    Directions are found on one half of the users and measured on the other, over
    several ways to halve them: noise alone gives values about zero.
    """
    past, future, user = _windows(streams, signals, window)
    rows = signals**window
    cells = np.zeros((GROUPS, rows * rows))
    np.add.at(cells, (user % GROUPS, past * rows + future), 1.0)
    cells = cells[cells.sum(axis=1) > 0]
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(HALVES if len(cells) > 1 else 0):
        half = rng.permutation(len(cells)) < len(cells) // 2
        one, other = (_shares(cells[rows_], rows) for rows_ in (half, ~half))
        left, _, right = np.linalg.svd(one)
        found.append(np.einsum("ik,ij,kj->k", left, other, right))
    if not found:
        return np.zeros(rows), np.full(rows, np.inf)
    return np.mean(found, axis=0), np.std(found, axis=0)


def _shares(cells: Floats, rows: int) -> Floats:
    total = cells.sum(axis=0)
    shares: Floats = (total / max(total.sum(), 1.0)).reshape(rows, rows)
    return shares


def _windows(streams: Streams, signals: int, window: int) -> tuple[Ints, Ints, Ints]:
    """Return pasts and futures of as many answers, in numbers, and whose they are."""
    plays, length = len(streams.answer), 2 * window
    if plays < length:
        nothing = np.empty(0, dtype=np.int64)
        return nothing, nothing, nothing
    spans = np.lib.stride_tricks.sliding_window_view(streams.answer, length)
    stream = np.repeat(np.arange(len(streams)), np.diff(streams.first))
    whole = stream[: plays - length + 1] == stream[length - 1 :]
    whole &= (spans != NONE).all(axis=1)
    worth = signals ** np.arange(window)
    kept = spans[whole]
    user = streams.user[stream[: plays - length + 1][whole]]
    return kept[:, :window] @ worth, kept[:, window:] @ worth, user
