"""The nouns of the service, as plain frozen data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from uuid import UUID

SKIP = "skip"  # the signals of a model that names none of its own
LIKE = "like"
NO_ANSWER = "none"  # it was played, and never answered; no model names a signal so
GUARD = "guard"  # puts policies in force, too, as if it were a key
HOLDOUT = "holdout"  # users whom an experiment leaves alone, as if they were an arm


class Source(StrEnum):
    """Who chose a play: the service, or the user alone."""

    RECOMMENDED = "recommended"
    REPORTED = "reported"


class Scope(StrEnum):
    """What a key allows: to serve listeners, or also to administer."""

    SERVE = "serve"
    ADMIN = "admin"


class Precision(StrEnum):
    """How fine an index table is: made at once, or as fine as it gets."""

    ROUGH = "rough"
    FULL = "full"


@dataclass(frozen=True, slots=True)
class Clock:
    """What slots follow besides plays: a slot may last no longer than so.

    version: counts how often it was set or stopped
    slot_s:  seconds of a slot, None: slots are counted by plays alone
    """

    version: int = 0
    slot_s: float | None = None


@dataclass(frozen=True, slots=True)
class Revision:
    """Which catalogue, policy, experiment and clock are in force.

    catalogue: counts every change of an item, a model or an index table
    epoch:     the catalogue in which a belief was last given a new meaning: beliefs
               of an earlier epoch must be rebuilt from the log of plays
    policy:    version of the policy in force
    experiment: counts every start, change and end of an experiment
    """

    catalogue: int
    epoch: int
    policy: int
    clock: Clock = Clock()
    experiment: int = 0


@dataclass(frozen=True, slots=True)
class ItemSignals:
    """What a play may tell, where that is more than a skip or a like.

    names:     the signals
    observe:   chance of each of them, by state
    reward:    worth of each
    fractions: least share played that means a signal, None: no share means any
    """

    names: Sequence[str]
    observe: Sequence[Sequence[float]]
    reward: Sequence[float]
    fractions: Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True)
class MoodRule:
    """How a user's last answers make a mood: see `policies.Mood`."""

    answers: int
    memory: float | None
    levels: Sequence[float]
    pause_s: float | None


@dataclass(frozen=True, slots=True)
class ItemMood:
    """What the user's mood makes of a model.

    like:    expected reward by mood and state, None: there are signals
    observe: chance of each signal by mood and state, None: there are none
    shares:  how often each mood is met, None: all alike
    """

    rule: MoodRule
    like: Sequence[Sequence[float]] | None = None
    observe: Sequence[Sequence[Sequence[float]]] | None = None
    shares: Sequence[float] | None = None


@dataclass(frozen=True, slots=True)
class ItemSample:
    """What a model may be as well as not: a draw from what a log leaves open.

    like:    chance of a like by state, or by mood and state; None: there are signals
    observe: chance of each signal, the same; None: there are none
    """

    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    prior: Sequence[float]
    like: Sequence[float] | Sequence[Sequence[float]] | None = None
    observe: Sequence[Sequence[float]] | Sequence[Sequence[Sequence[float]]] | None = (
        None
    )


@dataclass(frozen=True, slots=True)
class ItemModel:
    """One version of a model: how interest in its items moves and answers.

    like:    expected reward of a play, by state: without signals, chance of a like
    signals: None: a skip and a like
    mood:    None: it is answered alike in all moods. Else `like` and the chances of
             signals are the means over moods
    samples: if there are any, they are what counts, all alike at first
    """

    id: str
    version: int
    states: Sequence[str]
    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    like: Sequence[float]
    prior: Sequence[float]
    source: str
    created_at: datetime
    catalogue: int
    retired: bool = False
    signals: ItemSignals | None = None
    mood: ItemMood | None = None
    samples: Sequence[ItemSample] | None = None

    @property
    def chains(self) -> int:
        """How many it is: as many as it has samples, else one."""
        return len(self.samples or (self,))

    @property
    def answers(self) -> Sequence[str]:
        """Names of its signals, in order."""
        return (SKIP, LIKE) if self.signals is None else self.signals.names

    @property
    def rewards(self) -> Mapping[str, float]:
        """What each of its signals is worth."""
        worth = (0.0, 1.0) if self.signals is None else self.signals.reward
        return dict(zip(self.answers, worth, strict=True))


@dataclass(frozen=True, slots=True)
class Publication:
    """Models that went live together, and items that went to them.

    number:    counts publications, from 1
    catalogue: in which they went live
    digest:    of the candidate
    models:    version of each model that changed, by id
    items:     how many went to another model
    verdict:   what the gate found
    undone_at: when it was taken back, None: it was not
    """

    number: int
    catalogue: int
    digest: str
    models: Mapping[str, int]
    items: int
    verdict: Mapping[str, object]
    note: str
    at: datetime
    by: str
    undone_at: datetime | None = None
    undone_by: str | None = None


@dataclass(frozen=True, slots=True)
class Item:
    """Something that can be played. `serial` counts items in order of arrival."""

    serial: int
    id: str
    model: str
    title: str
    tags: Sequence[str]
    payload: Mapping[str, object]
    active: bool
    catalogue: int
    created_at: datetime
    updated_at: datetime


@dataclass(frozen=True, slots=True)
class Selection:
    """Which items a choice is made from: all of the tags, any of the candidates."""

    tags: tuple[str, ...] = ()
    candidates: tuple[str, ...] | None = None
    excluded: tuple[str, ...] = ()

    @property
    def is_everything(self) -> bool:
        return not self.tags and self.candidates is None and not self.excluded


EVERYTHING = Selection()


@dataclass(frozen=True, slots=True)
class Play:
    """One showing of one item to one user, and its answer.

    slot:      the user's slot when it was decided
    closed:    the slot in which it took place, None while it is unanswered
    policy:    version of the policy that chose it, None where the user did
    rung:      of that policy, None where the user did; 0: the policy itself
    experiment: version of the experiment that made it that policy, None: none did
    arm:       of the experiment
    catalogue: the catalogue in which it was chosen
    predicted: expected reward that was believed: with skip and like, chance of a like
    propensity: chance with which the policy chose this item
    slate:     the first of the plays that were chosen with it for one slot, or itself
    place:     its number among them, from 0
    """

    id: UUID
    slate: UUID
    user: str
    item: int
    slot: int
    source: Source
    catalogue: int
    model: str
    model_version: int
    predicted: float
    created_at: datetime
    place: int = 0
    closed: int | None = None
    policy: int | None = None
    seed: int | None = None
    selection: Selection = EVERYTHING
    propensity: float | None = None
    signal: str | None = None
    fraction: float | None = None
    answered_at: datetime | None = None
    idempotency_key: str | None = None
    experiment: int | None = None
    arm: str | None = None
    rung: int | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """A signal, and the share of the item that was played where that is known."""

    signal: str
    fraction: float | None = None


@dataclass(frozen=True, slots=True)
class Reply:
    """What a client tells of a play: a signal, else the share that was played.

    liked_from: share that is a like where skip and like are all there is to tell
    """

    signal: str | None
    fraction: float | None
    liked_from: float


@dataclass(frozen=True, slots=True)
class Report:
    """A play that a user chose alone; the key makes a report that is sent again one."""

    item: str
    reply: Reply
    key: str | None = None


@dataclass(frozen=True, slots=True)
class Slate:
    """Plays that were chosen for one slot, often only one, and wait for answers.

    waiting: by place, at least one
    taken:   the slot that the first answer took for all of them, None before it
    """

    waiting: tuple[Play, ...]
    taken: int | None = None

    @property
    def since(self) -> datetime:
        return self.waiting[0].created_at

    def slot(self, present: int) -> int:
        """The slot in which its plays take place, if the next is closed at present."""
        return present if self.taken is None else self.taken

    def without(self, play: Play, slot: int) -> "Slate | None":
        """What still waits when one of its plays was closed in this slot."""
        waiting = tuple(one for one in self.waiting if one.id != play.id)
        return Slate(waiting, self.slot(slot)) if waiting else None


def settled(slot: int, pending: Slate | None) -> int:
    """The slot before which all is closed, for a user in this slot."""
    return slot if pending is None else pending.slot(slot)


@dataclass(frozen=True, slots=True)
class Anchor:
    """What ties the slots of a user to the time.

    clock: version of the clock that they follow, 0: none ever
    began: when their slot 0 began by it, in milliseconds since 1970
    """

    clock: int = 0
    began: int = 0


@dataclass(frozen=True, slots=True)
class User:
    """Where a user stands. A user never seen has version 0."""

    id: str
    slot: int = 0
    version: int = 0
    pending: Slate | None = None
    epoch: int = 0
    packed: bytes = b""
    anchor: Anchor = Anchor()

    @property
    def settled(self) -> int:
        return settled(self.slot, self.pending)


@dataclass(frozen=True, slots=True)
class Described:
    """A policy by its name and all of its parameters."""

    name: str
    params: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class PolicyVersion:
    """A policy that was put in force, for all users or those of an arm.

    restores:   the version a rollback went to
    experiment: version of the experiment that has it as an arm or a shadow, None: it
                was in force for all
    rungs:      what decides where it takes too long or fails, None: nobody said
    """

    version: int
    name: str
    params: Mapping[str, object]
    note: str
    activated_at: datetime
    by: str
    restores: int | None = None
    experiment: int | None = None
    rungs: Sequence[Described] | None = None

    @property
    def is_fallback(self) -> bool:
        """Whether the guard has put it in place of another."""
        return self.by == GUARD and self.restores is None


@dataclass(frozen=True, slots=True)
class Arm:
    """Users who are served by one policy.

    policy: its version; None: whichever is in force
    """

    name: str
    policy: int | None
    share: float


@dataclass(frozen=True, slots=True)
class Shadow:
    """A policy that decides, too, without being served. `sample`: share of plays."""

    name: str
    policy: int
    sample: float


@dataclass(frozen=True, slots=True)
class Experiment:
    """One version of an experiment.

    origin:  the version with which it began
    salt:    makes its split of users its own
    holdout: share of users who are in none of the arms
    control: the arm that others are compared with, None: there are no arms
    split:   how users are divided: the end of each range of slices, and whose it is
    policy:  version of the policy in force as it was put
    """

    version: int
    name: str
    origin: int
    salt: str
    arms: Sequence[Arm]
    holdout: float
    control: str | None
    split: Sequence[tuple[int, str]]
    shadows: Sequence[Shadow]
    policy: int
    note: str
    at: datetime
    by: str
    ended_at: datetime | None = None
    ended_by: str | None = None
    ended_note: str | None = None

    @property
    def policies(self) -> Sequence[int]:
        """Versions of the policies of its own, those of arms first."""
        arms = [arm.policy for arm in self.arms if arm.policy is not None]
        return [*arms, *(shadow.policy for shadow in self.shadows)]


@dataclass(frozen=True, slots=True)
class Key:
    """A key as it is kept: never the secret, only its SHA-256.

    expires_at: from then on it is none, None: it is one until it is revoked
    origins:    of pages that may use it
    """

    id: str
    digest: bytes = field(repr=False)
    scope: Scope
    name: str
    created_at: datetime
    revoked_at: datetime | None = None
    expires_at: datetime | None = None
    origins: tuple[str, ...] = ()
