"""Forecasters before the same plays: what is scored, and what is told of it."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from learning import NONE, Plays
from learning.evaluation import BASELINES, Evaluation, Forecaster, evaluate, table
from learning.evaluation.metrics import losses
from learning.plays import Bools
from policies import Floats
from tests.learning.logs import listened, log

LOG = listened(users=6, count=120, arms=5, seed=4)
SIMPLE = ("constant", "user rate", "user-arm rate", "user-arm rate, mood")


def always(chance: float) -> Forecaster:
    return lambda plays, _train: np.full(len(plays), chance)


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    return evaluate(LOG, {name: BASELINES[name] for name in SIMPLE})


def test_answered_repeats_of_the_last_plays_count() -> None:
    plays = log([0] * 10 + [1], [0] * 7 + [0, 1, 1] + [0], [1] * 7 + [0, 1, NONE] + [1])

    repeats = evaluate(plays, {"always": always(0.75)})
    every = evaluate(plays, {"always": always(0.75)}, repeats=False)

    assert repeats.users == ["user 0"]
    assert_array_equal(repeats.plays, [1])
    assert repeats.scores[0].log_loss == pytest.approx(-np.log(0.25))
    assert np.isnan(repeats.scores[0].auc)
    assert every.users == ["user 0", "user 1"]
    assert_array_equal(every.plays, [2, 1])
    losses_of_each = -np.log([0.25 * 0.75, 0.75]) / [2, 1]
    assert_allclose(every.scores[0].by_user, losses_of_each)
    assert every.scores[0].log_loss == pytest.approx(-np.log(0.25 * 0.75**2) / 3)


def test_a_forecaster_sees_which_plays_train() -> None:
    seen: list[Bools] = []

    def watching(plays: Plays, train: Bools) -> Floats:
        seen.append(train)
        return np.full(len(plays), 0.5)

    evaluate(LOG, {"watching": watching}, share=0.5)

    assert_array_equal(seen[0], LOG.earliest(0.5))


def test_differences_are_paired(evaluation: Evaluation) -> None:
    first, *others = evaluation.scores

    assert first.difference_ci95 == (0.0, 0.0)
    for score in others:
        low, high = score.difference_ci95
        assert low < score.difference < high
        assert score.difference == pytest.approx(score.log_loss - first.log_loss)
        assert high - low < 2 * np.ptp(score.by_user - first.by_user)
    for score in evaluation.scores:
        assert score.log_loss_ci95[0] < score.log_loss < score.log_loss_ci95[1]
        weighted = score.by_user @ evaluation.plays / evaluation.plays.sum()
        assert score.log_loss == pytest.approx(weighted)


def test_scores_are_those_of_the_forecasts(evaluation: Evaluation) -> None:
    train = LOG.earliest(0.7)
    rows = ~train & LOG.repeated & (LOG.liked != NONE)

    for score in evaluation.scores:
        chances = BASELINES[score.forecaster](LOG, train)
        expected = losses(chances[rows], LOG.liked[rows]).mean()
        assert score.log_loss == pytest.approx(expected)


@pytest.mark.parametrize(
    "wrong", [always(1.5), always(-0.1), always(np.nan), lambda *_: np.array([0.5])]
)
def test_what_is_no_chance_is_refused(wrong: Forecaster) -> None:
    with pytest.raises(ValueError, match="wrong: must give a chance"):
        evaluate(LOG, {"wrong": wrong})


def test_a_log_with_nothing_to_score_is_refused() -> None:
    with pytest.raises(ValueError, match="hold none to score"):
        evaluate(log([0], [0], [1]), {"always": always(0.5)})


def test_json_holds_an_evaluation(evaluation: Evaluation) -> None:
    plain = evaluation.plain()
    alike = evaluate(log([0, 0], [0, 0], [1, 1]), {"always": always(0.5)}, 0.5)

    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert [score["forecaster"] for score in plain["scores"]] == list(SIMPLE)
    assert json.loads(json.dumps(alike.plain(), allow_nan=False))
    assert alike.plain()["scores"][0]["auc"] is None


def test_a_table_has_a_line_for_each(evaluation: Evaluation) -> None:
    heads, rule, first, *others = table(evaluation).splitlines()

    assert first.startswith(f"| constant | {evaluation.scores[0].log_loss:.4f} | ")
    assert all(f" of {len(evaluation.users)} | " in line for line in others)
    for line in (heads, rule, first, *others):
        assert line.count("|") == heads.count("|")


def test_plots_are_drawn_twice_alike(evaluation: Evaluation, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from learning.evaluation.plots import draw  # noqa: PLC0415 - of an extra

    drawn = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        assert list(draw(evaluation, folder)) == ["log-loss", "reliability"]
        drawn.append({file.name: file.read_bytes() for file in folder.iterdir()})

    assert drawn[0] == drawn[1]
    assert set(drawn[0]) == {
        f"{name}.{kind}"
        for name in ("log-loss", "reliability")
        for kind in ("svg", "png")
    }
    assert b"user-arm rate, mood" in drawn[0]["log-loss.svg"]
