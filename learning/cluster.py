"""Work spread over the machines of a Dask cluster.

What the work is about, parts of a log, goes to the workers once and stays there; with
each step only a chain goes out, and small counts come back. They come in the order of
the parts, so sums are what they are in one process.
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import TypeVar
from weakref import WeakKeyDictionary

from dask.base import tokenize
from distributed import Client, Future, KilledWorker
from distributed.comm.core import connect

T = TypeVar("T")
R = TypeVar("R")

PATIENCE_S = 3.0  # until a scheduler answers, and until there is a worker
TRIES = 5  # of work whose worker died


class NoCluster(Exception):
    """A cluster does not answer, or cannot do the work."""


class Cluster:
    """A way to spread work, for things that can be sent and are not changed."""

    def __init__(self, client: Client) -> None:
        """Hold nothing yet."""
        self._client = client
        self._names: WeakKeyDictionary[object, str] = WeakKeyDictionary()
        self._held: dict[str, Future[object]] = {}

    def __call__(self, work: Callable[[T], R], things: Iterable[T], /) -> Sequence[R]:
        """Return what the work gives, thing by thing, in their order.

        When a worker dies, what it held is sent again, to the others.

        Raises:
            NoCluster: workers die again and again, or none is left.
        """
        wanted = list(things)
        for _ in range(TRIES):
            try:
                done = self._client.map(work, self._sent(wanted), pure=False)
                found: Sequence[R] = self._client.gather(done)
            except (CancelledError, KilledWorker):
                self._forget()
            except OSError as error:
                raise NoCluster(f"its scheduler was lost: {error}") from error
            else:
                return found
        raise NoCluster(f"its workers died {TRIES} times")

    def _sent(self, things: Sequence[object]) -> Sequence[Future[object]]:
        """Return where things are held; send those that nobody holds."""
        names = [self._name(thing) for thing in things]
        missing = {
            name: thing
            for name, thing in zip(names, things, strict=True)
            if name not in self._held
        }
        if missing:
            _await_workers(self._client)
            sent = self._client.scatter([*missing.values()], hash=False)
            self._held.update(zip(missing, sent, strict=True))
        return [self._held[name] for name in names]

    def _name(self, thing: object) -> str:
        """Return a name by what is inside: the same plays are not sent again."""
        if thing not in self._names:
            self._names[thing] = tokenize(thing)
        return self._names[thing]

    def _forget(self) -> None:
        """Forget what died with its worker."""
        self._held = {
            name: held for name, held in self._held.items() if held.status == "finished"
        }


@contextmanager
def cluster(address: str) -> Iterator[Cluster]:
    """Yield the cluster of a scheduler.

    Args:
        address: of the scheduler, as `tcp://host:8786`.

    Raises:
        NoCluster: nothing answers there, or it has no worker that knows `learning`.
    """
    try:
        asyncio.run(_probe(address))
    except Exception as error:  # whatever a peer that is no scheduler leads to
        raise NoCluster(str(error) or f"no answer in {PATIENCE_S:g} s") from error
    with Client(address, timeout=PATIENCE_S, set_as_default=False) as client:
        _await_workers(client)
        try:
            client.run(_known)
        except ModuleNotFoundError as error:
            raise NoCluster(f"its workers lack {error.name}") from error
        yield Cluster(client)


async def _probe(address: str) -> None:
    """Connect once: a client would wait for ever for a peer that says nothing."""
    async with asyncio.timeout(PATIENCE_S + 1):
        peer = await connect(address, timeout=PATIENCE_S)
        await peer.close()


def _await_workers(client: Client) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError as error:
        raise NoCluster("it has no workers") from error


def _known() -> None:
    """Be found, by who has this module."""
