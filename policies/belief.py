"""What the service believes of a user's interest, and Bayes' rule for it.

An answer depends on the state *before* the move (Meshram and Kaza 2021, section II;
the paper prints the update for a like alone). With weights w(i) = pi(i) O(i, y) after a
signal y, and pi(i) without an answer, the belief after a play is w P1 / sum(w); after k
slots of rest it is pi P0^k. Where the signals are a skip and a like, O(i, like) is
rho(i).

The arithmetic is that of `bayes`, always: a belief rebuilt from a log equals the one
that was carried along, to the bit.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies import bayes
from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.bayes import IMPOSSIBLE
from policies.model_set import ModelSet

RETURNED = 1e-12  # least difference (L1) from the belief of an item never played
REMEMBERED = 256  # slots for which a play is remembered although interest returned
MOST_SURPRISE = -math.log(IMPOSSIBLE)


class Answered(NamedTuple):
    """A belief after a play.

    Attributes:
        belief: (S,) belief in the slot after the play.
        surprise: -ln of the chance of the signal, in nats; 0.0 if there was no answer.
        impossible: the model gave the signal no chance (none above 2.2e-308). The
            belief then moves as without an answer, and the surprise is MOST_SURPRISE,
            about 708 nats.
    """

    belief: Floats
    surprise: float
    impossible: bool


def rested(models: ModelSet, model: Ints, belief: Floats, slots: Ints) -> Floats:
    """Move beliefs on by slots of rest: pi P0^k, in O(log k).

    Args:
        models: M models of S states.
        model: (K,) row of each belief's model.
        belief: (K, S).
        slots: (K,) slots of rest, 0 <= k < 2**41.

    Returns:
        (K, S); a row with k = 0 is unchanged to the bit.
    """
    return bayes.rested(models, as_ints(model), as_floats(belief), as_ints(slots))


def untouched(models: ModelSet, slot: int) -> Floats:
    """Return (M, S): each model's belief at `slot` of an item never played."""
    rows = np.arange(len(models.states))
    return bayes.rested(models, rows, models.prior, np.full(len(rows), slot))


def returned(belief: Floats, fresh: Floats) -> NDArray[np.bool_]:
    """Return (K,): whether interest is again what it is in an item never played.

    Args:
        belief: (K, S).
        fresh: (K, S) in the same slot, of items of the same models, never played.
    """
    same: NDArray[np.bool_] = np.abs(belief - fresh).sum(axis=1) < RETURNED
    return same


def expected_like(models: ModelSet, model: Ints, belief: Floats) -> Floats:
    """Return (K,): the expected reward, r(pi) = sum_i pi(i) rho(i), of each belief.

    Where the signals are a skip and a like, that is the chance of a like.

    Args:
        models: M models of S states.
        model: (K,) row of each belief's model.
        belief: (K, S).
    """
    return bayes.expected_like(models.like, as_ints(model), as_floats(belief))


def answered(models: ModelSet, model: int, belief: Floats, signal: int) -> Answered:
    """Move the belief of an item that was played on by its slot.

    Args:
        models: M models of S states.
        model: row of the item's model.
        belief: (S,) in the slot of the play.
        signal: its number in the model (SKIP and LIKE where it has no others), or
            NONE.
    """
    after, chance = bayes.answered(models, model, as_floats(belief), signal)
    surprise = max(0.0, -math.log(max(chance, IMPOSSIBLE)))
    return Answered(after, surprise, impossible=chance < IMPOSSIBLE)


def replayed(
    models: ModelSet, model: int, slots: Ints, signals: Ints
) -> tuple[int, Floats]:
    """Rebuild one item's belief from the log of its plays.

    Args:
        models: M models of S states.
        model: row of the item's model.
        slots: (P,) slots in which it was played, ascending.
        signals: (P,) see `answered`.

    Returns:
        The slot after the last play, and the (S,) belief in it. Without plays: slot 0
        and the prior.
    """
    return bayes.replayed(models, model, as_ints(slots), as_ints(signals))


def forecast(models: ModelSet, model: int, belief: Floats, slots: int) -> Floats:
    """Return (slots,): the expected reward after 1, 2, ... further slots of rest.

    Args:
        models: M models of S states.
        model: row of the item's model.
        belief: (S,) now.
        slots: length of the forecast.
    """
    return bayes.forecast(models, model, as_floats(belief), slots)
