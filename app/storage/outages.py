"""Which errors mean that the database does not answer, or not to us."""

from sqlalchemy import exc

ABSENT = (OSError, exc.OperationalError, exc.InterfaceError, exc.TimeoutError)
# connection, login, no such database, full, no connections allowed, closing
REFUSALS = ("08", "28", "3D", "53", "55000", "57")


def is_outage(error: Exception) -> bool:
    return (
        isinstance(error, ABSENT)
        or (isinstance(error, exc.InternalError) and not state_of(error))
        or state_of(error).startswith(REFUSALS)
        or "file is not a database" in str(error)
    )


def is_missing_table(error: exc.DBAPIError) -> bool:
    return state_of(error) == "42P01" or "no such table" in str(error.orig)


def state_of(error: Exception) -> str:
    """PostgreSQL's name for what is wrong."""
    cause = error.orig if isinstance(error, exc.DBAPIError) else error
    return getattr(cause, "sqlstate", None) or ""
