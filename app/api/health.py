"""Whether the process lives, and whether it can serve."""

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from app.api.context import Context, context_of
from app.errors import ClientError
from app.storage import migrate

router = APIRouter(prefix="/health", tags=["operations"])


class Alive(BaseModel):
    status: str = "alive"


class Reason(BaseModel):
    """Why requests cannot be served yet."""

    code: str
    detail: str


class Readiness(BaseModel):
    """Whether requests can be served.

    warm:     the decision code is compiled, the catalogue read
    database: it answers
    migrated: its tables are those of this release, or of a later one
    """

    status: str
    warm: bool
    database: bool
    migrated: bool
    reasons: list[Reason]


@router.get("/live")
async def live() -> Alive:
    """Whether the process answers at all."""
    return Alive()


@router.get("/ready", responses={503: {"model": Readiness}})
async def ready(request: Request, response: Response) -> Readiness:
    """Whether requests can be served: compiled, connected, migrated; if not, why."""
    context = context_of(request)
    warm = context.warm.is_set()
    faults = [await _fault_of_database(context), None if warm else WARMING]
    reasons = [reason for reason in faults if reason is not None]
    codes = {reason.code for reason in reasons}
    response.status_code = 503 if reasons else 200
    return Readiness(
        status="not ready" if reasons else "ready",
        warm=warm,
        database=UNREACHABLE.code not in codes,
        migrated=not codes & {UNREACHABLE.code, MIGRATIONS_MISSING},
        reasons=reasons,
    )


MIGRATIONS_MISSING = "migrations_missing"
WARMING = Reason(
    code="warming", detail="The decision code is compiled, and the catalogue read."
)
UNREACHABLE = Reason(
    code="database_unavailable", detail="The database does not answer."
)


async def _fault_of_database(context: Context) -> Reason | None:
    try:
        present = await context.database.run(migrate.present)
    except ClientError:
        return UNREACHABLE
    if not migrate.is_behind(present):
        return None
    there = "none" if present is None else present
    needed = f"there: {there}, needed: {migrate.head()}"
    return Reason(
        code=MIGRATIONS_MISSING,
        detail=f"Tables of this release are missing ({needed}). Run `encore migrate`.",
    )
