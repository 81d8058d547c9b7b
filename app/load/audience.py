"""Whose turn it is: who listens answers before long, then lets all others go first."""

from collections import deque
from collections.abc import Sequence

from app.load.listener import Listener
from app.load.tally import Step


class Audience:
    """Listeners who are not asking at the moment.

    listening: how many hold a play before one of them answers
    """

    def __init__(self, listeners: Sequence[Listener], listening: int) -> None:
        self._resting = deque(listeners)
        self._listening: deque[Listener] = deque()
        self._most = listening

    def call(self) -> Listener:
        """The one to ask now; there must be one."""
        if len(self._listening) > self._most or not self._resting:
            return self._listening.popleft()
        return self._resting.popleft()

    def dismiss(self, listener: Listener) -> None:
        """Take back one who was answered, or was not."""
        rests = listener.step is Step.NEXT
        (self._resting if rests else self._listening).append(listener)
