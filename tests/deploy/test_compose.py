"""compose.yaml: what it names is there, and nothing of it is open or secret."""

import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from app.settings import Settings
from tests.deploy.tools import DEPLOY, ROOT, passes

COMPOSE = yaml.safe_load((ROOT / "compose.yaml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = ("encore", "migrate")


def test_it_is_what_compose_reads() -> None:
    passes(
        "check-jsonschema",
        *("--builtin-schema", "vendor.compose-spec", ROOT / "compose.yaml"),
    )


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_can_do_no_more_than_it_must(name: str) -> None:
    service = SERVICES[name]

    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert name == "postgres" or "cap_add" not in service
    assert "privileged" not in service
    assert ":latest" not in service["image"]
    assert ":" in service["image"] or name in OURS
    assert service["logging"]["options"]["max-size"]


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_tells_whether_it_is_well(name: str) -> None:
    own = "HEALTHCHECK" in (ROOT / "Dockerfile").read_text()
    assert "healthcheck" in SERVICES[name] or (name in OURS and own)


def test_ports_are_open_to_this_machine_alone() -> None:
    for service in SERVICES.values():
        for port in service.get("ports", ()):
            assert port.startswith("127.0.0.1:")
    assert "ports" not in SERVICES["postgres"]
    assert SERVICES["postgres"]["networks"] == ["data"]
    assert COMPOSE["networks"]["data"] == {"internal": True}


def test_files_that_are_shown_are_there() -> None:
    for service in SERVICES.values():
        for volume in service.get("volumes", ()):
            source, _, _ = volume.partition(":")
            if source.startswith("."):
                assert (ROOT / source).exists()
                assert volume.endswith(":ro")
            else:
                assert source in COMPOSE["volumes"]


def test_the_service_follows_its_migration() -> None:
    waits = SERVICES["encore"]["depends_on"]
    assert waits["migrate"]["condition"] == "service_completed_successfully"
    assert SERVICES["migrate"]["command"] == ["encore", "migrate"]
    assert SERVICES["encore"]["command"][:2] == ["encore", "serve"]
    assert SERVICES["migrate"]["image"] == SERVICES["encore"]["image"]
    assert int(SERVICES["encore"]["stop_grace_period"].removesuffix("s")) > 30


def test_secrets_are_files_that_are_made_and_not_kept_here(tmp_path: Path) -> None:
    named = {name: Path(secret["file"]) for name, secret in COMPOSE["secrets"].items()}
    assert {path.parent for path in named.values()} == {Path("secrets")}
    assert "secrets/" in (ROOT / ".gitignore").read_text().splitlines()

    made = make_secrets(tmp_path)
    again = make_secrets(tmp_path)

    assert made == again
    assert made.keys() == {path.name for path in named.values()}
    assert tmp_path.stat().st_mode & 0o777 == 0o700
    assert len({*made.values()}) == len(made)
    assert made["postgres_password"] in made["database_url"]


def make_secrets(folder: Path) -> dict[str, str]:
    subprocess.run(
        ["sh", DEPLOY / "secrets.sh", folder], check=True, capture_output=True
    )
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_the_service_finds_its_secrets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make_secrets(tmp_path / "made")
    shown = tmp_path / "run"
    shown.mkdir()
    for secret in SERVICES["encore"]["secrets"]:
        (shown / secret["target"]).write_text(made[secret["source"]])
    environment = SERVICES["encore"]["environment"]
    assert environment == {"ENCORE_SECRETS_DIR": "/run/secrets"}
    monkeypatch.setenv("ENCORE_SECRETS_DIR", str(shown))

    settings = Settings()

    assert settings.database_url.endswith("@postgres/encore")
    assert settings.bootstrap_key is not None
    assert settings.bootstrap_key.get_secret_value() == made["bootstrap_key"]


def test_grafana_shows_the_dashboard_of_the_source_that_is_there() -> None:
    folder = DEPLOY / "grafana" / "provisioning"
    [source] = yaml.safe_load((folder / "datasources" / "prometheus.yml").read_text())[
        "datasources"
    ]
    [provider] = yaml.safe_load((folder / "dashboards" / "encore.yml").read_text())[
        "providers"
    ]
    shown = dict(
        volume.split(":")[:2]
        for volume in SERVICES["grafana"]["volumes"]
        if volume.startswith("./")
    )

    assert source["url"] == "http://prometheus:9090"
    assert set(SERVICES["grafana"]["networks"]) & set(
        SERVICES["prometheus"]["networks"]
    )
    assert shown["./deploy/grafana/encore.json"].startswith(
        provider["options"]["path"] + "/"
    )
