"""The API's document as a page on which calls can be tried."""

from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from app.web.files import HERE, STRICT

router = APIRouter(include_in_schema=False)
PAGE = (HERE / "docs.html").read_text(encoding="utf-8")


@router.get("/docs", response_class=HTMLResponse)
async def docs() -> HTMLResponse:
    """Show Swagger UI."""
    return HTMLResponse(PAGE, headers=STRICT)
