"""Listeners who do not give up, and remember what they were told."""

import random
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import cycle
from typing import Any

import httpx

from tests.app.service import ADMIN

PATIENCE = 120.0  # seconds for which one request is tried again
PAUSE = 0.05


class GaveUp(Exception):
    """A listener was never answered, or answered what must not be."""


@dataclass
class Told:
    """What listeners were told, all of them together.

    answers: (user, play, signal) as acknowledged, in each user's order
    errors:  how often which status or broken connection was met
    wrong:   answers that must not be
    last:    when something was last acknowledged
    """

    answers: list[tuple[str, str, str]] = field(default_factory=list)
    errors: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    last: float = 0.0

    def of(self, user: str) -> Sequence[tuple[str, str]]:
        return [(play, signal) for who, play, signal in self.answers if who == user]

    def recovered(self, since: float) -> float:
        """Wait until something is acknowledged again; tell how long that took."""
        end = time.monotonic() + PATIENCE
        while self.last <= since:
            if time.monotonic() > end:
                raise GaveUp("nothing was acknowledged any more")
            time.sleep(0.005)
        return self.last - since


@contextmanager
def listening(urls: Sequence[str], users: int) -> Iterator[Told]:
    """Users who play and answer all the while; what is open at the end is finished.

    Each request goes to another one of some services.
    """
    told, done = Told(), threading.Event()
    threads = [
        threading.Thread(target=_listen, args=(urls, f"user-{number}", told, done))
        for number in range(users)
    ]
    for thread in threads:
        thread.start()
    try:
        yield told
    finally:
        done.set()
        for thread in threads:
            thread.join()


def _listen(urls: Sequence[str], user: str, told: Told, done: threading.Event) -> None:
    luck = random.Random(user)  # noqa: S311 - a listener
    headers = {"Authorization": f"Bearer {ADMIN}"}
    try:
        with httpx.Client(headers=headers, timeout=30) as client:
            ask = partial(_asked, client, told, cycle(urls))
            while not done.is_set():
                play = ask("GET", f"/v1/users/{user}/next")["play"]
                signal = luck.choice(("like", "skip"))
                path = f"/v1/plays/{play}/feedback"
                heard = ask("POST", path, {"signal": signal})
                if heard["signal"] != signal:
                    told.wrong.append(f"{play}: {signal}, not {heard['signal']}")
                told.answers.append((user, play, signal))
                told.last = time.monotonic()
    except GaveUp as error:
        told.wrong.append(str(error))


def _asked(
    client: httpx.Client,
    told: Told,
    urls: Iterator[str],
    method: str,
    path: str,
    body: Mapping[str, str] | None = None,
) -> Any:  # noqa: ANN401 - whatever JSON says
    """An answer, however often it takes to ask."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            answer = client.request(method, next(urls) + path, json=body)
        except httpx.TransportError as error:
            told.errors[type(error).__name__] += 1
        else:
            if answer.is_success:
                return answer.json()
            told.errors[f"{answer.status_code} {answer.json()['code']}"] += 1
            if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                raise GaveUp(f"{method} {path}: {answer.text}")
            if not int(answer.headers.get("Retry-After", 0)):
                raise GaveUp(f"{method} {path}: 503 without Retry-After")
        time.sleep(PAUSE)
    raise GaveUp(f"{method} {path}: no answer in {PATIENCE:g} s")
