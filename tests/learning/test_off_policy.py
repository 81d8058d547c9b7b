"""What another policy would have earned: where it is known, and where it cannot be."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from learning import NONE, Plays
from learning.em import Effort
from learning.fitting import Recipe, fit
from learning.off_policy import (
    CannotAnswer,
    Catalogue,
    Reason,
    Report,
    Rules,
    catalogue,
    evaluate,
    learned,
)
from learning.off_policy.choices import Choices, choices
from learning.off_policy.estimators import doubly_robust, ips, replay, snips
from learning.off_policy.evaluation import report
from learning.off_policy.report import Answer, Refusal
from policies import Floats, Model, Policy, create
from policies.mood import Mood
from tests.learning import worlds
from tests.learning.worlds import (
    ARMS,
    MODEL,
    MODEL_OF,
    TRUE,
    WRONG,
    Rule,
    World,
    stacked,
)
from tests.policies.instances import moody
from tests.policies.oracles import Feeling

MYOPIC = create("myopic", {})
SLOTS = 8
ANY = Rules(least_effective=1, draws=200)


def catalogue_of(plays: Plays, models: Sequence[Model] = TRUE) -> Catalogue:
    return catalogue(plays, worlds.named(models), MODEL_OF)


def answer(found: Report, method: str, in_a_row: int = 1) -> Answer:
    for each in found.answers:
        if (each.method, each.in_a_row) == (method, in_a_row):
            assert isinstance(each, Answer)
            return each
    raise AssertionError(method)


def error(found: Answer) -> float:
    """The standard error of an estimate."""
    return (found.estimate.high - found.estimate.low) / 4


def refusals(found: Report) -> dict[tuple[str, int], Reason]:
    return {
        (each.method, each.in_a_row): each.why.reason
        for each in found.answers
        if isinstance(each, Refusal)
    }


TARGETS: dict[str, tuple[Policy, Callable[[Sequence[Model]], Rule]]] = {
    "myopic": (MYOPIC, worlds.myopic),
    "round_robin": (create("round_robin", {}), lambda _: worlds.round_robin),
    "best_fixed": (
        create("best_fixed", {"discount": 0.9}),
        partial(worlds.best_fixed, discount=0.9),
    ),
    "epsilon": (
        create("epsilon", {"epsilon": 0.3}),
        lambda models: worlds.mostly(worlds.myopic(models), 0.3),
    ),
}


@pytest.mark.parametrize("models", [TRUE, WRONG], ids=["true", "wrong"])
@pytest.mark.parametrize("name", TARGETS)
def test_a_policy_looks_at_the_situations_of_a_log(
    name: str, models: Sequence[Model]
) -> None:
    policy, rule = TARGETS[name]
    logger = worlds.mostly(worlds.myopic(models), 0.5)
    played = World(40, 1, models).play([logger] * 20, rule(models))
    plays = worlds.log_of(played)

    found = choices(plays, catalogue_of(plays, models), policy)

    expected = worlds.choices_of(played)
    for field in ("user", "reward", "logged", "offered"):
        assert (getattr(found, field) == getattr(expected, field)).all(), field
    for field in ("target", "expected", "promised"):
        assert_allclose(
            getattr(found, field), getattr(expected, field), atol=1e-9, err_msg=field
        )


def test_plays_that_users_chose_only_teach() -> None:
    played = World(30, 2).play([worlds.uniform] * SLOTS, worlds.myopic(TRUE))
    plays = worlds.log_of(played)
    told = plays.propensity
    assert told is not None
    own = np.random.default_rng(0).random(len(plays)) < 0.4

    known = choices(plays, catalogue_of(plays), MYOPIC)
    found = choices(
        replace(plays, propensity=np.where(own, np.nan, told)),
        catalogue_of(plays),
        MYOPIC,
    )

    for field in ("user", "reward", "logged", "target", "promised"):
        assert (getattr(found, field) == getattr(known, field)[~own]).all()


def test_a_slot_of_several_plays_is_filled_one_after_the_other() -> None:
    plays = Plays(
        np.zeros(4, dtype=np.int64),
        np.array([0, 1, 4, 0]),
        np.array([1, 0, 1, 0], dtype=np.int8),
        None,
        np.array([0.2, 0.25, 1 / 3, 0.5]),
        ["ann"],
        ARMS,
        slots=np.array([0, 0, 0, 1]),
    )
    known = catalogue_of(plays)

    lot = choices(plays, known, create("random", {}))
    greedy = choices(plays, known, MYOPIC)
    planned = choices(plays, known, create("exact_rollout", {"leaf": "none"}))

    assert lot.offered.tolist() == [5, 4, 3, 5]
    assert_allclose(lot.target, [1 / 5, 1 / 4, 1 / 3, 1 / 5])
    assert_allclose(greedy.target[:3], [1 / 3, 1 / 2, 0])
    assert_allclose(planned.target[:2], [1 / 3, 1 / 2])
    first = known.models.prior[0] @ known.models.like[0]
    assert_allclose(greedy.expected[:2], first)


def test_only_what_is_offered_can_be_chosen() -> None:
    played = World(30, 3).play([worlds.uniform] * SLOTS, worlds.myopic(TRUE))
    plays = worlds.log_of(played)
    some = catalogue(plays, worlds.named(TRUE), MODEL_OF, offered={"b", "c", "e"})

    found = choices(plays, some, create("random", {}))

    offered = np.isin(plays.arm, [1, 2, 4])
    assert (found.offered == 3).all()
    assert_allclose(found.target, np.where(offered, 1 / 3, 0))


def drawn(seed: int, count: int = 40) -> Choices:
    rng = np.random.default_rng(seed)
    return Choices(
        np.sort(rng.integers(0, 8, count)),
        rng.random(count),
        rng.uniform(0.05, 1, count),
        rng.random(count),
        np.full(count, 5),
        rng.random(count),
        rng.random(count),
    )


def test_estimates_are_the_ratios_that_they_are_named_for() -> None:
    found = drawn(1)
    given = zip(
        *(found.target, found.logged, found.reward, found.expected, found.promised),
        strict=True,
    )
    rows = [(t / p, t, r, q, v) for t, p, r, q, v in given]
    count = len(rows)

    weights = found.weights()
    values = [
        ratio.top.sum() / ratio.bottom.sum()
        for ratio in (
            replay(found),
            ips(found, weights),
            snips(found, weights),
            doubly_robust(found, weights),
        )
    ]

    assert_allclose(
        values,
        [
            sum(t * r for _, t, r, _, _ in rows) / sum(t for _, t, *_ in rows),
            sum(w * r for w, _, r, _, _ in rows) / count,
            sum(w * r for w, _, r, _, _ in rows) / sum(w for w, *_ in rows),
            sum(v + w * (r - q) for w, _, r, q, v in rows) / count,
        ],
    )


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32), st.integers(1, 6))
def test_weights_in_a_row_are_of_the_users_last_choices(
    seed: int, in_a_row: int
) -> None:
    found = drawn(seed)
    each = found.target / found.logged

    weights = found.weights(in_a_row)

    for row, user in enumerate(found.user):
        own = np.flatnonzero(found.user[: row + 1] == user)[-in_a_row:]
        assert weights[row] == pytest.approx(each[own].prod())


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32), st.floats(0.1, 2), st.floats(-1, 1))
def test_a_policy_like_the_logs_earns_as_much_on_any_scale(
    seed: int, scale: float, shift: float
) -> None:
    found = drawn(seed, 200)
    alike = replace(found, target=found.logged, promised=found.expected)
    other = replace(
        alike,
        reward=scale * alike.reward + shift,
        expected=scale * alike.expected + shift,
        promised=scale * alike.promised + shift,
    )
    rules = Rules(in_a_row=3, draws=20, least_users=2)

    for each in (alike, other):
        told = report(each, rules)
        mean = each.reward.mean()
        assert told.logged.mean == pytest.approx(mean)
        for method, row in (("ips", 1), ("snips", 1), ("dr", 1), ("pdis", 3)):
            found_mean = answer(told, method, row)
            assert found_mean.estimate.mean == pytest.approx(mean)
            assert found_mean.gain.low == pytest.approx(0, abs=1e-9)
            assert found_mean.effective == pytest.approx(200)


WORLDS = [
    ("myopic", worlds.uniform, TRUE),
    ("round_robin", worlds.mostly(worlds.myopic(TRUE), 0.6), TRUE),
    ("best_fixed", worlds.uniform, WRONG),
    ("round_robin", worlds.mostly(worlds.myopic(WRONG), 0.6), WRONG),
]


@pytest.fixture(scope="module", params=range(len(WORLDS)))
def trials(request: pytest.FixtureRequest) -> tuple[float, bool, Sequence[Report]]:
    """What a policy truly earns, and 200 logs of 100 users that tell of it."""
    name, logger, models = WORLDS[request.param]
    rule, logs = TARGETS[name][1](models), 200
    rules = [logger] * SLOTS
    truth = float(World(200_000, 7, models).play(rules, rule).worth.mean())
    found = worlds.choices_of(World(100 * logs, 8, models).play(rules, rule))
    log = found.user // 100
    told = [report(found.of(log == n), ANY) for n in range(logs)]
    return truth, models is TRUE, told


def test_estimates_are_unbiased_and_their_intervals_hold(
    trials: tuple[float, bool, Sequence[Report]],
) -> None:
    """Whether or not the models are right."""
    truth, right, told = trials
    spread = {}

    for method in ("ips", "snips", "dr"):
        some = [each for each in told if (method, 1) not in refusals(each)]
        estimates = [answer(each, method).estimate for each in some]
        apart = np.array([each.mean for each in estimates]) - truth
        held = np.mean([each.low <= truth <= each.high for each in estimates])
        assert len(some) > 0.97 * len(told)
        assert abs(apart.mean()) < 4 * apart.std() / np.sqrt(len(apart))
        assert 0.9 < held < 0.99
        spread[method] = apart.std()

    if right:
        assert spread["dr"] < 0.95 * spread["ips"]
    promised = np.mean([each.promised.mean for each in told])
    assert (abs(promised - truth) < 0.01) == right


@pytest.mark.parametrize("in_a_row", [2, 3])
def test_choices_in_a_row_meet_the_situations_that_they_lead_to(in_a_row: int) -> None:
    rule, logger = worlds.myopic(TRUE), worlds.mostly(worlds.myopic(TRUE), 0.5)
    truth = 0.0
    for slot in range(SLOTS):
        own = min(in_a_row, slot + 1)
        course = [logger] * (slot + 1 - own) + [rule] * own
        after = World(40_000, slot, TRUE).play(course, rule)
        truth += float(after.truth[-1].mean()) / SLOTS
    log = worlds.choices_of(World(20_000, 9).play([logger] * SLOTS, rule))

    told = report(log, Rules(in_a_row=in_a_row))

    effective = [each.effective for each in told.support]
    assert np.all(np.diff(effective) < 0)
    for method in ("pdis", "weighted_pdis"):
        found = answer(told, method, in_a_row)
        assert abs(found.estimate.mean - truth) < 4 * error(found)
        assert found.effective == effective[-1]
    alone = answer(told, "snips")
    assert abs(alone.estimate.mean - truth) > 4 * error(alone)


def uniform_log(users: int = 200) -> Plays:
    return worlds.log_of(World(users, 4).play([worlds.uniform] * SLOTS, worlds.uniform))


def test_on_a_uniform_log_replay_answers_as_snips_does() -> None:
    plays = uniform_log()

    told = evaluate(plays, catalogue_of(plays), MYOPIC)

    assert not told.refused
    assert not refusals(told)
    one, other = answer(told, "replay"), answer(told, "snips")
    assert one.estimate.mean == pytest.approx(other.estimate.mean)
    assert one.effective == pytest.approx(other.effective)


def test_a_log_without_chance_tells_only_where_policies_agree() -> None:
    greedy = worlds.mostly(worlds.myopic(TRUE), 0.0)
    plays = worlds.log_of(World(300, 5).play([greedy] * SLOTS, worlds.uniform))
    told = plays.propensity
    assert told is not None
    plays = replace(plays, propensity=np.ones(len(plays)))
    lucky = told == 1

    found = evaluate(plays, catalogue_of(plays), MYOPIC, Rules(in_a_row=2))

    assert found.refused
    assert {*refusals(found).values()} == {Reason.DETERMINISTIC_LOG}
    weight = np.where(lucky, 1.0, told)
    expected = weight @ plays.answer / weight.sum()
    assert answer(found, "matches").estimate.mean == pytest.approx(expected)


def never(*arms: int) -> Rule:
    """Any other arm."""

    def rule(belief: Floats, _rested: object) -> Floats:
        chance = np.ones(belief.shape[:2])
        chance[:, arms] = 0
        chances: Floats = chance / chance.sum(axis=1, keepdims=True)
        return chances

    return rule


def test_what_the_log_never_chooses_is_found_and_refused() -> None:
    plays = worlds.log_of(World(300, 6).play([never(3, 4)] * SLOTS, worlds.uniform))

    told = evaluate(plays, catalogue_of(plays), create("random", {}))
    some = catalogue(plays, worlds.named(TRUE), MODEL_OF, offered={"a", "b", "c"})
    fitting = evaluate(plays, some, create("random", {}))

    assert told.support[0].unsupported == pytest.approx(0.4)
    assert told.refused
    assert refusals(told) == {
        ("replay", 1): Reason.NOT_UNIFORM,
        **dict.fromkeys([("ips", 1), ("snips", 1), ("dr", 1)], Reason.UNSUPPORTED),
    }
    assert not refusals(fitting)


def test_propensities_that_are_too_low_are_noticed() -> None:
    plays = uniform_log()
    told = plays.propensity
    assert told is not None
    low = replace(plays, propensity=told / 2)

    found = evaluate(low, catalogue_of(low), MYOPIC)

    assert refusals(found)["ips", 1] == Reason.WRONG_PROPENSITIES


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda _: None, Reason.NO_PROPENSITIES),
        (lambda p: np.full(len(p), np.nan), Reason.NO_PROPENSITIES),
        (lambda p: np.where(np.arange(len(p)) == 3, 0.0, p), Reason.BAD_PROPENSITIES),
        (lambda p: p * 6, Reason.BAD_PROPENSITIES),
        (lambda p: np.append(np.inf, p[1:]), Reason.BAD_PROPENSITIES),
        (
            lambda p: np.where(np.arange(len(p)) < 90, p, np.nan),
            Reason.TOO_FEW_PLAYS,
        ),
        (
            lambda p: np.where(np.arange(len(p)) < 160, p, np.nan),
            Reason.TOO_FEW_USERS,
        ),
    ],
)
def test_a_log_that_cannot_answer_says_why(
    change: Callable[[Floats], Floats | None], reason: Reason
) -> None:
    plays = uniform_log()
    told = plays.propensity
    assert told is not None
    plays = replace(plays, propensity=change(told))

    with pytest.raises(CannotAnswer, match=reason) as found:
        evaluate(plays, catalogue_of(plays), MYOPIC)

    assert found.value.reason == reason


def test_answers_that_are_worth_few_plays_are_refused() -> None:
    plays = uniform_log(users=40)

    told = evaluate(plays, catalogue_of(plays), MYOPIC, Rules(in_a_row=2))

    assert told.support[1].effective < told.support[0].effective < 100
    assert {*refusals(told).values()} == {Reason.FEW_EFFECTIVE}


def test_weights_that_are_cut_off_cost_at_most_what_is_lost() -> None:
    rule = worlds.mostly(worlds.myopic(TRUE), 0.3)
    played = World(3000, 10).play([rule] * SLOTS, worlds.round_robin)
    found = worlds.choices_of(played)

    whole, cut = report(found, ANY), report(found, replace(ANY, clip=5.0))

    lost = cut.support[0].lost
    assert whole.support[0].lost == 0 < lost
    assert cut.support[0].effective > whole.support[0].effective
    assert cut.support[0].mean == whole.support[0].mean
    fell = answer(whole, "ips").estimate.mean - answer(cut, "ips").estimate.mean
    assert 0 < fell <= lost
    apart = answer(whole, "dr").estimate.mean - answer(cut, "dr").estimate.mean
    assert abs(apart) < lost


def test_plays_without_an_answer_are_weighed_but_earn_nothing_known() -> None:
    """Arms that are seldom answered do not mislead `snips`."""
    played = World(4000, 11).play([worlds.uniform] * SLOTS, worlds.uniform)
    plays = worlds.log_of(played)
    rng = np.random.default_rng(0)
    silent = rng.random(len(plays)) < np.where(plays.arm < 3, 0.8, 0.1)
    plays = replace(plays, answer=np.where(silent, NONE, plays.answer).astype(np.int8))
    found = choices(plays, catalogue_of(plays), MYOPIC)

    told = report(found)

    assert told.choices == len(plays)
    assert told.answered == (~silent).sum()
    assert told.support[0].mean == pytest.approx(found.weights().mean())
    truth = (found.target * played.truth.T.ravel())[~silent].sum()
    near = answer(told, "snips")
    apart = near.estimate.mean - truth / found.target[~silent].sum()
    assert abs(apart) < 4 * error(near)


def test_models_that_were_learned_can_be_asked() -> None:
    plays = uniform_log()
    fitted = fit(plays, Recipe(states=2, types=2, effort=Effort(starts=1, steps=5)))

    told = evaluate(plays, learned(plays, fitted), MYOPIC)

    assert answer(told, "dr").effective > 100
    with pytest.raises(ValueError, match="fitted"):
        learned(plays, replace(fitted, recipe=Recipe(in_time=True)))


def moved(beliefs: Floats, models: Sequence[Model], name: str) -> Floats:
    """Move the belief in each arm on by a slot."""
    after: Floats = np.einsum("as,ast->at", beliefs, stacked(models, name))
    return after


def test_choices_are_judged_in_the_mood_of_their_slot() -> None:
    """In a slot of two plays, too; and a user is in a mood for himself."""
    rng = np.random.default_rng(5)
    slots = np.array([0, 1, 2, 2, 5, 6, 7, 8, 8, 9])
    answers = np.array([1, 0, 1, 1, NONE, 1, 0, 0, 1, 1])
    gaps = np.array([0, 10, 90, 0, 10, 70, 10, 10, 0, 10])
    plays = Plays(
        np.repeat([0, 1], 10),
        np.tile([0, 1, 2, 3, 0, 4, 4, 1, 3, 2], 2),
        np.concatenate((answers, answers)).astype(np.int8),
        np.tile(gaps.cumsum().astype(np.float64), 2),
        np.full(20, 0.2),
        ("ann", "bob"),
        ARMS,
        slots=np.tile(slots, 2),
    )
    mood = Mood(answers=1, memory=2.0, levels=(0.5,), pause_s=60.0)
    models = [moody(model, mood, rng) for model in TRUE]

    found = choices(plays, catalogue_of(plays, models), MYOPIC)

    beliefs, told = stacked(models, "prior"), list[int]()
    for slot in range(10):
        after = moved(beliefs, models, "rest")
        feeling = Feeling(tuple(told), bool(gaps[slots == slot].max(initial=0) > 60))
        like = stacked(models, "like_in")[:, feeling.of(mood)]
        for p in np.flatnonzero(slots == slot):
            arm, answered = plays.arm[p], answers[p]
            assert found.expected[p] == pytest.approx(beliefs[arm] @ like[arm])
            belief, model = beliefs[arm], models[MODEL[arm]]
            if answered != NONE:
                belief = belief * feeling.observe(model)[:, answered]
                told.append(int(answered))
            after[arm] = belief @ model.play / belief.sum()
        beliefs = after
    assert (found.expected[10:] == found.expected[:10]).all()


def test_learned_models_keep_their_moods() -> None:
    plays = uniform_log()
    mood = Mood(answers=1, levels=())
    recipe = Recipe(states=2, mood=mood, effort=Effort(starts=1, steps=5))

    known = learned(plays, fit(plays, recipe))

    assert known.models.classes == mood.classes
    assert answer(evaluate(plays, known, MYOPIC), "dr").effective > 100


def test_a_catalogue_has_to_fit_its_log() -> None:
    plays, models = uniform_log(users=1), worlds.named(TRUE)

    with pytest.raises(ValueError, match="'e' has no model"):
        catalogue(plays, models, {**MODEL_OF, "e": "third"})
    with pytest.raises(ValueError, match="signal 'love'"):
        catalogue(replace(plays, signals=("skip", "love")), models, MODEL_OF)
    with pytest.raises(ValueError, match="offered"):
        catalogue(plays, models, MODEL_OF, offered={"z"})


@pytest.mark.parametrize(
    "bad",
    [{"in_a_row": 0}, {"draws": 0}, {"clip": 0.0}, {"least_users": 1}],
)
def test_rules_are_checked(bad: dict[str, int]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        Rules(**bad)


def test_a_report_is_for_people_and_programs() -> None:
    plays = uniform_log(users=60)

    told = evaluate(plays, catalogue_of(plays), MYOPIC, Rules(in_a_row=4))

    plain = json.loads(json.dumps(told.plain()))
    assert plain["choices"] == plain["answered"] == len(plays)
    assert [each["in_a_row"] for each in plain["support"]] == [1, 2, 3, 4]
    methods = {each["method"]: each for each in plain["answers"]}
    estimate = answer(told, "replay").estimate
    assert methods["replay"]["estimate"]["mean"] == estimate.mean
    assert methods["pdis"]["reason"] == "few_effective"
    text = told.markdown()
    assert f"| replay | 1 | {estimate.mean:.4f} (" in text
    assert "No `pdis` (4), `weighted_pdis` (4): the answers are worth" in text


def test_threads_and_seeds_change_nothing_that_they_should_not() -> None:
    plays = uniform_log(users=60)
    ask = partial(evaluate, plays, catalogue_of(plays), MYOPIC)

    assert ask().plain() == ask().plain()
    one, other = ask(Rules(seed=1)), ask(Rules(seed=2))
    assert answer(one, "ips").estimate.mean == answer(other, "ips").estimate.mean
    assert answer(one, "ips").estimate != answer(other, "ips").estimate
