"""What the service has kept of a listener's answers, beside what it acknowledged."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any
from urllib.parse import urlencode

from app.load.listener import CHANGED, DOUBLED, LOST_ANSWER, Listener, Taken
from app.load.plan import path_of
from app.load.tally import Fault

PAGE = 1000


class History:
    """A listener's closed plays, read back page by page, the latest first."""

    def __init__(self, listener: Listener) -> None:
        self.listener = listener
        self.read: list[Taken] = []
        self._cursor: str | None = None

    def path(self) -> str:
        """Of the page to read now."""
        cursor = {} if self._cursor is None else {"cursor": self._cursor}
        query = urlencode({"limit": PAGE} | cursor)
        return f"{path_of(self.listener.name)}/plays?{query}"

    def hear(self, body: bytes) -> bool:
        """Take a page; tell whether another one follows that matters."""
        told = json.loads(body)
        base = self.listener.base or 0
        page = [_taken(play) for play in told["plays"]]
        self.read += [taken for taken in page if taken.slot >= base]
        self._cursor = told["next"]
        return self._cursor is not None and all(taken.slot >= base for taken in page)

    def faults(self) -> Iterator[Fault]:
        """Where it is not what was acknowledged."""
        listener = self.listener
        times = Counter(taken.play for taken in self.read)
        kept = {taken.play: taken for taken in self.read}
        for taken in listener.taken:
            found = kept.pop(taken.play, None)
            if found is None:
                yield _fault(listener, LOST_ANSWER, taken, "acknowledged, not kept")
            elif found != taken:
                yield _fault(listener, CHANGED, taken, f"kept is {found}")
        unsettled = listener.unsettled()
        if unsettled is not None:
            kept.pop(unsettled.play, None)
        for taken in kept.values():
            yield _fault(listener, DOUBLED, taken, "kept, never acknowledged")
        for play, count in times.items():
            if count > 1:
                detail = f"{play} is kept {count} times"
                yield Fault(DOUBLED, listener.name, detail)


def _taken(play: Mapping[str, Any]) -> Taken:
    return Taken(play["play"], play["item"], play["signal"], play["slot"])


def _fault(listener: Listener, code: str, taken: Taken, what: str) -> Fault:
    return Fault(code, listener.name, f"{taken}: {what}")
