"""What requests cost one server, before one population."""

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from app.load.crew import Crew
from app.load.drive import Pace
from app.load.plan import Plan, Target
from app.load.tally import Step
from benchmarks.population import Population, Used
from benchmarks.throughput.servers import ENCORE, KEY, databases, served, swap

ASKED = 1_000  # users who ask, at most, from all over the table
WARMING = 1.0


@dataclass(frozen=True, slots=True)
class Cost:
    """Of a request, the import of the catalogue, and of a server that knows it."""

    next_ms: float
    feedback_ms: float
    cpu_us: float
    imported: Used
    started: float
    megabytes: float


def measured(kind: str, population: Population, seconds: float) -> Cost:
    """Fill a database, serve it, and ask for so long."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        (url,) = databases(kind, folder, stack, "encore")
        imported = population.fill(url, folder)["items"]
        server = stack.enter_context(served("encore", ENCORE, url))
        swap(server.port)
        crew = stack.enter_context(Crew(_plan(server.port, population.users), 1))
        crew.drive(Pace(None, WARMING), lambda *_: None)
        before = server.cpu()
        tally = crew.drive(Pace(None, seconds), lambda *_: None)
        if tally.faults or tally.failures:
            raise RuntimeError(f"{tally.shown}, {tally.failures}")
        return Cost(
            tally.latency[Step.NEXT].at(50),
            tally.latency[Step.FEEDBACK].at(50),
            (server.cpu() - before) / tally.answered * 1e6,
            imported,
            server.started,
            server.megabytes(),
        )


def _plan(port: int, users: int) -> Plan:
    names = [f"user-{number}" for number in range(0, users, max(1, users // ASKED))]
    target = Target.of(f"http://127.0.0.1:{port}")
    return Plan(target, KEY, names, 1, fresh=False)
