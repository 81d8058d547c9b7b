"""Slots that follow a clock: who comes back late comes back rested."""

import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.services import fits
from app.services.exports import export_history
from app.services.fits import Naming
from app.services.logs import log
from app.settings import Settings
from app.storage.tables import audit as audit_table
from app.storage.tables import beliefs as beliefs_table
from app.storage.tables import plays as plays_table
from app.storage.tables import users as users_table
from learning.chain import Chain
from learning.em import Effort
from learning.expectation import chances
from learning.fitting import Recipe, fit
from learning.plays import Plays
from learning.streams import streams
from policies import Floats
from tests.app.clocks import later, set_clock, with_database
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_audits import audit, rebuild
from tests.app.test_transfers import exported, history_in

MINUTE, HOUR, DAY = 60.0, 3600.0, 86_400.0
WEEKS = 21 * DAY

# A play wears an item out; it comes back within days.
PLAY = np.array([[0.95, 0.05, 0.0], [0.5, 0.45, 0.05], [0.2, 0.5, 0.3]])
GENERATOR = np.array([[-3.0, 2.9, 0.1], [0.5, -3.5, 3.0], [0.0, 1.0, -1.0]]) / WEEKS
LIKE = np.array([0.05, 0.4, 0.9])
PRIOR = np.array([0.1, 0.3, 0.6])
SONGS = ("one", "two", "three", "four", "five", "six")


def rests(seconds: float) -> Floats:
    """The moves of a rest: expm(G d), by the eigenvectors of G."""
    values, vectors = np.linalg.eig(GENERATOR)
    moves = vectors * np.exp(values * seconds) @ np.linalg.inv(vectors)
    return np.array(moves.real)


def model(slot_s: float) -> dict[str, Any]:
    rest = rests(slot_s)
    return {
        "states": ["worn", "fair", "fresh"],
        "play": (PLAY @ rest).tolist(),
        "rest": rest.tolist(),
        "like": LIKE.tolist(),
        "prior": PRIOR.tolist(),
    }


class ByHand:
    """What is believed of items that tire, in plain NumPy."""

    def __init__(self, slot_s: float) -> None:
        self.slot_s = slot_s
        self.slot = dict.fromkeys(SONGS, 0)
        self.belief = dict.fromkeys(SONGS, PRIOR)

    def at(self, item: str, slot: int) -> Floats:
        rested = (slot - self.slot[item]) * self.slot_s
        moved: Floats = self.belief[item] @ rests(rested)
        return moved

    def take(self, item: str, slot: int, signal: str) -> None:
        told = {"like": LIKE, "skip": 1 - LIKE, "none": np.ones(3)}[signal]
        weights = self.at(item, slot) * told
        self.belief[item] = weights / weights.sum() @ PLAY @ rests(self.slot_s)
        self.slot[item] = slot + 1


@pytest.fixture
def radio(service: Service) -> Service:
    """Six songs that tire, chosen at random; slots of a minute."""
    fill(service, MINUTE)
    return service


def fill(service: Service, slot_s: float) -> None:
    service.put_model("song", model(slot_s))
    for song in SONGS:
        service.put_item(song, "song")
    service.set_policy("random")
    set_clock(service, slot_s)


def listen(service: Service, user: str, signals: Sequence[str]) -> list[dict[str, Any]]:
    shown = []
    for signal in signals:
        shown.append(service.next(user))
        service.answer(shown[-1]["play"], signal)
    return shown


def sound(service: Service, users: Sequence[str], shown: Sequence[str]) -> None:
    """What is kept is what the log says, and each decision can be taken again."""
    assert [(one.stale, one.findings) for one in audit(service)] == [
        (False, []) for _ in users
    ]
    kept = packed(service)
    records = [service.client.get(f"/v1/plays/{play}").json() for play in shown]
    rebuild(service)
    assert packed(service) == kept
    assert taken_again(service, list(shown)) == [
        (one["play"], (one["item"], one["like"], one["propensity"])) for one in records
    ]


def packed(service: Service) -> list[tuple[object, ...]]:
    """Every user's slot, and beliefs as they are kept."""
    kept = sa.select(users_table.c.slot, beliefs_table.c.packed).join_from(
        users_table, beliefs_table, beliefs_table.c.user_id == users_table.c.id
    )
    rows = with_database(
        service, lambda database: database.run(lambda store: store.rows(kept))
    )
    return sorted(tuple(row) for row in rows)


def test_who_was_away_for_three_weeks_comes_back_rested(radio: Service) -> None:
    by_hand, signals = ByHand(MINUTE), ["like", "skip", "none", "like", "like"]
    first = listen(radio, "ann", signals)
    for slot, (play, signal) in enumerate(zip(first, signals, strict=True)):
        assert play["slot"] == slot
        by_hand.take(play["item"], slot, signal)
    skipped = {"item": "one", "signal": "skip"}
    radio.client.post("/v1/users/ann/plays", json=skipped).raise_for_status()
    by_hand.take("one", 5, "skip")

    later(radio, "ann", WEEKS)
    held = radio.beliefs("ann", item=SONGS)
    play = radio.next("ann")

    slot = 21 * 24 * 60
    assert held["slot"] == play["slot"] == slot
    for belief in held["beliefs"]:
        expected = by_hand.at(belief["item"], slot)
        assert belief["belief"] == pytest.approx(expected, abs=1e-10)
    assert play["like"] == pytest.approx(by_hand.at(play["item"], slot) @ LIKE)
    assert by_hand.at("one", slot) @ LIKE > by_hand.at("one", 6) @ LIKE + 0.2
    assert radio.answer(play["play"], "like")["slot"] == slot + 1
    sound(radio, ["ann"], [one["play"] for one in (*first, play)])


def test_without_a_clock_time_moves_nothing(radio: Service) -> None:
    set_clock(radio, None)
    listen(radio, "ann", ["like", "skip"])
    before = radio.beliefs("ann")

    later(radio, "ann", WEEKS)

    assert radio.beliefs("ann") == before
    assert radio.next("ann")["slot"] == 2


def test_a_clock_is_set_and_stopped_and_outlives_the_process(
    settings: Settings,
) -> None:
    service = Service.start(settings)
    clock = service.client.get("/v1/admin/clock").json()
    put = service.client.put("/v1/admin/clock", json={"slot_s": 90}).json()
    same = service.client.put("/v1/admin/clock", json={"slot_s": 90.0}).json()
    service.stop()

    service = Service.start(settings)
    kept = service.client.get("/v1/admin/clock").json()
    stopped = [service.client.delete("/v1/admin/clock").status_code for _ in range(2)]
    after = service.client.get("/v1/admin/clock").json()
    acts = with_database(
        service,
        lambda database: database.run(
            lambda store: store.rows(
                sa.select(audit_table).where(audit_table.c.action == "clock")
            )
        ),
    )
    service.stop()

    assert clock == {"version": 0, "slot_s": None}
    assert put == same == kept == {"version": 1, "slot_s": 90.0}
    assert stopped == [204, 204]
    assert after == {"version": 2, "slot_s": None}
    assert [(act.subject, act.detail) for act in acts] == [
        ("1", {"slot_s": 90.0}),
        ("2", {"slot_s": None}),
    ]


@pytest.mark.parametrize("slot_s", [0, 0.5, -60, 1e9, 10**400, "60", None, True])
def test_a_slot_lasts_from_a_second_to_a_day(service: Service, slot_s: object) -> None:
    answer = service.client.put(
        "/v1/admin/clock", content=json.dumps({"slot_s": slot_s}), headers=AS_JSON
    )

    assert answer.status_code == 422
    assert answer.json()["code"] in {"invalid_request", "malformed_body"}
    assert service.client.get("/v1/admin/clock").json()["slot_s"] is None


AS_JSON = {"Content-Type": "application/json"}


def test_only_an_admin_sets_the_clock(service: Service) -> None:
    made = service.client.post("/v1/admin/keys", json={"name": "app", "scope": "serve"})
    with service.with_key(made.json()["key"]) as client:
        answers = [
            client.get("/v1/admin/clock"),
            client.put("/v1/admin/clock", json={"slot_s": 60}),
            client.delete("/v1/admin/clock"),
        ]

    assert [answer.status_code for answer in answers] == [403] * 3


def test_users_go_on_where_they_are_when_a_clock_is_set_or_changed(
    radio: Service,
) -> None:
    set_clock(radio, None)
    listen(radio, "ann", ["like"] * 3)
    later(radio, "ann", 10 * MINUTE)

    set_clock(radio, MINUTE)
    since_last_seen = radio.beliefs("ann")["slot"]
    shown = [radio.next("ann")]
    radio.answer(shown[0]["play"], "like")
    set_clock(radio, HOUR)
    at_once = radio.beliefs("ann")["slot"]
    later(radio, "ann", 5 * HOUR)
    by_the_hour = radio.next("ann")["slot"]
    set_clock(radio, None)

    assert (since_last_seen, shown[0]["slot"]) == (13, 13)
    assert at_once == 14
    assert by_the_hour == 19
    assert radio.beliefs("ann")["slot"] == 19
    sound(radio, ["ann"], [shown[0]["play"]])


def test_a_clock_that_is_put_back_leaves_slots_to_plays(radio: Service) -> None:
    listen(radio, "ann", ["like"])
    later(radio, "ann", HOUR)
    listen(radio, "ann", ["skip"])

    later(radio, "ann", -DAY)
    shown = listen(radio, "ann", ["like", "like"])

    assert [play["slot"] for play in shown] == [61, 62]
    sound(radio, ["ann"], [play["play"] for play in shown])


def test_more_plays_than_the_clock_has_slots_take_one_each(radio: Service) -> None:
    listen(radio, "ann", ["like"] * 8)

    later(radio, "ann", 5 * MINUTE)
    still_ahead = radio.beliefs("ann")["slot"]
    later(radio, "ann", 5 * MINUTE)

    assert still_ahead == 8
    assert radio.next("ann")["slot"] == 10


def test_a_play_keeps_the_slot_in_which_it_was_shown(radio: Service) -> None:
    listen(radio, "ann", ["like"])
    slate = radio.next("ann", count=2)["plays"]
    later(radio, "ann", 20 * MINUTE)

    again = radio.next("ann", count=2)
    answered = radio.answer(slate[0]["play"], "like")
    late = radio.answer(slate[1]["play"], "skip", next=True)

    assert [one["play"] for one in again["plays"]] == [one["play"] for one in slate]
    assert (again["slot"], answered["slot"], late["slot"]) == (1, 2, 2)
    assert late["next"]["slot"] == 20
    sound(radio, ["ann"], [one["play"] for one in (*slate, late["next"])])


def test_a_play_left_without_an_answer_took_the_slot_in_which_it_was_shown(
    radio: Service,
) -> None:
    left = radio.next("ann")
    later(radio, "ann", DAY)

    play = radio.next("ann")

    [closed] = radio.client.get("/v1/users/ann/plays").json()["plays"]
    assert (closed["play"], closed["signal"], closed["slot"]) == (
        left["play"],
        "none",
        0,
    )
    assert play["slot"] == 24 * 60
    sound(radio, ["ann"], [left["play"], play["play"]])


def test_a_timeline_has_slots_in_which_nothing_was_played(radio: Service) -> None:
    by_hand = ByHand(MINUTE)
    [first] = listen(radio, "ann", ["like"])
    by_hand.take(first["item"], 0, "like")
    later(radio, "ann", 4 * MINUTE)

    path = f"/v1/users/ann/items/{first['item']}/timeline"
    told = radio.client.get(path).json()["timeline"]

    assert [(point["slot"], point["rested"]) for point in told] == [
        (0, None),
        (1, 0),
        (2, 1),
        (3, 2),
        (4, 3),
    ]
    for point in told[1:]:
        expected = by_hand.at(first["item"], point["slot"])
        assert point["belief"] == pytest.approx(expected)


def test_reports_plans_and_forecasts_know_the_time(radio: Service) -> None:
    by_hand = ByHand(MINUTE)
    [first] = listen(radio, "ann", ["skip"])
    by_hand.take(first["item"], 0, "skip")
    waiting = radio.next("ann")
    later(radio, "ann", HOUR)

    told = radio.client.post(
        "/v1/users/ann/plays", json={"item": first["item"], "signal": "like"}
    ).json()
    later(radio, "ann", HOUR)
    plan = radio.client.get("/v1/users/ann/playlist", params={"length": 3}).json()
    forecast = radio.client.get(f"/v1/users/ann/items/{first['item']}/forecast").json()

    by_hand.take(first["item"], 60, "like")
    assert told["slot"] == 61
    assert [play["slot"] for play in plan["plays"]] == [61, 120, 121]
    assert [play["pending"] for play in plan["plays"]] == [True, False, False]
    assert (forecast["slot"], forecast["rested"]) == (120, 59)
    assert forecast["slot_s"] == MINUTE
    assert forecast["like"] == pytest.approx(by_hand.at(first["item"], 120) @ LIKE)
    assert radio.answer(waiting["play"], "like")["slot"] == 62
    sound(radio, ["ann"], [first["play"], waiting["play"]])


def test_round_robin_goes_round_though_plays_are_days_apart(radio: Service) -> None:
    radio.set_policy("round_robin")
    shown = []
    for _ in range(4 * len(SONGS)):
        shown += listen(radio, "ann", ["like"])
        later(radio, "ann", DAY)

    items = [play["item"] for play in shown]
    assert len(set(items[:6])) == 6
    assert items == items[:6] * 4
    sound(radio, ["ann"], [play["play"] for play in shown])


def test_slots_of_a_history_follow_its_times(radio: Service) -> None:
    began = datetime(2020, 2, 29, 20, tzinfo=UTC)
    minutes = (0, 1, 1, 30, 29, 10**6)
    plays = [
        {"at": (began + timedelta(minutes=after)).isoformat()} for after in minutes
    ]
    plays += [{}, {"at": "9999-12-31T23:59:59Z"}]
    lines = [
        json.dumps({"user": "ann", "item": SONGS[k % 6], "signal": "like"} | play)
        for k, play in enumerate(plays)
    ]

    entered = history_in(radio, "\n".join(lines))

    listed = radio.client.get("/v1/users/ann/plays").json()["plays"][::-1]
    now = (datetime.now(UTC) - began) // timedelta(minutes=1)
    assert entered.entered == 8
    slots = [play["slot"] for play in listed]
    assert slots[:7] == [0, 1, 2, 30, 31, 10**6, 10**6 + 1]
    assert slots[7] == pytest.approx(now, abs=2)
    assert radio.next("ann")["slot"] == pytest.approx(now, abs=2)
    sound(radio, ["ann"], [])


def test_a_history_that_is_moved_keeps_its_slots(
    settings: Settings, sqlite_template: Path, tmp_path: Path
) -> None:
    """Also those that shared a slot, or were answered late."""
    path = tmp_path / "elsewhere.db"
    path.write_bytes(sqlite_template.read_bytes())
    here = Service.start(settings)
    moved = replace_url(settings, f"sqlite:///{path}")
    elsewhere = Service.start(moved)
    for service in (here, elsewhere):
        fill(service, MINUTE)
    for away in (100.0, DAY, WEEKS):
        slate = here.next("ann", count=2)["plays"]
        here.answer(slate[0]["play"], "like")
        later(here, "ann", away)
        here.answer(slate[1]["play"], "skip")
    history = exported(here, export_history)

    history_in(elsewhere, "".join(history))

    assert exported(elsewhere, export_history) == history
    held = [service.beliefs("ann", item=SONGS) for service in (here, elsewhere)]
    here.stop()
    elsewhere.stop()
    assert held[0]["slot"] == held[1]["slot"] > 21 * 24 * 60
    assert held[0]["beliefs"] == held[1]["beliefs"]


def replace_url(settings: Settings, url: str) -> Settings:
    return settings.model_copy(update={"database_url": url})


JUMPS = st.one_of(
    st.just(0.0),
    st.floats(0, DAY),
    st.integers(0, 40).map(lambda power: 2.0**power / 100),
)


@settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
@given(
    jumps=st.lists(JUMPS, min_size=1, max_size=12),
    signals=st.lists(st.sampled_from(["like", "skip", "none"]), min_size=12),
    policy=st.sampled_from(["random", "round_robin", "myopic", "exact_rollout"]),
)
def test_whatever_time_passes_the_log_is_the_truth(
    radio: Service, jumps: list[float], signals: list[str], policy: str
) -> None:
    radio.set_policy(policy)
    set_clock(radio, 1.0)
    radio.client.delete("/v1/users/ann")
    by_hand, shown, slot = ByHand(MINUTE), [], 0
    for jump, signal in zip(jumps, signals, strict=False):
        play = radio.next("ann")
        assert play["slot"] >= slot
        expected = by_hand.at(play["item"], play["slot"]) @ LIKE
        assert play["like"] == pytest.approx(expected, abs=1e-9)
        radio.answer(play["play"], signal)
        by_hand.take(play["item"], play["slot"], signal)
        shown.append(play["play"])
        slot = play["slot"] + 1
        later(radio, "ann", jump)

    for belief in radio.beliefs("ann")["beliefs"]:
        assert sum(belief["belief"]) == pytest.approx(1, abs=1e-12)
    sound(radio, ["ann"], shown)


def test_learning_foretells_what_the_service_predicted(radio: Service) -> None:
    """By slots to rounding errors; by the clock, but for parts of slots."""
    plays, predicted = heard(radio)
    by_slots = Chain(PLAY @ rests(MINUTE), rests(MINUTE), OBSERVE, PRIOR)
    by_clock = Chain(PLAY, GENERATOR, OBSERVE, PRIOR, in_time=True)

    assert plays.seconds is not None
    begun = plays.seconds[plays.first[:-1]][plays.user]
    ahead = plays.slot - (plays.seconds - begun) / MINUTE
    assert ahead.min() > -1 - 0.01
    assert ahead.max() <= 0.01
    assert foretold(plays, by_slots) == pytest.approx(predicted, abs=1e-12)
    assert foretold(plays, by_clock) == pytest.approx(predicted, abs=SLOT_MORE_OR_LESS)


def test_what_is_learned_by_the_clock_is_written_for_slots(radio: Service) -> None:
    plays, _ = heard(radio)
    recipe = Recipe(states=2, in_time=True, effort=Effort(starts=1, steps=5))

    fitted = fit(plays, recipe)
    [line] = fits.model_lines(fitted, plays, Naming("song", "test", MINUTE))

    written, [chain] = json.loads(line), fitted.types.chains
    by_slots = Chain(
        np.array(written["play"]),
        np.array(written["rest"]),
        np.column_stack((1 - np.array(written["like"]), written["like"]))[None],
        np.array(written["prior"]),
    )
    away = foretold(plays, by_slots) - foretold(plays, chain)
    assert np.abs(away).max() < 1e-3
    without = replace(by_slots, play=chain.play)
    further = foretold(plays, without) - foretold(plays, chain)
    assert 2 * np.abs(away).mean() < np.abs(further).mean()


OBSERVE = np.array([np.column_stack((1 - LIKE, LIKE))])
SLOT_MORE_OR_LESS = float(np.abs(rests(MINUTE) - np.eye(3)).sum(axis=1).max())


def heard(radio: Service) -> tuple[Plays, Floats]:
    """The log of two users who come now and then, and what was predicted of each."""
    rng = np.random.default_rng(1)
    for user in ("ann", "bob"):
        for gap in rng.exponential(HOUR, 20):
            play = radio.next(user, candidate=str(rng.choice(SONGS)))
            radio.answer(play["play"], str(rng.choice(["like", "skip", "none"])))
            later(radio, user, MINUTE + gap)
    rows = with_database(
        radio, lambda database: database.run(lambda store: store.rows(PREDICTED))
    )
    return with_database(radio, log), np.array([row.predicted for row in rows])


PREDICTED = sa.select(plays_table.c.predicted).order_by(
    plays_table.c.user_id, plays_table.c.closed
)


def foretold(plays: Plays, chain: Chain) -> Floats:
    seen = streams(plays, in_time=chain.in_time)
    found = np.empty(len(plays))
    found[seen.row] = chances(seen, chain)[:, 1]
    return found
