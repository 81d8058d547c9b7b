"""Where a user stands in a unit of work, as answers come in and plays are chosen."""

import secrets
import time
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from operator import attrgetter
from uuid import UUID

from uuid_utils.compat import uuid7

from app import tracing
from app.domain import (
    Anchor,
    Answer,
    Clock,
    Play,
    Selection,
    Slate,
    Source,
    User,
    settled,
)
from app.services import beliefs, clocks, decisions, ladder, moods
from app.services.allotment import Allotted
from app.services.catalogue import Catalogue
from app.services.in_force import InForce
from app.services.ladder import Decided
from app.services.offers import Offer
from app.services.pool import Pool
from app.services.shade import Considered
from app.storage import plays, users
from app.storage.packing import Entries, Felt, pack
from app.storage.plays import ClosedPlay
from app.storage.store import Store
from policies import Answered


@dataclass(slots=True)
class Standing:
    """A user's slot, beliefs and pending plays, moving on within one unit of work."""

    store: Store
    catalogue: Catalogue
    user: User
    slot: int
    entries: Entries
    pending: Slate | None
    at: datetime
    anchor: Anchor
    learned: bool = False
    closed: list[ClosedPlay] = field(default_factory=list)

    @classmethod
    def of(
        cls, store: Store, catalogue: Catalogue, user: User, at: datetime
    ) -> "Standing":
        entries = beliefs.kept(store, catalogue, user)
        pending, anchor = user.pending, user.anchor
        return cls(store, catalogue, user, user.slot, entries, pending, at, anchor)

    def keep_time(self, clock: Clock, at: datetime | None = None) -> None:
        """Move on to the slot that a clock shows, now or at an earlier moment."""
        if clock.slot_s is None:
            return
        at = min(at or self.at, self.at)
        if self.anchor.clock != clock.version:
            self.anchor = clocks.anchored(self.store, self.user, self.slot, at, clock)
        self.slot = max(self.slot, clocks.slot_at(clock, self.anchor, at))

    def close(self, play: Play, answer: Answer) -> tuple[int, Answered]:
        """Note the answer of a pending play; tell in which slot it took place."""
        slot = self.take_place(play)
        plays.close(self.store, play, slot, answer, self.at)
        return slot, self.learn(play, slot, answer)

    def take_place(self, play: Play) -> int:
        """Give a pending play its slot: that of its slate, if it is not too late."""
        if self.pending is None:
            return self.slot
        slot = self._shared(self.pending.slot(self.slot), play.item)
        self.pending = self.pending.without(play, slot)
        return slot

    def learn(self, play: Play, slot: int, answer: Answer) -> Answered:
        """Learn the answer to a play that took place in a slot, at the latest now."""
        item, signal = play.item, answer.signal
        return self.take(ClosedPlay(item, slot, signal, play.place, play.created_at))

    def take(self, play: ClosedPlay) -> Answered:
        """Learn from a play that took place, or might."""
        late = moods.comes_late(self.catalogue, self.entries.felt, play)
        self.entries, learned = beliefs.after_play(self.catalogue, self.entries, play)
        self.slot = max(self.slot, play.slot + 1)
        self.learned = True
        self.closed.append(play)
        if late:
            self._rebuild()
        return learned

    def felt(self, slot: int | None = None, at: datetime | None = None) -> Felt | None:
        """The user's mood in a slot that begins at a moment; if none is given, now."""
        slot = self.slot if slot is None else slot
        return moods.begun(self.catalogue, self.entries.felt, slot, at or self.at)

    def expected(self, serial: int, slot: int, at: datetime | None = None) -> float:
        """The reward expected of an item in such a slot."""
        belief, _ = beliefs.of_item(self.catalogue, self.entries, slot, serial)
        mood = moods.class_of(self.catalogue.models, self.felt(slot, at))
        return beliefs.expected(self.catalogue, serial, belief, mood)

    def choose(
        self, allotted: Allotted, pool: Pool, selection: Selection, count: int
    ) -> Offer:
        """Choose plays for one slot, if there are as many, and enter them as pending.

        Nothing else may be pending any more.
        """
        began = time.perf_counter()
        decided = self.decide(allotted.policy, pool, secrets.randbits(63), count)
        took = time.perf_counter() - began
        tracing.note(
            "decision", began, **{"encore.policy": allotted.policy.version.name}
        )
        chosen = self._chosen(decided, allotted, selection)
        for play in chosen:
            plays.insert(self.store, play)
        self.pending = Slate(chosen)
        offer = Offer.of(
            self.catalogue, self.pending, self.slot, allotted.policy.version
        )
        considered = self._considered(decided, allotted)
        return replace(offer, took=took, decided=decided, considered=considered)

    def decide(self, policy: InForce, pool: Pool, seed: int, count: int = 1) -> Decided:
        """Decide within the time that there is, aside from others if it is long."""
        now, felt = beliefs.at(self.catalogue, self.entries, self.slot), self.felt()
        build = partial(decisions.candidates, self.catalogue, pool, now, felt=felt)
        return ladder.decide(
            self.store, policy.rungs, build, seed, count, policy.budget
        )

    def save(self) -> None:
        """Note the user's next standing."""
        users.move(
            self.store,
            self.user,
            slot=self.slot,
            pending=self.pending,
            at=self.at,
            anchor=self.anchor,
        )
        changed = self.learned or self.user.epoch != self.catalogue.epoch
        if changed or self.slot > self.user.slot:
            held = len(self.entries.serial)
            self.forget()
            changed = changed or len(self.entries.serial) < held
        if changed:
            users.keep_beliefs(
                self.store, self.user.id, self.catalogue.epoch, pack(self.entries)
            )

    def forget(self) -> None:
        """Drop what need not be kept."""
        self.entries = beliefs.without_forgotten(
            self.catalogue, self.entries, settled(self.slot, self.pending)
        )

    def report(
        self,
        serial: int,
        answer: Answer,
        key: str | None,
        at: datetime | None = None,
        beside: Play | None = None,
    ) -> Play:
        """Enter a play that the user chose alone; it took place now or at a moment.

        beside: in the slot of another play
        """
        slot = self.slot if beside is None else self._shared(beside.slot, serial)
        at = at or self.at
        like = self.expected(serial, slot, at)
        play = replace(
            self._play(uuid7(), serial, slot, like),
            source=Source.REPORTED,
            closed=slot,
            signal=answer.signal,
            fraction=answer.fraction,
            created_at=at,
            answered_at=at,
            idempotency_key=key,
        )
        if beside is not None and slot == beside.slot:
            play = replace(play, slate=beside.slate, place=beside.place + 1)
        plays.insert(self.store, play)
        return play

    def _considered(self, decided: Decided, allotted: Allotted) -> Considered | None:
        """What shadows may decide, too; None if there are none."""
        experiment = allotted.experiment
        if experiment is None or not experiment.shadows:
            return None
        return Considered(
            experiment,
            self.catalogue,
            self.user.id,
            decided.build,
            len(decided.made),
            decided.made[0],
        )

    def _rebuild(self) -> None:
        """Believe anew: an answer came late, and the mood of later plays is another."""
        log = [*plays.closed(self.store, self.user.id), *self.closed]
        log.sort(key=attrgetter("slot", "place"))
        due = settled(self.slot, self.pending)
        build = partial(beliefs.rebuilt, self.catalogue, log, due)
        self.entries = self.store.aside(build)

    def _chosen(
        self, decided: Decided, allotted: Allotted, selection: Selection
    ) -> tuple[Play, ...]:
        ids = [uuid7() for _ in decided.made]
        experiment = allotted.experiment
        return tuple(
            replace(
                self._play(ids[place], decision.serial, self.slot, decision.predicted),
                slate=ids[0],
                place=place,
                policy=allotted.policy.version.version,
                rung=decided.rung,
                experiment=None if experiment is None else experiment.version,
                arm=allotted.arm,
                seed=decision.seed,
                selection=selection,
                propensity=decision.choice.propensity,
            )
            for place, decision in enumerate(decided.made)
        )

    def _shared(self, slot: int, serial: int) -> int:
        """A slot to share, or the present one if the item was played since."""
        if slot < self.slot and beliefs.has_passed(self.entries, slot, serial):
            return self.slot
        return slot

    def _play(self, play_id: UUID, serial: int, slot: int, predicted: float) -> Play:
        model = self.catalogue.model_of(serial)
        return Play(
            id=play_id,
            slate=play_id,
            user=self.user.id,
            item=serial,
            slot=slot,
            source=Source.RECOMMENDED,
            catalogue=self.catalogue.version,
            model=model.id,
            model_version=model.version,
            predicted=predicted,
            created_at=self.at,
        )
