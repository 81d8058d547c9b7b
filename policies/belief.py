"""What the service believes of a user's interest, and Bayes' rule for it.

An answer depends on the state *before* the move (Meshram and Kaza 2021, section II;
the paper prints the update for a like alone). With weights w(i) = pi(i) O(i, y) after a
signal y, and pi(i) without an answer, the belief after a play is w P1 / sum(w); after k
slots of rest it is pi P0^k. Where the signals are a skip and a like, O(i, like) is
rho(i).

Where models have a mood, chances are those of the mood in which the play was: known, so
that nothing else changes.

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
UNKNOWN = np.empty(0, dtype=np.int64)


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
    powers = models.rest_powers
    return bayes.rested(powers, as_ints(model), as_floats(belief), as_ints(slots))


def untouched(models: ModelSet, slot: int) -> Floats:
    """Return (M, S): each model's belief at `slot` of an item never played."""
    rows = np.arange(len(models.states))
    waited = np.full(len(rows), slot)
    return bayes.rested(models.rest_powers, rows, models.prior, waited)


def returned(belief: Floats, fresh: Floats) -> NDArray[np.bool_]:
    """Return (K,): whether interest is again what it is in an item never played.

    Args:
        belief: (K, S).
        fresh: (K, S) in the same slot, of items of the same models, never played.
    """
    same: NDArray[np.bool_] = np.abs(belief - fresh).sum(axis=1) < RETURNED
    return same


def expected_like(
    models: ModelSet, model: Ints, belief: Floats, mood: Ints | int = 0
) -> Floats:
    """Return (K,): the expected reward, r(pi) = sum_i pi(i) rho(i), of each belief.

    Where the signals are a skip and a like, that is the chance of a like.

    Args:
        models: M models of S states.
        model: (K,) row of each belief's model.
        belief: (K, S).
        mood: class of the mood, one for all or (K,).
    """
    rows = as_ints(model)
    if models.classes > 1:
        rows = rows * models.classes + mood
    return bayes.expected_like(models.like_in, rows, as_floats(belief))


def answered(
    models: ModelSet, model: int, belief: Floats, signal: int, mood: int = 0
) -> Answered:
    """Move the belief of an item that was played on by its slot.

    Args:
        models: M models of S states.
        model: row of the item's model.
        belief: (S,) in the slot of the play.
        signal: its number in the model (SKIP and LIKE where it has no others), or
            NONE.
        mood: class of the mood in which it was played.
    """
    row, now = model * models.classes + mood, as_floats(belief)
    after, chance = bayes.answered(
        models.observe_in, row, models.play, model, now, signal
    )
    surprise = max(0.0, -math.log(max(chance, IMPOSSIBLE)))
    return Answered(after, surprise, impossible=chance < IMPOSSIBLE)


def replayed(
    models: ModelSet,
    model: int,
    slots: Ints,
    signals: Ints,
    moods: Ints | None = None,
) -> tuple[int, Floats]:
    """Rebuild one item's belief from the log of its plays.

    Args:
        models: M models of S states.
        model: row of the item's model.
        slots: (P,) slots in which it was played, ascending.
        signals: (P,) see `answered`.
        moods: (P,) class of the mood in which each play was; None: 0, of all.

    Returns:
        The slot after the last play, and the (S,) belief in it. Without plays: slot 0
        and the prior.
    """
    known = UNKNOWN if moods is None else as_ints(moods)
    return bayes.replayed(models, model, as_ints(slots), as_ints(signals), known)


def forecast(
    models: ModelSet, model: int, belief: Floats, slots: int, mood: int = 0
) -> Floats:
    """Return (slots,): the expected reward after 1, 2, ... further slots of rest.

    Args:
        models: M models of S states.
        model: row of the item's model.
        belief: (S,) now.
        slots: length of the forecast.
        mood: class of the mood that lasts.
    """
    row = model * models.classes + mood
    return bayes.forecast(
        models.rest, model, models.like_in, row, as_floats(belief), slots
    )
