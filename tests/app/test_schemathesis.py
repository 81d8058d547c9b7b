"""The service against its own document, with every check that schemathesis has."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from app.settings import Settings
from tests.app.service import ADMIN, Service

MODEL: dict[str, Any] = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.9],
    "prior": [0.5, 0.5],
}
ROOT = Path(__file__).parents[2]


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """A service that refuses to simulate what takes time: much is made up."""
    return settings.with_changes(simulation_budget="0.002")


def test_the_service_does_what_its_document_says(
    example: Service, tmp_path: Path
) -> None:
    example.put_model("pop", MODEL)
    example.put_item("ann", "pop")  # the ids that stand in the document's examples
    command = [
        *(sys.executable, "-m", "schemathesis.cli", "run"),
        f"{example.url}/openapi.json",
        *("--header", f"Authorization: Bearer {ADMIN}"),
        *("--checks", "all", "--exclude-checks", "positive_data_acceptance"),
        *("--max-examples", "10", "--seed", "20261122"),
        *("--generation-database", "none", "--continue-on-failure", "--no-color"),
    ]
    surroundings = os.environ | {
        "PYTHONPATH": str(ROOT),
        "SCHEMATHESIS_HOOKS": "tests.app.openapi_checks",
        "OWN_KEY": example.client.get("/v1/admin/keys").json()["keys"][0]["id"],
    }

    run = subprocess.run(
        command,
        check=False,
        cwd=tmp_path,
        env=surroundings,
        capture_output=True,
        text=True,
    )

    assert run.returncode == 0, run.stdout + run.stderr
    assert "API Operations" in run.stdout
    assert example.client.get("/v1/admin/policy").is_success
