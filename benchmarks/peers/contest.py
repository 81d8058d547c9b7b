"""Everyone plays to the same listeners."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from benchmarks.peers.competitor import (
    SESSION,
    SESSIONS,
    Competitor,
    Recommender,
    Run,
    Session,
)
from benchmarks.peers.listeners import Flags, Listener, Luck, expected_likes
from benchmarks.peers.worlds import ITEMS, Chance, Seed
from policies import Floats, Ints, ModelSet

DISCOUNT = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Of K competitors, with L listeners of each of C catalogues.

    likes:        (K, C, L) discounted likes
    rate:         (K, C, L) likes a slot
    microseconds: (K,) of a choice and learning from its answer, median
    """

    likes: Floats
    rate: Floats
    microseconds: Floats


class Played(NamedTuple):
    items: Ints
    liked: Flags
    seconds: Floats


def contest(
    competitors: Sequence[Competitor],
    catalogues: Sequence[ModelSet],
    listeners: int,
    slots: int,
    seed: Seed,
) -> Results:
    shape = (len(competitors), len(catalogues), listeners)
    likes, rate, surplus, seconds = (np.empty(shape) for _ in range(4))
    seeds = [part.spawn(listeners) for part in seed.spawn(len(catalogues))]
    for catalogue, number in np.ndindex(shape[1:]):
        models, here = catalogues[catalogue], (slice(None), catalogue, number)
        run = drawn(models, catalogue, slots, seeds[catalogue][number])
        all_played = [play(entry.begin(run), run.luck) for entry in competitors]
        items, liked, spent = map(np.array, zip(*all_played, strict=True))
        chances = expected_likes(models, items, liked)
        likes[here] = chances @ DISCOUNT ** np.arange(slots)
        rate[here] = chances.mean(axis=1)
        surplus[here] = (liked - chances).mean(axis=1)
        seconds[here] = np.median(spent, axis=1)
        progress(catalogue * listeners + number + 1, shape[1] * listeners)
    check(surplus)
    return Results(likes, rate, np.median(seconds, axis=(1, 2)) * 1e6)


def drawn(models: ModelSet, catalogue: int, slots: int, seed: Seed) -> Run:
    rng = np.random.default_rng(seed)
    luck = Luck.drawn(models, slots, rng)
    log = [random_session(models, rng) for _ in range(SESSIONS)]
    return Run(catalogue, luck, log, int(rng.integers(2**31)))


def random_session(models: ModelSet, rng: Chance) -> Session:
    """Play items at random to another listener."""
    listener = Listener(Luck.drawn(models, SESSION, rng))
    items = rng.integers(ITEMS, size=SESSION).tolist()
    return [(item, listener.answer(item)) for item in items]


def play(recommender: Recommender, luck: Luck) -> Played:
    listener, slots = Listener(luck), len(luck.liked)
    items, liked = np.empty(slots, dtype=np.int64), np.empty(slots, dtype=np.bool_)
    seconds = np.empty(slots)
    recommender.greet()
    for slot in range(slots):
        began = time.perf_counter()
        item = recommender.choose()
        chosen = time.perf_counter()
        answer = listener.answer(item)
        answered = time.perf_counter()
        recommender.learn(item, liked=answer)
        seconds[slot] = chosen - began + time.perf_counter() - answered
        items[slot], liked[slot] = item, answer
    return Played(items, liked, seconds)


def check(surplus: Floats) -> None:
    """Check that answers (K, C, L) agree with what the filter expects of them."""
    runs = surplus[0].size
    error = surplus.std(axis=(1, 2)) / runs**0.5
    assert (np.abs(surplus.mean(axis=(1, 2))) < 5 * error).all()


def progress(done: int, of: int) -> None:
    if sys.stderr.isatty():
        end = "\n" if done == of else "\r"
        print(f"{done} of {of} listeners", end=end, file=sys.stderr, flush=True)
