"""Both databases, migrated; a service on each."""

import fcntl
import itertools
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.settings import Settings
from app.storage import migrate
from policies import warm_up
from tests.app.commands import Encore, encore_in
from tests.app.postgres import Server
from tests.app.service import Service, settings_of
from tests.catalogues import load, paper_example

NUMBERS = itertools.count()


@pytest.fixture(scope="session", autouse=True)
def _compiled() -> None:
    """Compile before the first service starts: its clients do not wait for ever.

    One worker does so, and the others take it from the cache.
    """
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        warm_up()


@pytest.fixture(scope="session")
def postgres() -> Iterator[Server]:
    server = Server()
    try:
        server.execute("CREATE DATABASE template_encore")
        migrate.upgrade(
            Settings(database_url=server.url("template_encore")).database_url
        )
        yield server
    finally:
        server.stop()


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sqlite") / "template.db"
    migrate.upgrade(f"sqlite:///{path}")
    return path


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest) -> str:
    """An empty, migrated database of each kind."""
    name = "sqlite_url" if request.param == "sqlite" else "postgres_url"
    url: str = request.getfixturevalue(name)
    return url


@pytest.fixture
def sqlite_url(sqlite_template: Path, tmp_path: Path) -> str:
    path = tmp_path / "encore.db"
    shutil.copy(sqlite_template, path)
    return f"sqlite:///{path}"


@pytest.fixture
def postgres_url(postgres: Server) -> Iterator[str]:
    name = f"encore_{next(NUMBERS)}"
    postgres.execute(
        f"CREATE DATABASE {name} TEMPLATE template_encore STRATEGY file_copy"
    )
    yield postgres.url(name)
    postgres.execute(f"DROP DATABASE {name} WITH (FORCE)")


@pytest.fixture
def settings(database_url: str) -> Settings:
    return settings_of(database_url)


@pytest.fixture
def service(settings: Settings) -> Iterator[Service]:
    """A service with an empty catalogue."""
    running = Service.start(settings)
    yield running
    running.stop()


@pytest.fixture
def example(service: Service) -> Service:
    """A service with the catalogue of the paper's example 2 and the myopic policy."""
    load(service.client, paper_example(2))
    service.set_policy("myopic")
    return service


@pytest.fixture
def encore(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Encore:
    """The command line, within this process."""
    return encore_in(monkeypatch, capsys)
