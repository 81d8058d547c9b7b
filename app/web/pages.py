"""Pages: where a person would rather look than read. They call the API as others do."""

from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from app.web.files import HERE, STRICT

router = APIRouter(include_in_schema=False)
LISTENER = (HERE / "listener.html").read_text(encoding="utf-8")
ADMIN = (HERE / "admin.html").read_text(encoding="utf-8")


@router.get("/", response_class=HTMLResponse)
async def listener() -> HTMLResponse:
    """Show the player."""
    return HTMLResponse(LISTENER, headers=STRICT)


@router.get("/admin", response_class=HTMLResponse)
async def admin() -> HTMLResponse:
    """Show what an operator looks at; all of it is asked of the API, with a key."""
    return HTMLResponse(ADMIN, headers=STRICT)
