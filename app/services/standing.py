"""Where a user stands in a unit of work, as answers come in and plays are chosen."""

import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial

from uuid_utils.compat import uuid7

from app.domain import Answer, Play, PolicyVersion, Selection, Source, User
from app.services import beliefs, decisions
from app.services.catalogue import Catalogue, Shelf
from app.services.decisions import Decision
from app.services.live import InForce
from app.services.pool import Pool
from app.storage import plays, users
from app.storage.packing import Entries, pack
from app.storage.store import Store
from policies import Answered

INLINE = 200.0  # microseconds; a longer decision is worth handing to a thread


@dataclass(frozen=True, slots=True)
class Offer:
    """A play that waits for its answer, and what a client shows of it.

    slot:     in which it will take place if it is answered next
    signals:  names of the answers that its model knows
    repeated: it was offered before and has not been answered
    took:     seconds that the decision took
    """

    play: Play
    shelf: Shelf
    slot: int
    policy: PolicyVersion
    signals: Sequence[str]
    repeated: bool
    took: float | None = None


@dataclass(slots=True)
class Standing:
    """A user's slot and beliefs, moving on within one unit of work."""

    store: Store
    catalogue: Catalogue
    user: User
    slot: int
    entries: Entries
    at: datetime

    @classmethod
    def of(
        cls, store: Store, catalogue: Catalogue, user: User, at: datetime
    ) -> "Standing":
        entries = beliefs.kept(store, catalogue, user)
        return cls(store, catalogue, user, user.slot, entries, at)

    def close(self, play: Play, answer: Answer) -> Answered:
        """Note the answer of a pending play."""
        plays.close(self.store, play, self.slot, answer, self.at)
        return self.learn(play.item, answer)

    def learn(self, serial: int, answer: Answer) -> Answered:
        """Move all beliefs on by one slot, in which this item was played."""
        self.entries, learned = beliefs.after_play(
            self.catalogue, self.entries, self.slot, serial, answer.signal
        )
        self.slot += 1
        return learned

    def choose(self, policy: InForce, pool: Pool, selection: Selection) -> Offer:
        """Choose a play and enter it as pending."""
        began = time.perf_counter()
        decision = self.decide(policy, pool, secrets.randbits(63))
        took = time.perf_counter() - began
        play = self._chosen(decision, policy, selection)
        plays.insert(self.store, play)
        shelf = self.catalogue.shelf(decision.serial)
        signals = self.catalogue.model_of(decision.serial).answers
        return Offer(
            play, shelf, self.slot, policy.version, signals, repeated=False, took=took
        )

    def decide(self, policy: InForce, pool: Pool, seed: int) -> Decision:
        """Decide, aside from other requests if that takes long."""
        now = beliefs.at(self.catalogue, self.entries, self.slot)
        candidates = decisions.candidates(self.catalogue, pool, now, policy.policy)
        work = partial(decisions.decide, candidates, policy.scorer, seed)
        if policy.policy.cost(candidates.situation) > INLINE:
            return self.store.aside(work)
        return work()

    def save(self, pending: Play | None) -> None:
        """Note the user's next standing."""
        pending_id = None if pending is None else pending.id
        users.move(
            self.store, self.user, slot=self.slot, pending=pending_id, at=self.at
        )
        if self.slot != self.user.slot or self.user.epoch != self.catalogue.epoch:
            users.keep_beliefs(
                self.store, self.user.id, self.catalogue.epoch, pack(self.entries)
            )

    def report(
        self, serial: int, answer: Answer, key: str | None, at: datetime | None = None
    ) -> Play:
        """Enter a play that the user chose alone; it took place now or at a moment."""
        belief, _ = beliefs.of_item(self.catalogue, self.entries, self.slot, serial)
        like = beliefs.expected(self.catalogue, serial, belief)
        at = at or self.at
        play = replace(
            self._play(serial, like),
            source=Source.REPORTED,
            closed=self.slot,
            signal=answer.signal,
            fraction=answer.fraction,
            created_at=at,
            answered_at=at,
            idempotency_key=key,
        )
        plays.insert(self.store, play)
        return play

    def _chosen(
        self, decision: Decision, policy: InForce, selection: Selection
    ) -> Play:
        return replace(
            self._play(decision.serial, decision.predicted),
            policy=policy.version.version,
            seed=decision.seed,
            selection=selection,
            propensity=decision.choice.propensity,
        )

    def _play(self, serial: int, predicted: float) -> Play:
        model = self.catalogue.model_of(serial)
        return Play(
            id=uuid7(),
            user=self.user.id,
            item=serial,
            slot=self.slot,
            source=Source.RECOMMENDED,
            catalogue=self.catalogue.version,
            model=model.id,
            model_version=model.version,
            predicted=predicted,
            created_at=self.at,
        )
