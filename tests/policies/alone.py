"""One item for itself, paid for its rests: slow, exact, and from the definition.

Only for models that have few beliefs, all of which are listed, or none but those that
counts of answers tell.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from policies import Floats, Model, as_floats
from tests.policies.oracles import normalised

ALIKE = 8  # decimals of two beliefs that are taken for one
MOST_BELIEFS = 600


@dataclass(frozen=True)
class Chain:
    """The n beliefs that a model has after those it is listed from.

    beliefs: (n, S); those it is listed from come first
    reward:  (n,)
    moves:   (n, n) by a rest, and by a play
    """

    beliefs: Floats
    reward: Floats
    moves: tuple[Floats, Floats]
    discount: float

    def worth(self, subsidy: float) -> Floats:
        """Return (n,): V, by improving the policy until it is the best."""
        playing = np.ones(len(self.reward), dtype=bool)
        for _ in range(100):
            rest, play = self.moves
            moves = np.where(playing[:, None], play, rest)
            earned = np.where(playing, self.reward, subsidy)
            kept = np.eye(len(earned)) - self.discount * moves
            value = as_floats(np.linalg.solve(kept, earned))
            gain = self._gain(subsidy, value)
            better = np.where(np.abs(gain) < 1e-12, playing, gain > 0)
            if (better == playing).all():
                return value
            playing = better
        raise AssertionError

    def advantage(self, subsidy: float) -> Floats:
        """Return (n,): of playing over resting."""
        return self._gain(subsidy, self.worth(subsidy))

    def index(self, row: int) -> float:
        """Return the subsidy from which the belief is best rested, by halving."""
        low, high = -1 / (1 - self.discount), 1.0
        while high - low > 1e-6:
            middle = (low + high) / 2
            if self.advantage(middle)[row] > 0:
                low = middle
            else:
                high = middle
        return low

    def _gain(self, subsidy: float, value: Floats) -> Floats:
        rest, play = self.moves
        gain: Floats = self.reward - subsidy + self.discount * (play - rest) @ value
        return gain


def chain(model: Model, starts: Sequence[Floats], discount: float) -> Chain:
    """List all beliefs that there are after some."""
    beliefs: list[Floats] = []
    rows: dict[tuple[float, ...], int] = {}

    def row(belief: Floats) -> int:
        key = tuple((np.round(belief, ALIKE) + 0.0).tolist())
        if key not in rows:
            rows[key] = len(beliefs)
            beliefs.append(belief)
        return rows[key]

    for start in starts:
        row(start)
    moves: list[tuple[int, int, int, float]] = []  # played, from, to, chance
    done = 0
    while done < len(beliefs):
        assert len(beliefs) <= MOST_BELIEFS
        belief = beliefs[done]
        moves.append((0, done, row(belief @ model.rest), 1.0))
        for signal, chance in enumerate(belief @ model.observe):
            if chance > 1e-12:
                told = normalised(belief * model.observe[:, signal])
                moves.append((1, done, row(told @ model.play), float(chance)))
        done += 1
    matrices = np.zeros((2, done, done))
    for played, start_row, end_row, chance in moves:
        matrices[played, start_row, end_row] += chance
    listed = np.array(beliefs)
    return Chain(listed, listed @ model.like, (matrices[0], matrices[1]), discount)


def gittins(like: Floats, prior: Floats, discount: float, plays: int = 300) -> float:
    """Return Gittins's index where interest never moves, by counts of answers.

    Whoever rests then rests for ever. After `plays` plays nothing more is learnt.
    """
    likes = np.arange(plays + 1)

    def chances(total: int) -> Floats:
        """Return (total + 1,): of a like, after each number of likes."""
        counted = likes[: total + 1, None]
        weights = prior * like**counted * (1 - like) ** (total - counted)
        found: Floats = (weights @ like) / weights.sum(axis=1)
        return found

    each = [chances(total) for total in range(plays + 1)]
    low, high = 0.0, 1.0
    while high - low > 1e-10:
        subsidy = (low + high) / 2
        retired = subsidy / (1 - discount)
        value = np.maximum(each[plays] / (1 - discount), retired)
        for chance in each[-2:0:-1]:
            value = chance + discount * (chance * value[1:] + (1 - chance) * value[:-1])
            value = np.maximum(value, retired)
        start = each[0][0]
        ahead = start * value[1] + (1 - start) * value[0]
        if start + discount * ahead > retired:
            low = subsidy
        else:
            high = subsidy
    return low
