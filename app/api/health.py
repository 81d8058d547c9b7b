"""Whether the process lives, and whether it can serve."""

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from app.api.context import context_of
from app.errors import ClientError
from app.storage import migrate

router = APIRouter(prefix="/health", tags=["operations"])


class Alive(BaseModel):
    status: str = "alive"


class Readiness(BaseModel):
    """`warm`: the decision code is compiled."""

    status: str
    warm: bool
    database: bool
    migrated: bool


@router.get("/live")
async def live() -> Alive:
    """Whether the process answers at all."""
    return Alive()


@router.get("/ready", responses={503: {"model": Readiness}})
async def ready(request: Request, response: Response) -> Readiness:
    """Whether requests can be served: compiled, connected, migrated."""
    context = context_of(request)
    try:
        present = await context.database.run(migrate.present)
        database, migrated = True, present == migrate.head()
    except ClientError:
        database, migrated = False, False
    warm = context.warm.is_set()
    good = warm and database and migrated
    response.status_code = 200 if good else 503
    status = "ready" if good else "not ready"
    return Readiness(status=status, warm=warm, database=database, migrated=migrated)
