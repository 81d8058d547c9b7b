"""Work on a cluster of two processes: the same numbers, whatever dies."""

import os
import signal
import socket
import threading
from collections.abc import Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
from distributed import LocalCluster

from learning.cluster import Cluster, NoCluster, cluster
from learning.em import Effort
from learning.fitting import Recipe, fit
from learning.maximization import Smoothing
from learning.resampling import intervals
from learning.streams import PARTS, Streams, streams
from tests.learning.logs import chain, sampled

REWARD = np.array([0.0, 1.0])


@pytest.fixture(scope="module")
def machines() -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0"
    ) as found:
        yield found


@pytest.fixture
def spread(machines: LocalCluster) -> Iterator[Cluster]:
    with cluster(machines.scheduler_address) as found:
        yield found


def test_a_cluster_learns_what_one_process_does_to_the_bit(spread: Cluster) -> None:
    plays = sampled([chain(1), chain(2)], np.random.default_rng(3), 60, 60, 6)
    recipe = Recipe(states=3, types=2, effort=Effort(starts=2, steps=12))
    seen = streams(plays)

    alone, beside = (fit(plays, recipe, each) for each in (map, spread))
    sure, as_sure = (
        intervals(seen, alone.whole, REWARD, Smoothing(), draws=3, spread=each)
        for each in (map, spread)
    )

    assert alone.whole.risen == beside.whole.risen
    assert alone.types.risen == beside.types.risen
    assert (alone.types.belongs == beside.types.belongs).all()
    for one, other in zip(alone.types.chains, beside.types.chains, strict=True):
        assert (one.play == other.play).all()
        assert (one.rest == other.rest).all()
        assert (one.observe == other.observe).all()
    assert (sure.low.play == as_sure.low.play).all()
    assert (sure.high.observe == as_sure.high.observe).all()
    assert len(spread._held) == PARTS  # the same plays are sent once for all of it


def plays_in(streams: Streams, doomed: int) -> tuple[int, int]:
    """Where it is done, and how much of it there is; who is doomed, dies of it once."""
    if os.getpid() == doomed:
        os.kill(doomed, signal.SIGKILL)
    return os.getpid(), len(streams.row)


def test_what_a_worker_held_that_died_is_sent_to_others(spread: Cluster) -> None:
    seen = streams(sampled([chain(1)], np.random.default_rng(4), 40, 20, 3))
    parts = seen.parts()
    before = spread(partial(plays_in, doomed=0), parts)
    doomed = before[0][0]

    after = spread(partial(plays_in, doomed=doomed), parts)

    assert [plays for _, plays in after] == [len(part.row) for part in parts]
    assert doomed not in {place for place, _ in after}


def test_a_cluster_without_workers_is_told() -> None:
    with (
        LocalCluster(n_workers=0, dashboard_address=":0") as machines,
        pytest.raises(NoCluster, match="no workers"),
        cluster(machines.scheduler_address),
    ):
        pass


class Silent(BaseHTTPRequestHandler):
    """Whatever is said, it says nothing that a scheduler would."""

    def log_message(self, *_words: object) -> None:
        pass


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("nonsense", "missing port"),
        ("ftp://host:8786", "unknown address scheme 'ftp'"),
        ("tcp://127.0.0.1:{free}", "Timed out trying to connect"),
        ("tcp://127.0.0.1:{other}", "no answer in"),
    ],
)
def test_an_address_at_which_there_is_no_scheduler_is_told(
    address: str, message: str
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as port:
        free = port.getsockname()[1]
    server = HTTPServer(("127.0.0.1", 0), Silent)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with (
            pytest.raises(NoCluster, match=message),
            cluster(address.format(free=free, other=server.server_port)),
        ):
            pass
    finally:
        server.shutdown()
        server.server_close()
