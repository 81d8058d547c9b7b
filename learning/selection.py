"""How many states and types: by what chains foretell of plays that they never saw.

Chains are learned from the first plays of each user, and foretell the last ones, each
from all that lies before it. Among sizes, the smallest is chosen that is no more than
one standard error, over users, worse than the best (Breiman, Friedman, Olshen and Stone
1984): of what is left, users cannot tell whether it would hold for others.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from learning.bootstrap import mean_and_error
from learning.em import Spread
from learning.fitting import Fitted, Recipe, expected, fit
from learning.passes import LEAST
from learning.plays import NONE, Bools, Plays
from policies import Floats

SHARE = 0.7  # of each user's plays, that are learned from


@dataclass(frozen=True, slots=True)
class Tried:
    """How well chains of a size foretell.

    Attributes:
        states: S.
        types: K.
        log_loss: of a held-out play, in nats.
        worse: by how much that is above the best one's.
        error: standard error of `worse`, over users.
    """

    states: int
    types: int
    log_loss: float
    worse: float
    error: float


@dataclass(frozen=True, slots=True)
class Selection:
    """Sizes, and which was chosen.

    Attributes:
        states: S.
        types: K.
        plays: that were foretold; of none, the smallest sizes are chosen.
        tried: sizes, in the order in which they were.
    """

    states: int
    types: int
    plays: int
    tried: Sequence[Tried]


def select(
    plays: Plays,
    recipe: Recipe,
    states: Sequence[int],
    types: Sequence[int],
    spread: Spread = map,
    progress: Callable[[], object] = lambda: None,
) -> Selection:
    """Choose numbers of states and types: first states, then types with so many.

    Args:
        plays: the log.
        recipe: how chains are learned, but for these numbers.
        states: to try.
        types: to try; states are tried with the fewest.
        spread: how the work is spread.
        progress: called when a size has been tried.
    """
    train = plays.earliest(SHARE)
    answered = plays.answer != NONE
    held = answered & ~train
    states, types = sorted({*states}), sorted({*types})
    if not held.any() or not answered[train].any():
        return Selection(states[0], types[0], 0, ())
    trials = _Trials(plays, train, held, {})
    for size in states:
        trials.add(replace(recipe, states=size, types=types[0]), spread)
        progress()
    chosen, _ = trials.chosen([(size, types[0]) for size in states])
    for kinds in types[1:]:
        trials.add(replace(recipe, states=chosen, types=kinds), spread)
        progress()
    _, kinds = trials.chosen([(chosen, kinds) for kinds in types])
    best = trials.best(trials.found)
    tried = [
        Tried(*size, trials.loss(size), *trials.worse(size, best))
        for size in trials.found
    ]
    return Selection(chosen, kinds, int(held.sum()), tried)


Size = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class _Trials:
    """What was tried.

    Attributes:
        plays: the log.
        train: (P,) plays that are learned from.
        held: (P,) plays that are foretold.
        found: by size, the sum of each user's log losses, and the chain of all arms.
    """

    plays: Plays
    train: Bools
    held: Bools
    found: dict[Size, tuple[Floats, Fitted]]

    def add(self, recipe: Recipe, spread: Spread) -> None:
        """Learn, and foretell; more types begin from the chain of fewer."""
        fewer = [each for _, each in self.found.values()]
        whole = next((f.whole for f in fewer if f.recipe.states == recipe.states), None)
        fitted = fit(self.plays.of(self.train), recipe, spread, whole)
        held, answer = np.flatnonzero(self.held), self.plays.answer[self.held]
        chance = expected(self.plays, fitted)[held, answer]
        lost = -np.log(np.maximum(chance, LEAST))
        users = len(self.plays.users)
        by_user = np.bincount(self.plays.user[held], lost, users).astype(np.float64)
        self.found[recipe.states, recipe.types] = by_user, fitted

    def loss(self, size: Size) -> float:
        """Return the log loss of a play."""
        return float(self.found[size][0].sum() / self.held.sum())

    def best(self, sizes: Iterable[Size]) -> Size:
        """Return the size of least loss."""
        return min(sizes, key=self.loss)

    def worse(self, size: Size, other: Size) -> tuple[float, float]:
        """Return by how much one loses more than another, and its standard error."""
        apart = self.found[size][0] - self.found[other][0]
        counts = np.bincount(self.plays.user[self.held], minlength=len(apart))
        return mean_and_error(apart[counts > 0], counts[counts > 0])

    def chosen(self, sizes: Sequence[Size]) -> Size:
        """Return the first size that is no worse than the best, but for an error."""
        best = self.best(sizes)
        for size in sizes:
            worse, error = self.worse(size, best)
            if worse <= error:
                return size
        return best
