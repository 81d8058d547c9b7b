"""What people who look cost: the operator's page, open many times.

python -m benchmarks.dashboards [--open 50] [--seconds 60]

Each page asks for what the browser's does, as often: the overview and the metrics,
every five seconds, over a connection of its own. The log holds as many plays as a look
takes.
"""

import argparse
import asyncio
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx

from app.services.overviews import MOST
from app.storage import migrate
from benchmarks.machine import describe
from benchmarks.population import HERE
from benchmarks.throughput.servers import ENCORE, KEY, Running, served
from tests.catalogues import load, paper_example

EVERY = 5.0  # seconds between two looks of a page, as in app/web/static/js/admin.js
PATHS = ("/v1/admin/overview?hours=1&buckets=24", "/metrics")
FILLED_AT = 400  # requests a second
HEADERS = {"Authorization": f"Bearer {KEY}"}


def main() -> None:
    arguments = _arguments()
    print(describe())
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'encore.db'}"
        migrate.upgrade(url)
        with served("encore", ENCORE, url) as server:
            address = f"http://127.0.0.1:{server.port}"
            _fill(address)
            alone = asyncio.run(_share(server, address, 0, arguments.seconds))
            looked = asyncio.run(
                _share(server, address, arguments.open, arguments.seconds)
            )
    print(f"share of a core, nobody looks: {alone:.3f}")
    print(f"share of a core, {arguments.open} pages open: {looked:.3f}")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--open", type=int, default=50, help="pages")
    parser.add_argument("--seconds", type=float, default=60)
    return parser.parse_args()


def _fill(address: str) -> None:
    with httpx.Client(base_url=address, headers=HEADERS) as client:
        load(client, paper_example(2))
    requests = 2 * MOST
    subprocess.run(
        [
            *(sys.executable, "-m", "app.cli", "bench", "--url", address),
            *("--key", KEY, "--rate", str(FILLED_AT), "--repeats", "0", "--keep"),
            *("--duration", str(requests / FILLED_AT)),
        ],
        check=True,
        cwd=HERE,
        stdout=subprocess.DEVNULL,
    )


async def _share(server: Running, address: str, pages: int, seconds: float) -> float:
    """Share of a core that the server works while so many pages are open."""
    async with asyncio.TaskGroup() as group:
        begun, cpu = time.monotonic(), server.cpu()
        for _ in range(pages):
            group.create_task(_look(address, begun + seconds))
        await asyncio.sleep(seconds)
        spent = server.cpu() - cpu
    return spent / seconds


async def _look(address: str, until: float) -> None:
    await asyncio.sleep(random.uniform(0, EVERY))  # noqa: S311 - when a page was opened
    async with httpx.AsyncClient(base_url=address, headers=HEADERS) as client:
        while time.monotonic() < until:
            answers = await asyncio.gather(*map(client.get, PATHS))
            for answer in answers:
                answer.raise_for_status()
            await asyncio.sleep(EVERY)


if __name__ == "__main__":
    main()
