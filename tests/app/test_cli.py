"""The command `encore`."""

import json
import signal
import socket
import sqlite3
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from app import __version__
from app.cli import COMMANDS
from app.storage import migrate
from tests.app.commands import ROOT, Encore, start
from tests.app.service import Service, client_of

MODEL = {
    "id": "pop",
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.9],
    "prior": [0.5, 0.5],
    "source": "a test",
}
ITEM = {"id": "ярко", "model": "pop", "title": "Ярко", "tags": ["a"], "payload": {}}
PLAY = {
    "user": "ann",
    "item": "ярко",
    "signal": "like",
    "at": "2026-03-01T20:15:00+00:00",
}


def test_help_names_every_command_and_waits_for_no_compiler() -> None:
    script = (
        "import sys; sys.argv = ['encore', '--help']\n"
        "from app.cli import main\n"
        "try: main()\n"
        "finally: assert not {'numba', 'fastapi', 'sqlalchemy'} & set(sys.modules)"
    )

    helped = subprocess.run(
        [sys.executable, "-c", script],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )

    for name, (_, summary) in COMMANDS.items():
        assert name in helped.stdout
        assert summary in helped.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself(encore: Encore, name: str) -> None:
    said = encore(name, "--help")

    assert said.status == 0
    assert f"encore {name}" in said.out


def test_the_version_is_shown(encore: Encore) -> None:
    assert encore("--version").out == f"encore {__version__}\n"


def test_an_unknown_command_is_refused(encore: Encore) -> None:
    said = encore("dance")

    assert said.status == 2
    assert "dance" in said.err


def test_migrate_goes_up_and_down_and_up(encore: Encore, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/new.db"
    head = migrate.head()

    first = encore("migrate", "--database-url", url, "--json")
    again = encore("migrate", "--database-url", url)
    down = encore(
        "migrate", "--database-url", url, "--down-to", "base", "--yes", "--json"
    )

    assert first.json == {"database": url, "from": None, "to": head}
    assert again.out == f"{url}: {head} -> {head}\n"
    assert down.json == {"database": url, "from": head, "to": None}


def test_migrate_refuses_a_revision_that_is_none(
    encore: Encore, sqlite_url: str
) -> None:
    said = encore("migrate", "--database-url", sqlite_url, "--down-to", "moon", "--yes")

    assert said.status == 2
    assert one_line(said.err)
    assert "moon" in said.err


@pytest.mark.parametrize("words", [["serve"], ["audit"], ["keys", "list"]])
def test_a_database_that_is_missing_is_not_made(
    encore: Encore, tmp_path: Path, words: list[str]
) -> None:
    file = tmp_path / "none.db"

    said = encore(*words, "--database-url", f"sqlite:///{file}")

    assert said.status == 1
    assert one_line(said.err)
    assert "encore migrate" in said.err
    assert not file.exists()


def test_a_database_that_is_not_migrated_is_refused(
    encore: Encore, database_url: str
) -> None:
    encore("migrate", "--database-url", database_url, "--down-to", "base", "--yes")

    said = encore("audit", "--database-url", database_url)

    assert said.status == 1
    assert one_line(said.err)
    assert "encore migrate" in said.err


@pytest.mark.parametrize("words", [["migrate"], ["audit"]])
def test_a_database_that_does_not_answer_is_named_without_its_password(
    encore: Encore, words: list[str]
) -> None:
    url = "postgresql://ann:secret@127.0.0.1:1/encore"

    said = encore(*words, "--database-url", url)

    assert said.status == 1
    assert one_line(said.err)
    assert "ann:…@127.0.0.1:1/encore does not answer" in said.err
    assert "secret" not in said.err


def test_a_database_that_does_not_exist_is_told(
    encore: Encore, postgres_url: str
) -> None:
    said = encore("migrate", "--database-url", f"{postgres_url}_missing")

    assert said.status == 1
    assert one_line(said.err)
    assert "does not exist" in said.err


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("ENCORE_PORT", "many", "ENCORE_PORT"),
        ("ENCORE_DATABASE_URL", "mysql://x", "expected sqlite:///FILE"),
        ("ENCORE_LIKE_FRACTION", "2", "ENCORE_LIKE_FRACTION"),
    ],
)
def test_bad_settings_are_named(
    encore: Encore,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    value: str,
    complaint: str,
) -> None:
    monkeypatch.setenv(name, value)

    said = encore("audit")

    assert said.status == 2
    assert one_line(said.err)
    assert complaint in said.err
    assert "Value error" not in said.err


def test_keys_are_made_listed_and_revoked(encore: Encore, service: Service) -> None:
    at = ("--database-url", service.settings.database_url)

    made = encore("keys", "create", "--name", "player", *at, "--json").json
    listed = encore("keys", "list", *at, "--json").json

    assert {key["id"] for key in listed} > {made["id"]}
    assert "key" not in listed[0]
    with client_of(service.url, made["key"]) as client:
        assert client.get("/v1/items").status_code == 200
        assert client.get("/v1/admin/policy").status_code == 403
    assert encore("keys", "revoke", made["id"], *at).status == 0
    assert made["id"] not in encore("keys", "list", *at).out


def test_a_secret_is_no_id_and_is_not_shown_again(
    encore: Encore, sqlite_url: str
) -> None:
    at = ("--database-url", sqlite_url)
    secret = encore("keys", "create", *at).out.strip()

    mistaken = encore("keys", "revoke", secret, *at)
    unknown = encore("keys", "revoke", "none", *at)

    assert mistaken.status == 2
    assert one_line(mistaken.err)
    assert "encore keys list" in mistaken.err
    assert secret not in mistaken.err
    assert (unknown.status, unknown.err) == (1, "Error: There is no key 'none'.\n")


def test_the_last_admin_key_stays(encore: Encore, service: Service) -> None:
    at = ("--database-url", service.settings.database_url)
    key = encore("keys", "list", *at, "--json").json[0]["id"]

    said = encore("keys", "revoke", key, *at)

    assert said.status == 1
    assert one_line(said.err)
    assert "another admin key" in said.err


def test_what_is_imported_is_exported(
    encore: Encore, database_url: str, tmp_path: Path
) -> None:
    at = ("--database-url", database_url)
    for kind, entry in {"models": MODEL, "items": ITEM, "history": PLAY}.items():
        file = tmp_path / f"{kind}.ndjson"
        file.write_text(json.dumps(entry, ensure_ascii=False) + "\n", "utf-8")

        imported = encore("import", kind, file, *at, "--json")
        target = tmp_path / f"{kind}.out"
        exported = encore("export", kind, target, *at)
        printed = encore("export", kind, *at)

        assert imported.status == 0, imported.err
        assert exported.status == 0, exported.err
        assert imported.err == printed.err == ""
        assert exported.err == f"1 lines written to {target}\n"
        assert json.loads(target.read_text("utf-8")) == entry
        assert json.loads(printed.out) == entry
    assert encore("audit", *at, "--json").json["plays"] == 1


def test_an_import_of_what_is_wrong_names_the_lines(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "models.jsonl"
    file.write_text(json.dumps(MODEL) + "\nnonsense\n" + json.dumps({"id": "x"}))

    said = encore("import", "models", file, "--database-url", sqlite_url)

    assert said.status == 1
    assert "line 2: " in said.err
    assert "line 3: play: " in said.err
    assert encore("export", "models", "--database-url", sqlite_url).out == ""


def test_a_dry_run_changes_nothing(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "models.ndjson"
    file.write_text(json.dumps(MODEL))

    said = encore(
        "import", "models", file, "--dry-run", "--json", "--database-url", sqlite_url
    )

    assert said.json["created"] == 1
    assert encore("export", "models", "--database-url", sqlite_url).out == ""


def test_what_an_import_did_or_would_do_is_told(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    at = ("--database-url", sqlite_url)
    told = {
        "models": (
            "would create 1, replace 0, leave 0, retire 0 (nothing was changed)\n",
            "created 1, replaced 0, unchanged 0, retired 0\n",
        ),
        "items": (
            "would create 1, replace 0, leave 0, retire 0 (nothing was changed)\n",
            "created 1, replaced 0, unchanged 0, retired 0\n",
        ),
        "history": (
            "every line is good, users 1 (nothing was changed)\n",
            "users 1, entered 1, known 0\n",
        ),
    }
    entries = {"models": MODEL, "items": ITEM, "history": PLAY}
    for kind, (would, did) in told.items():
        file = tmp_path / f"{kind}.ndjson"
        file.write_text(json.dumps(entries[kind]))

        assert encore("import", kind, file, "--dry-run", *at).out == would
        assert encore("import", kind, file, *at).out == did


@pytest.mark.parametrize("options", [[], ["--dry-run"]])
def test_a_model_that_looks_like_a_mistake_is_told(
    encore: Encore, sqlite_url: str, tmp_path: Path, options: list[str]
) -> None:
    file = tmp_path / "models.ndjson"
    odd = MODEL | {"id": "odd", "like": [0.9, 0.2]}
    file.write_text(json.dumps(MODEL) + "\n" + json.dumps(odd))

    said = encore(
        "import", "models", file, *options, "--json", "--database-url", sqlite_url
    )

    assert said.status == 0
    assert list(said.json["warnings"]) == ["odd"]
    (warning,) = said.json["warnings"]["odd"]
    assert "falls from state 'low'" in warning
    assert said.err == f"Warning: model 'odd': {warning}\n"


def test_what_was_to_be_imported_first_is_told(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "items.ndjson"
    file.write_text(json.dumps(ITEM) + "\n" + json.dumps(ITEM | {"id": "b"}))

    said = encore("import", "items", file, "--database-url", sqlite_url)

    assert said.err.startswith("line 1: model: unknown model 'pop'\n")
    assert said.err.endswith("Nothing was changed. Import models first.\n")


def test_signals_that_no_model_has_are_entered_on_demand_alone(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    at = ("--database-url", sqlite_url)
    file = tmp_path / "file.ndjson"
    for kind, entry in {"models": MODEL, "items": ITEM}.items():
        file.write_text(json.dumps(entry))
        assert encore("import", kind, file, *at).status == 0
    file.write_text(json.dumps(PLAY | {"signal": "partial"}))

    refused = encore("import", "history", file, *at)
    entered = encore("import", "history", file, "--any-signal", *at)

    assert refused.err.startswith(
        "line 1: signal: unknown signal 'partial'; known here: skip, like, none\n"
    )
    assert "With --any-signal they are entered" in refused.err
    assert entered.out == "users 1, entered 1, known 0\n"
    assert encore("audit", *at).status == 0


def test_models_are_not_read_from_csv(encore: Encore, sqlite_url: str) -> None:
    said = encore("import", "models", "models.csv", "--database-url", sqlite_url)

    assert said.status == 2
    assert one_line(said.err)
    assert "cannot be read as CSV" in said.err


@pytest.mark.parametrize("name", ["missing.ndjson", "items.pdf"])
def test_a_file_that_cannot_be_read_is_named(
    encore: Encore, sqlite_url: str, name: str
) -> None:
    said = encore("import", "items", name, "--database-url", sqlite_url)

    assert said.status == 2
    assert one_line(said.err)
    assert name in said.err


def test_audit_finds_what_was_changed_and_rebuild_mends_it(
    encore: Encore, sqlite_url: str, tmp_path: Path
) -> None:
    at = ("--database-url", sqlite_url)
    for kind, entry in {"models": MODEL, "items": ITEM, "history": PLAY}.items():
        file = tmp_path / f"{kind}.ndjson"
        file.write_text(json.dumps(entry))
        encore("import", kind, file, *at)
    with sqlite3.connect(sqlite_url.removeprefix("sqlite:///")) as connection:
        connection.execute("UPDATE users SET slot = 7")
    connection.close()

    wrong = encore("audit", *at)
    mended = encore("rebuild", *at, "--json")
    right = encore("audit", *at)

    assert wrong.status == 1
    assert "ann" in wrong.out
    assert wrong.err == mended.err == right.err == ""
    assert mended.json == {"users": 1}
    assert right.status == 0


def test_a_port_that_is_taken_is_named(encore: Encore, sqlite_url: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]

        said = encore("serve", "--port", port, "--database-url", sqlite_url)

    assert said.status == 1
    assert one_line(said.err)
    assert f"Port {port} of 127.0.0.1 is in use. Choose another with" in said.err


@pytest.mark.parametrize("told", [signal.SIGINT, signal.SIGTERM])
def test_serve_on_sqlite_takes_one_process_and_ends_when_told(
    sqlite_url: str, tmp_path: Path, told: signal.Signals
) -> None:
    words = ("serve", "--port", 0, "--workers", 4, "--database-url", sqlite_url)
    with start(*words, cwd=tmp_path) as process:
        assert process.stdout is not None
        serving = json.loads(process.stdout.readline())
        answer = httpx.get(f"{serving['address']}/health/live", trust_env=False)
        process.send_signal(told)
        _, complaint = process.communicate(timeout=60)

    assert answer.status_code == 200
    assert serving["workers"] == 1
    assert "1 process, not 4" in complaint
    assert "Traceback" not in complaint
    assert process.returncode == 0


def test_several_processes_end_when_told(postgres_url: str, tmp_path: Path) -> None:
    words = ("serve", "--port", 0, "--workers", 2, "--database-url", postgres_url)
    with start(*words, cwd=tmp_path) as process:
        assert process.stdout is not None
        while "serving" not in (line := process.stdout.readline()):
            assert line
        address = json.loads(line)["address"]
        answer = httpx.get(f"{address}/health/live", trust_env=False, timeout=60)
        process.send_signal(signal.SIGTERM)
        _, complaint = process.communicate(timeout=60)

    assert answer.status_code == 200
    assert "Traceback" not in complaint
    assert process.returncode == 0


def one_line(text: str) -> bool:
    return text.startswith("Error: ") and text.count("\n") == 1
