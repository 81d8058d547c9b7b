import importlib
import pkgutil
from collections.abc import Iterator
from itertools import product

import numpy as np
from numba.core.dispatcher import Dispatcher

import policies
from policies import (
    LIKE,
    NONE,
    POLICIES,
    ModelSet,
    Mood,
    answered,
    bound,
    choose,
    create,
    effort,
    expected_like,
    forecast,
    ready,
    replayed,
    rested,
    untouched,
    warm_up,
    worth_for_ever,
)
from tests.policies.instances import moody, random_models, situation, uncertain


def kernels() -> Iterator[tuple[str, int]]:
    for module in pkgutil.iter_modules(policies.__path__):
        members = vars(importlib.import_module(f"policies.{module.name}"))
        for name, member in members.items():
            if isinstance(member, Dispatcher):
                yield f"{module.name}.{name}", len(member.signatures)


def test_after_warming_up_nothing_is_compiled() -> None:
    warm_up()
    before = dict(kernels())

    for seed, sizes in enumerate(([2], [4, 2, 3], [6] * 5)):
        models = ModelSet.of(random_models(seed, sizes))
        rows = np.arange(len(sizes))
        belief = rested(models, rows, untouched(models, seed), rows)
        expected_like(models, rows, belief)
        after = answered(models, int(rows[-1]), belief[-1], LIKE)
        forecast(models, 0, after.belief, 3)
        replayed(models, 0, np.array([], dtype=np.int64), np.array([], dtype=np.int64))
        case = situation(models, rows.tolist(), belief, (1 + rows).tolist())
        for depth, discount in product((0, 1, 2), (0, 0.5)):
            bound(case, discount, depth, 30)
        effort(case, 2)
        worth_for_ever(case, 0)
        for policy in [create(name, {}) for name in POLICIES] + [
            create(
                "rollout",
                {"base": base, "reward": reward, "discount": discount, "horizon": 2},
            )
            for base, reward, discount in product(
                ("random", "myopic"), ("expected", "click"), (0, 0.5)
            )
        ]:
            scores = ready(policy, models)(case, 2**63 - 1)
            choice = choose(scores, case.count, 2**63 - 1)
            answered(
                models, int(case.model[choice.group]), case.belief[choice.group], 0
            )

    mood = Mood(levels=(0.5,))
    rng = np.random.default_rng(1)
    models = ModelSet.of([moody(each, mood, rng) for each in random_models(1, [2, 4])])
    case = situation(models, [0, 1], models.prior, [1, 2])
    for name in POLICIES:
        choose(ready(create(name, {}), models, 60)(case, 1), case.count, 1)
    replayed(models, 0, *(np.array([1]) for _ in range(3)))
    forecast(models, 0, models.prior[0], 3, 1)
    liked = np.array([LIKE, 0, NONE])
    _, state = models.mood_course(liked, np.arange(3), liked > 0)
    assert models.mood_class(models.mood_after(state, 0), resumed=True) > 0

    models = ModelSet.of([uncertain(1, 2)])
    case = situation(models, [0], models.prior, [1])
    whole = {"tolerance": 0, "discount": 0}
    for policy in (create("thompson", {}), create("whittle_mc", whole)):
        choose(ready(policy, models)(case, 1), case.count, 1)

    assert dict(kernels()) == before
    assert sum(before.values()) > 0
