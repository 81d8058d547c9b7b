"""What is learned: a chain of interest, and how much of it was seen."""

from dataclasses import dataclass

import numpy as np

from policies import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A controlled hidden Markov chain of S states, K signals and M moods.

    Attributes:
        play: (S, S) row-stochastic, moves by a play.
        rest: (S, S) moves by a slot of rest, row-stochastic; or, in time, the generator
            of such moves a second, whose rows sum to zero.
        observe: (M, S, K) chance of each signal, by mood and state.
        prior: (S,) belief of an arm never played.
        in_time: whether rests are measured in seconds.
    """

    play: Floats
    rest: Floats
    observe: Floats
    prior: Floats
    in_time: bool = False

    def ordered(self, reward: Floats, counts: "Counts") -> "Chain":
        """Return the chain with states by rising like, on average over moods.

        Args:
            reward: (K,) worth of each signal.
            counts: how often each mood was met in each state.
        """
        met = counts.observe.sum(axis=2)
        like = (met * (self.observe @ reward)).sum(axis=0) / met.sum(axis=0)
        by = np.argsort(like, kind="stable")
        return Chain(
            self.play[np.ix_(by, by)],
            self.rest[np.ix_(by, by)],
            self.observe[:, by],
            self.prior[by],
            self.in_time,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Counts:
    """What a chain expects to have happened, given what was seen.

    Attributes:
        play: (S, S) moves by plays.
        rest: (S, S) moves by rests; in time, on the diagonal seconds spent.
        observe: (M, S, K) signals given.
        prior: (S,) streams that began there.
        likelihood: ln of the chance of all that was seen, in nats.
    """

    play: Floats
    rest: Floats
    observe: Floats
    prior: Floats
    likelihood: float

    def __add__(self, other: "Counts") -> "Counts":
        """Return the counts of both."""
        return Counts(
            self.play + other.play,
            self.rest + other.rest,
            self.observe + other.observe,
            self.prior + other.prior,
            self.likelihood + other.likelihood,
        )

    @property
    def plays(self) -> Floats:
        """Return (S,): answers by state, in all moods."""
        plays: Floats = self.observe.sum(axis=(0, 2))
        return plays
