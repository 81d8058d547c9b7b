"""What a fault has done: nothing lost, nothing doubled, and back by itself."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from tests.app.service import ADMIN, client_of
from tests.faults.listeners import Told


@dataclass
class Outcome:
    """Rounds of a fault, and what came of them.

    recovered: seconds until an answer was acknowledged again, by round
    lost:      acknowledged answers that are not in the history
    doubled:   plays in the history that nobody was told of
    """

    fault: str
    recovered: Sequence[float]
    acknowledged: int = 0
    lost: int = 0
    doubled: int = 0
    errors: Mapping[str, int] = field(default_factory=dict)
    wrong: Sequence[str] = ()
    audit: Sequence[Any] = ()

    def check(self) -> None:
        """Hold it to what is promised."""
        assert not self.wrong, self.wrong
        assert (self.lost, self.doubled) == (0, 0)
        assert not self.audit, self.audit
        assert self.acknowledged > 0


def outcome(
    fault: str,
    url: str,
    database_url: str,
    told: Told,
    recovered: Sequence[float],
    folder: Path | None = None,
) -> Outcome:
    """Compare what listeners were told with what the service holds."""
    found = Outcome(fault, recovered, len(told.answers), errors=told.errors)
    found.wrong = told.wrong
    with client_of(url, ADMIN) as client:
        for user in sorted({user for user, *_ in told.answers}):
            expected, held = told.of(user), history(client, user)
            found.lost += len(set(expected) - set(held))
            found.doubled += len(held) - len(set(expected) & set(held))
            if not set(expected) ^ set(held):
                assert held == list(expected), f"the plays of {user} changed places"
    found.audit = audited(database_url, folder)
    return found


def history(client: httpx.Client, user: str) -> list[tuple[str, str]]:
    """Closed plays of a user and their answers, the earliest first."""
    plays: list[tuple[str, str]] = []
    cursor: dict[str, str] = {}
    while True:
        query = {"limit": "1000", **cursor}
        page = client.get(f"/v1/users/{user}/plays", params=query)
        told = page.raise_for_status().json()
        plays += [(play["play"], play["signal"]) for play in told["plays"]]
        if told["next"] is None:
            return plays[::-1]
        cursor = {"cursor": told["next"]}


def audited(database_url: str, folder: Path | None = None) -> Sequence[Any]:
    """What an audit of all users finds; by the release of a folder, if not this."""
    done = subprocess.run(
        [sys.executable, "-m", "app.cli", "audit", "--json"],
        env=os.environ | {"ENCORE_DATABASE_URL": database_url},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    findings: Sequence[Any] = told["findings"]
    assert (done.returncode == 0) is not bool(findings)
    return findings
