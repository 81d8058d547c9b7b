"""Choosing several items for one slot, as a policy sees it."""

from datetime import UTC, datetime

import numpy as np

from app.domain import ItemModel, Revision
from app.services import beliefs, decisions, slates
from app.services.catalogue import Catalogue, Listing, Shelf
from app.services.decisions import Candidates
from app.services.mathematics import stacked
from app.services.pace import Pace
from app.services.rungs import Rung
from app.storage.packing import Entries
from policies import NEVER, Floats, Policy, Scorer, Situation, create, ready
from tests.catalogues import SIMPLE

NOW = datetime(2026, 11, 22, tzinfo=UTC)


def test_a_policy_that_looks_ahead_is_told_what_is_chosen() -> None:
    seen: list[Situation] = []

    def scores(situation: Situation, _seed: int) -> Floats:
        seen.append(situation)
        return np.linspace(1, 0, len(situation.model))  # the first group is best

    policy = create("rollout", {})
    first = candidates(policy)
    made = slates.decide(first, rung(policy, scores), seed=1, count=6)

    assert [decision.serial for decision in made[:2]] == [1, 4]
    assert sorted(decision.serial for decision in made) == list(range(6))
    whole = first.situation
    groups = [0, 1]  # each played item is one; then come the others by model
    groups += [2 + decision.serial // 3 for decision in made[2:]]
    for place, situation in enumerate(seen):
        situation.check()
        before, slate = groups[:place], situation.slate
        assert situation.count.sum() == 6 - place
        assert slate.plays == 6
        assert np.array_equal(slate.model, whole.model[before])
        assert np.array_equal(slate.belief, whole.belief[before])


def test_an_index_is_asked_once_and_its_best_items_are_taken() -> None:
    asked = []

    def scores(situation: Situation, _seed: int) -> Floats:
        asked.append(situation)
        return np.array([1.0, 3.0, 2.0, 2.0])

    policy = create("myopic", {})
    made = slates.decide(candidates(policy), rung(policy, scores), seed=1, count=6)

    assert len(asked) == 1
    assert made[0].serial == 4
    assert {decision.serial for decision in made[1:5]} == {0, 2, 3, 5}
    assert made[5].serial == 1
    chances = [decision.choice.propensity for decision in made]
    assert chances == [1, 1 / 4, 1 / 3, 1 / 2, 1, 1]


def test_one_play_is_chosen_as_if_there_were_no_slates() -> None:
    policy = create("rollout", {"trajectories": 5})
    found = candidates(policy)
    scorer = ready(policy, found.situation.models)

    [alone] = slates.decide(found, rung(policy, scorer), seed=7, count=1)

    plain = decisions.decide(found, scorer, seed=7)
    assert (alone.serial, alone.choice) == (plain.serial, plain.choice)
    assert np.array_equal(alone.scores, plain.scores)


def candidates(policy: Policy) -> Candidates:
    """Six items of two models; the second and the fifth were played."""
    versions = [model("one"), model("two")]
    listing = Listing()
    for serial in range(6):
        shelf = Shelf(f"item-{serial}", "", (), {})
        listing.put(serial, shelf, ("one", "two")[serial // 3], active=True)
    models = stacked(versions)
    catalogue = Catalogue.build(Revision(1, 1, 1), versions, (), listing, models)
    played = Entries(np.array([1, 4]), np.array([3, 2]), np.array([[0.1, 0.9]] * 2))
    now = beliefs.at(catalogue, played, 5)
    found = decisions.candidates(catalogue, catalogue.pool, now, policy)
    assert found.situation.rested.tolist() == [2, 3, NEVER, NEVER]
    return found


def model(name: str) -> ItemModel:
    return ItemModel(
        id=name, version=1, source="", created_at=NOW, catalogue=1, **SIMPLE
    )


def rung(policy: Policy, scorer: Scorer) -> Rung:
    return Rung(policy, scorer, Pace())
