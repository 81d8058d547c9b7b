"""Runs that go on in step: what is so and is believed, and how a slot moves it on.

A run follows one listener from the start. The items of a group are one row, until one
of them is played: it leaves for a row of its own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies import LIKED, NEVER, Floats, Ints, ModelSet, MoodState, Situation
from policies.bayes import learn, like_chance, move
from policies.choice import pick
from policies.compiled import compiled, inner
from policies.mood import class_of, next_state
from policies.randomness import uniform
from simulation.listeners import Listeners, Truth

MOST_ROWS = 2**14  # of runs that go on in step: they fit into a processor's cache
SIGNALS = 0
DECISIONS = 1
STATES = 2
MOOD = np.dtype(
    [
        ("recent", np.int64),  # see `MoodState`
        ("told", np.int64),
        ("tendency", np.float64),
        ("resumed", np.bool_),  # whether the next play comes after a pause
    ]
)


class Runs(NamedTuple):
    """R runs of up to W rows; row w of run r is at w R + r.

    So the rows that are in use lie side by side.

    Attributes:
        first: number of the first run.
        model: (W R,) row of the model in the model set.
        belief: (W R, S) of the policy.
        truth: (W R, S) of one who knows the start and the models; where both are the
            same, the same array.
        items: (W R,) of the row; 0 where it is not in use yet.
        rested: (W R,) slots since the last play, NEVER if never played.
        origin: (W R,) group of the start.
        used: (R,) rows in use.
        mood: (R,) of MOOD, as the policy knows it.
        felt: (R,) the true one; where both are the same, the same array.
    """

    first: int
    model: Ints
    belief: Floats
    truth: Floats
    items: Ints
    rested: Ints
    origin: Ints
    used: Ints
    mood: NDArray[np.void]
    felt: NDArray[np.void]


class Earned(NamedTuple):
    """What R runs have earned.

    Attributes:
        reward: (R,) discounted.
        plays: (G,) of each group of the start.
        total: (T,) sum over runs of what each has earned by the end of a slot.
        squares: (T,) sum of the squares.
    """

    reward: Floats
    plays: Ints
    total: Floats
    squares: Floats


def nothing(start: Situation, size: int, slots: int) -> Earned:
    """Return what so many runs have earned before they begin."""
    plays = np.zeros(len(start.model), dtype=np.int64)
    return Earned(np.zeros(size), plays, np.zeros(slots), np.zeros(slots))


def rows_of(start: Situation, slots: int) -> int:
    """Return W, how many rows a run may need."""
    leaving = int(np.minimum(start.count - 1, slots).sum())
    return len(start.model) + min(leaving, slots)


def begin(
    start: Situation, listeners: Listeners, first: int, size: int, slots: int
) -> Runs:
    """Return `size` runs at the start, with room for as many slots."""
    groups, rows = len(start.model), rows_of(start, slots)
    origin = np.repeat(np.arange(rows) % groups, size)
    items = np.where(np.arange(rows * size) < groups * size, start.count[origin], 0)
    belief, mood = start.belief[origin], _moods(start.mood, start.resumed, size)
    apart = listeners.differ(start)
    return Runs(
        first,
        start.model[origin],
        belief,
        listeners.belief[origin] if apart else belief,
        items,
        start.rested[origin],
        origin,
        np.full(size, groups),
        mood,
        _moods(listeners.mood, listeners.resumed, size) if apart else mood,
    )


def _moods(state: MoodState, resumed: bool, size: int) -> NDArray[np.void]:
    return np.full(size, np.array((*state, resumed), dtype=MOOD))


def situation_of(models: ModelSet, runs: Runs) -> Situation:
    """Return all rows in use as one situation, in the mood of the first run."""
    shown = int(runs.used.max()) * len(runs.used)
    rows = (
        runs.model[:shown],
        runs.belief[:shown],
        runs.items[:shown],
        runs.rested[:shown],
    )
    if models.classes == 1:
        return Situation(models, *rows)
    *state, resumed = runs.mood[0].item()
    return Situation(models, *rows, mood=MoodState(*state), resumed=resumed)


@compiled
def decision_seed(seed: int, run: int, slot: int) -> int:
    """Return the seed of the decision in a slot of a run."""
    return int(uniform(seed, DECISIONS, run, slot) * 2.0**53)


@compiled
def play_slot(
    models: ModelSet,
    truth: Truth,
    runs: Runs,
    weight: Floats,
    scores: Floats,
    seed: int,
    slot: int,
    worth: float,
    earned: Earned,
) -> None:
    """Play the item of the highest score in each run, and let the slot pass.

    Args:
        models: M models of S states, in which the policy believes.
        truth: of the listeners.
        runs: moved on in place.
        weight: (K,) of a mixture's rows.
        scores: (K, V R) of the V R first rows.
        seed: of all runs.
        slot: number of this slot.
        worth: of a reward in this slot.
        earned: added to.
    """
    size = len(runs.used)
    shown = scores.shape[1] // size
    offered, count = np.empty((len(weight), shown)), np.empty(shown, dtype=np.int64)
    spare = np.empty((1, max(runs.belief.shape[1], runs.truth.shape[1])))
    for r in range(size):
        for w in range(shown):
            count[w] = runs.items[w * size + r]
            for k in range(len(weight)):
                offered[k, w] = scores[k, w * size + r]
        run = runs.first + r
        group, _, chance, _ = pick(
            weight, offered, count, decision_seed(seed, run, slot), 0
        )
        if chance == 0.0:
            raise ValueError("scores: one is not finite")
        row = _alone(runs, r, group)
        if truth.clicks:
            _show(runs.truth, row, uniform(seed, STATES, run, slot))
        mood, felt = _mood(models, runs.mood, r), _mood(truth.models, runs.felt, r)
        chances = runs.model[row] * truth.models.classes + felt
        drawn = uniform(seed, SIGNALS, run, slot)
        signal = _signal(truth.models, runs, row, chances, drawn)
        if truth.clicks:
            reward = truth.models.reward[runs.model[row], signal]
        else:
            reward = like_chance(truth.models.like_in, chances, runs.truth, row)
        earned.reward[r] += worth * reward
        earned.plays[runs.origin[row]] += 1
        earned.total[slot] += earned.reward[r]
        earned.squares[slot] += earned.reward[r] ** 2
        if truth.apart:
            _pass_slot(truth.models, runs.truth, runs, r, felt, row, signal, spare)
            _feel(truth.models, runs.felt, r, runs.model[row], signal)
        _pass_slot(models, runs.belief, runs, r, mood, row, signal, spare)
        _feel(models, runs.mood, r, runs.model[row], signal)
        _rest(runs, r, row)


@inner
def _alone(runs: Runs, r: int, group: int) -> int:
    """Return the row of the item to play, which leaves a group of several."""
    size = len(runs.used)
    row, own = group * size + r, int(runs.used[r] * size + r)
    if runs.items[row] == 1:
        return row
    runs.items[row] -= 1
    runs.used[r] += 1
    runs.items[own] = 1
    runs.model[own] = runs.model[row]
    runs.origin[own] = runs.origin[row]
    for i in range(runs.belief.shape[1]):
        runs.belief[own, i] = runs.belief[row, i]
    for i in range(runs.truth.shape[1]):
        runs.truth[own, i] = runs.truth[row, i]
    return own


@inner
def _show(truth: Floats, row: int, drawn: float) -> None:
    """Draw the hidden state of an item, by a number in [0, 1), and make it certain.

    What rounding leaves goes to a state that can be.
    """
    upto, state = 0.0, 0
    for i in range(truth.shape[1]):
        upto += truth[row, i]
        if truth[row, i] > 0.0:
            state = i
            if drawn < upto:
                break
    for i in range(truth.shape[1]):
        truth[row, i] = 1.0 if i == state else 0.0


@inner
def _mood(models: ModelSet, moods: NDArray[np.void], r: int) -> int:
    """Return the class of a run's mood."""
    if models.classes == 1:
        return 0
    state = MoodState(moods[r].recent, moods[r].told, moods[r].tendency)
    return int(class_of(models.rule, state, moods[r].resumed))


@inner
def _feel(
    models: ModelSet, moods: NDArray[np.void], r: int, m: int, signal: int
) -> None:
    """Let the mood of a run follow from an answer; the next play comes at once."""
    if models.classes == 1:
        return
    state = MoodState(moods[r].recent, moods[r].told, moods[r].tendency)
    after = next_state(models.rule, state, int(models.reward[m, signal] >= LIKED))
    moods[r].recent, moods[r].told = after.recent, after.told
    moods[r].tendency, moods[r].resumed = after.tendency, False


@inner
def _signal(models: ModelSet, runs: Runs, row: int, chances: int, drawn: float) -> int:
    """Return the signal for a number in [0, 1): the lowest numbers give the last.

    What rounding leaves goes to one that can be given.
    """
    m, upto, signal = runs.model[row], 0.0, 0
    for number in range(models.signals[m] - 1, -1, -1):
        chance = 0.0
        for i in range(runs.truth.shape[1]):
            chance += runs.truth[row, i] * models.observe_in[chances, number, i]
        upto += chance
        if chance > 0.0:
            signal = number
            if drawn < upto:
                break
    return signal


@inner
def _pass_slot(
    models: ModelSet,
    belief: Floats,
    runs: Runs,
    r: int,
    mood: int,
    played: int,
    signal: int,
    spare: Floats,
) -> None:
    """Move what is believed of a run on: one item has been played, the others rest."""
    size = len(runs.used)
    for w in range(runs.used[r]):
        row = w * size + r
        m = runs.model[row]
        if row == played:
            chances = m * models.classes + mood
            learn(
                models.observe_in,
                chances,
                models.play,
                m,
                belief,
                row,
                signal,
                spare,
                0,
            )
        else:
            move(models.rest, m, belief, row, spare, 0)
        for i in range(belief.shape[1]):
            belief[row, i] = spare[0, i]


@inner
def _rest(runs: Runs, r: int, played: int) -> None:
    """Count the slots of rest of a run's items."""
    size = len(runs.used)
    for w in range(runs.used[r]):
        row = w * size + r
        if row == played:
            runs.rested[row] = 0
        else:
            runs.rested[row] += runs.rested[row] != NEVER
