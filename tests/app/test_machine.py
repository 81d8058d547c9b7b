"""Any sequence of requests keeps the invariants."""

import json
from collections import Counter
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from tests.app.service import Service
from tests.app.test_audits import audit
from tests.catalogues import SIMPLE

USERS = st.sampled_from(["ann", "bob", "cat"])
COUNTS = st.integers(1, 3)
SIGNALS = st.sampled_from(["like", "skip", "none"])
ITEMS = st.integers(0, 5).map(lambda number: f"song-{number}")
POLICIES = st.sampled_from(
    ["random", "round_robin", "myopic", "best_fixed", "rollout", "epsilon"]
)
NUMBERS = iter(range(10**9))


class Listening(RuleBasedStateMachine):
    """Listeners, operators and editors, all at work on one service."""

    service: Service

    @initialize()
    def begin(self) -> None:
        self.run = f"run-{next(NUMBERS)}"
        self.closed: Counter[str] = Counter()
        self.pending: dict[str, dict[str, str]] = {}  # item of each play that waits
        self.taken: dict[str, int] = {}
        self.passed: dict[str, set[str]] = {}
        self.answered: dict[str, str] = {}
        self.service.put_model("even", SIMPLE)
        for number in range(3):
            self.service.put_item(f"song-{number}", "even")

    @rule(user=USERS, count=COUNTS)
    def ask_next(self, user: str, count: int) -> None:
        self.shown(user, count, self.service.next(self.named(user), count=count))

    @rule(user=USERS, signal=SIGNALS, then=st.booleans(), count=COUNTS, data=st.data())
    def answer(
        self, user: str, signal: str, count: int, data: st.DataObject, *, then: bool
    ) -> None:
        if user not in self.pending:
            return
        play = data.draw(st.sampled_from(sorted(self.pending[user])))
        taken = self.service.answer(play, signal, next=then, count=count)
        item = self.pending[user].pop(play)
        slot = self.taken.get(user, self.closed[user])
        if item in self.passed.get(user, ()):
            slot = self.closed[user]
        self.taken.setdefault(user, slot)
        if slot == self.closed[user]:
            self.closed[user] += 1
        if not self.pending[user]:
            self.forget(user)
        self.answered[play] = signal
        assert (taken["slot"], taken["repeated"]) == (slot + 1, False)
        if then:
            self.shown(user, count, taken["next"])

    def shown(self, user: str, count: int, play: dict[str, Any]) -> None:
        """What waits is shown whatever is asked for; else as much as there is."""
        plays = play.get("plays", [play])
        items = {one["play"]: one["item"] for one in plays}
        assert play["play"] == plays[0]["play"]
        assert play["slot"] == self.taken.get(user, self.closed[user])
        assert ("plays" in play) == (count > 1 or len(items) > 1)
        if user in self.pending:
            assert items == self.pending[user]
        else:
            assert 1 <= len(set(items.values())) == len(items) <= count
        self.pending[user] = items

    def forget(self, user: str) -> None:
        for noted in (self.pending, self.taken, self.passed):
            noted.pop(user, None)

    @rule(signal=SIGNALS, data=st.data())
    def answer_again(self, signal: str, data: st.DataObject) -> None:
        if not self.answered:
            return
        play = data.draw(st.sampled_from(sorted(self.answered)))
        answer = self.service.client.post(
            f"/v1/plays/{play}/feedback", json={"signal": signal}
        )
        same = self.answered[play] == signal
        assert answer.status_code == (200 if same else 409)

    @rule(user=USERS, item=ITEMS, signal=SIGNALS)
    def report(self, user: str, item: str, signal: str) -> None:
        answer = self.service.client.post(
            f"/v1/users/{self.named(user)}/plays", json={"item": item, "signal": signal}
        )
        assert answer.status_code in {201, 422}
        if answer.status_code == 201:
            self.closed[user] += 1
            assert answer.json()["slot"] == self.closed[user]
            if user in self.taken:
                self.passed.setdefault(user, set()).add(item)

    @rule(policy=POLICIES)
    def swap_policy(self, policy: str) -> None:
        self.service.set_policy(policy)

    @rule(items=st.lists(ITEMS, unique=True), broken=st.booleans())
    def import_items(self, items: list[str], *, broken: bool) -> None:
        lines = [json.dumps({"id": item, "model": "even"}) for item in items]
        lines += ["{"] if broken else []
        answer = self.service.client.post(
            "/v1/items/import",
            content="\n".join(lines),
            headers={"Content-Type": "application/x-ndjson"},
        )
        assert answer.status_code == (422 if broken else 200)

    @rule(chance=st.floats(0.1, 0.9), states=st.integers(2, 4))
    def replace_model(self, chance: float, states: int) -> None:
        others = [(1 - chance) / (states - 1)] * (states - 1)
        row = [chance, *others]
        self.service.put_model(
            "even",
            {
                "states": [f"state-{number}" for number in range(states)],
                "play": [row] * states,
                "rest": [row[::-1]] * states,
                "like": [(number + 1) / (states + 1) for number in range(states)],
                "prior": row,
            },
        )

    @rule(item=st.sampled_from(["song-1", "song-2"]))
    def retire(self, item: str) -> None:
        assert self.service.client.delete(f"/v1/items/{item}").status_code == 204

    @rule(user=USERS)
    def erase(self, user: str) -> None:
        answer = self.service.client.delete(f"/v1/users/{self.named(user)}")
        known = self.closed[user] > 0 or user in self.pending
        assert answer.status_code == (204 if known else 404)
        self.closed[user] = 0
        self.forget(user)
        self.answered.clear()

    @invariant()
    def slot_is_the_number_of_slots_that_were_played(self) -> None:
        for user in self.closed:
            assert self.service.beliefs(self.named(user))["slot"] == self.closed[user]

    def teardown(self) -> None:
        assert [one.findings for one in audit(self.service) if one.findings] == []

    def named(self, user: str) -> str:
        return f"{self.run}-{user}"


def test_any_sequence_of_requests_keeps_the_invariants(service: Service) -> None:
    class OnThisService(Listening):
        pass

    OnThisService.service = service
    run_state_machine_as_test(
        OnThisService,
        settings=settings(
            max_examples=12,
            stateful_step_count=40,
            deadline=None,
            derandomize=True,
            suppress_health_check=list(HealthCheck),
        ),
    )
