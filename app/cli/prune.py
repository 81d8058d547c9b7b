"""`encore prune`: old plays, dropped."""

from datetime import UTC, datetime
from typing import Annotated

import typer

from app.cli.console import AsJson, progress, say, show_json
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.services.retention import prune

BY = "command line"


def command(
    *,
    before: Annotated[
        datetime,
        typer.Option(
            formats=["%Y-%m-%d", "%Y-%m-%dT%H:%M:%S"],
            help="Drop plays that were offered before then (UTC).",
        ),
    ],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only count what would be dropped.")
    ] = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Drop old plays, while serving goes on; beliefs become what is left tells.

    Decisions before today cannot be explained any more for users whose plays went.
    """
    since = before.replace(tzinfo=UTC)

    async def dropped(session: Session) -> tuple[int, int]:
        users = total = 0
        with progress() as bar:
            task = bar.add_task("users", total=None)
            database, live = session.database, session.live
            async for count in prune(database, live, since, BY, dry_run=dry_run):
                users += count > 0
                total += count
                bar.advance(task)
        return users, total

    users, total = perform(configured(database_url=database_url), dropped)
    if as_json:
        show_json({"users": users, "plays": total, "dry_run": dry_run})
    else:
        would = "would drop" if dry_run else "dropped"
        say(f"{would} {total} plays of {users} users")
