"""`encore rebuild`: beliefs as the log of plays gives them."""

from typing import Annotated

import typer

from app.cli.console import AsJson, progress, say, show_json
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.services.audits import rebuild


def command(
    *,
    user: Annotated[str | None, typer.Option(help="Only this user.")] = None,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Replace all beliefs by what the log of plays says, while serving goes on."""

    async def rebuilt(session: Session) -> int:
        users = 0
        with progress() as bar:
            task = bar.add_task("users", total=None)
            async for _ in rebuild(session.database, session.live, user):
                users += 1
                bar.advance(task)
        return users

    users = perform(configured(database_url=database_url), rebuilt)
    if as_json:
        show_json({"users": users})
    else:
        say(f"rebuilt {users} users")
