"""A listener who asks, answers, and holds the service to its word."""

import json
from collections.abc import Iterable, Iterator, Mapping
from random import Random
from typing import Any, NamedTuple

from app.load.plan import Plan, path_of
from app.load.tally import Fault, Step

LOST_ANSWER, LOST_PLAY = "lost_answer", "lost_play"
DOUBLED, CHANGED = "doubled_answer", "changed_answer"
WRONG_SLOT, WRONG_PLAY, MALFORMED = "wrong_slot", "wrong_play", "malformed_answer"

# What a service never has to say to who answers what was offered.
NEVER = {"play_not_found": LOST_PLAY, "feedback_conflict": CHANGED}


class Taken(NamedTuple):
    """An answer that the service has acknowledged, or may have taken."""

    play: str
    item: str
    signal: str
    slot: int


class Listener:
    """Asks for a play, answers it, asks for the next; says what is not as promised.

    taken: answers acknowledged, in order
    open:  the last answer was sent, and what came of it is not known
    """

    __slots__ = (
        "_draw",
        "_due",
        "_item",
        "_path",
        "_plan",
        "_play",
        "_play_open",
        "_signal",
        "_signals",
        "_slot",
        "base",
        "name",
        "open",
        "step",
        "taken",
    )

    def __init__(self, plan: Plan, name: str, draw: Random) -> None:
        self.name = name
        self.step = Step.NEXT
        self.base: int | None = 0 if plan.fresh else None
        self.taken: list[Taken] = []
        self.open = False
        self._plan = plan
        self._draw = draw
        self._path = path_of(name)
        self._due = self.base
        self._play = self._item = self._signal = ""
        self._signals: list[str] = []
        self._slot = 0
        self._play_open = not plan.fresh

    def request(self) -> bytes:
        """What to send now."""
        if self.step in {Step.NEXT, Step.NEXT_AGAIN}:
            return self._plan.request("GET", f"{self._path}/next")
        if self.step is Step.FEEDBACK and not self.open:
            self._signal = self._draw.choice(self._signals)
        body = json.dumps({"signal": self._signal})
        return self._plan.request("POST", f"/v1/plays/{self._play}/feedback", body)

    def miss(self, code: str = "") -> Iterable[Fault]:
        """No answer came, or an error: whether it was done is not known."""
        if self.step is Step.NEXT:
            self._play_open = True
        elif self.step in {Step.FEEDBACK, Step.FEEDBACK_AGAIN} and code in NEVER:
            play, self.step = self._play, Step.NEXT
            self.open, self._due, self._play_open = False, None, True
            return [self._fault(NEVER[code], f"{play}: {code}")]
        elif self.step is Step.FEEDBACK:
            self.open = True
        return []

    def hear(self, body: bytes) -> Iterable[Fault]:
        """Take what was asked for, and tell what is wrong with it."""
        told = _read(body)
        try:
            match self.step:
                case Step.NEXT:
                    return [*self._offered(told)]
                case Step.NEXT_AGAIN:
                    return [*self._offered_again(told)]
                case Step.FEEDBACK:
                    return [*self._acknowledged(told)]
                case _:
                    return [*self._acknowledged_again(told)]
        except (KeyError, TypeError, ValueError):
            detail = f"{self.step}: {body[:200]!r}"
            return [*self.miss(), self._fault(MALFORMED, detail)]

    def unsettled(self) -> Taken | None:
        """The answer of which it is not known whether it was taken."""
        if not self.open:
            return None
        return Taken(self._play, self._item, self._signal, self._slot)

    def _offered(self, told: Mapping[str, Any]) -> Iterator[Fault]:
        play, slot = str(told["play"]), int(told["slot"])
        if told["user"] != self.name:
            yield self._fault(WRONG_PLAY, f"{play} is of the user {told['user']}")
        if self.taken and play == self.taken[-1].play:
            yield self._fault(LOST_ANSWER, f"{play} was answered, and is offered again")
        yield from self._wrong_slot(slot)
        if told["pending"] and not self._play_open:
            yield self._fault(WRONG_PLAY, f"{play} is said to be offered before")
        if self.base is None:
            self.base = slot
        self._play, self._item, self._slot = play, str(told["item"]), slot
        self._signals = [str(signal) for signal in told["signals"]]
        self._play_open = False
        self.step = self._then(Step.NEXT_AGAIN, Step.FEEDBACK)

    def _offered_again(self, told: Mapping[str, Any]) -> Iterator[Fault]:
        if told["play"] != self._play:
            detail = f"{self._play} waits for its answer, offered is {told['play']}"
            yield self._fault(LOST_PLAY, detail)
            self._play, self._item = str(told["play"]), str(told["item"])
        self.step = Step.FEEDBACK

    def _acknowledged(self, told: Mapping[str, Any]) -> Iterator[Fault]:
        if told["repeated"] and not self.open:
            yield self._fault(DOUBLED, f"{self._play} is said to be answered before")
        yield from self._wrong_answer(told)
        self.open = False
        self._due = int(told["slot"])
        taken = Taken(self._play, self._item, self._signal, self._due - 1)
        self.taken.append(taken)
        self.step = self._then(Step.FEEDBACK_AGAIN, Step.NEXT)

    def _acknowledged_again(self, told: Mapping[str, Any]) -> Iterator[Fault]:
        if not told["repeated"]:
            yield self._fault(DOUBLED, f"{self._play} was taken a second time")
        yield from self._wrong_answer(told)
        self.step = Step.NEXT

    def _wrong_answer(self, told: Mapping[str, Any]) -> Iterator[Fault]:
        if told["play"] != self._play:
            detail = f"{self._play} was answered, acknowledged is {told['play']}"
            yield self._fault(WRONG_PLAY, detail)
        if told["signal"] != self._signal:
            detail = f"{self._play}: {told['signal']}, where {self._signal} was sent"
            yield self._fault(CHANGED, detail)
        slot = int(told["slot"])
        if slot != self._slot + 1:
            detail = f"{self._play} of slot {self._slot} is followed by slot {slot}"
            yield self._fault(WRONG_SLOT, detail)

    def _wrong_slot(self, slot: int) -> Iterator[Fault]:
        if self._due is None or slot == self._due:
            return
        if slot < self._due or not self._plan.clock:
            yield self._fault(WRONG_SLOT, f"slot {slot}, where {self._due} is due")

    def _then(self, again: Step, otherwise: Step) -> Step:
        return again if self._draw.random() < self._plan.repeats else otherwise

    def _fault(self, code: str, detail: str) -> Fault:
        return Fault(code, self.name, detail)


def _read(body: bytes) -> Mapping[str, Any]:
    try:
        told = json.loads(body)
    except ValueError:
        return {}
    return told if isinstance(told, dict) else {}
