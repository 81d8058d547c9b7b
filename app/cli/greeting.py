"""What the demo prints: where to look, and three calls that work when pasted."""

import shlex
from dataclasses import dataclass
from uuid import UUID

from app.cli.console import note, out, say

USER = "ann"


@dataclass(frozen=True, slots=True)
class Invitation:
    """A running demo. `admin_key` also serves; `play`: the one that ann is offered."""

    url: str
    admin_key: str
    serve_key: str
    play: UUID

    @property
    def player(self) -> str:
        """A page; what follows the # stays in the browser."""
        return f"{self.url}/#key={self.serve_key}"

    @property
    def calls(self) -> dict[str, str]:
        """Lines for a POSIX shell, to be pasted in order."""
        return {
            "the next play for ann": self._curl(f"/v1/users/{USER}/next"),
            "ann likes it; show the next one": self._curl(
                f"/v1/plays/{self.play}/feedback?next=true", body='{"signal": "like"}'
            ),
            "another policy, from the next request on": self._curl(
                "/v1/admin/policy",
                *("-X", "PUT"),
                body='{"name": "myopic", "note": "trying it"}',
            ),
        }

    def _curl(self, path: str, *options: str, body: str | None = None) -> str:
        form = () if body is None else ("-H", "Content-Type: application/json")
        data = () if body is None else ("-d", body)
        key = ("-H", f"Authorization: Bearer {self.admin_key}")
        return shlex.join(
            ["curl", "-sS", "-w", r"\n", *options, *key, *form, *data, self.url + path]
        )


def greet(invitation: Invitation) -> None:
    out.rule("Encore is ready", style="green")
    say(f"Player     {invitation.player}")
    say(f"API        {invitation.url}/v1")
    say(f"Docs       {invitation.url}/docs")
    say(f"Admin key  {invitation.admin_key}")
    say(f"Serve key  {invitation.serve_key}")
    say("The keys are shown only now; what is kept is their hash.")
    say()
    say("Paste these into another terminal, in order:")
    for meaning, line in invitation.calls.items():
        say()
        out.print(f"# {meaning}", style="dim")
        say(line)
    say()
    note("Ctrl-C stops the service.")


def describe(invitation: Invitation) -> dict[str, object]:
    """The same for programs."""
    return {
        "player": invitation.player,
        "api": f"{invitation.url}/v1",
        "docs": f"{invitation.url}/docs",
        "admin_key": invitation.admin_key,
        "serve_key": invitation.serve_key,
        "curl": list(invitation.calls.values()),
    }
