"""Pages: where a person would rather look than read. They call the API as others do."""

from string import Template

from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from app.domain import Scope
from app.web.files import HERE, STRICT

router = APIRouter(include_in_schema=False)
NAMES = {"./": "Listen", "admin": "Operate", "lab": "Lab", "docs": "API"}
BRAND = (
    '  <a class="brand" href="./">'
    '<img src="static/encore.svg" alt="" width="28" height="28"> Encore</a>'
)


def _page(file: str, address: str, scope: Scope) -> str:
    """A page with what all of them share, for holders of keys of a scope."""
    parts = {
        "head": _read("head").substitute().rstrip(),
        "pages": f"{BRAND}\n  {_names(address)}",
        "door": _read("door").substitute(scope=scope).rstrip(),
    }
    return _read(file).substitute(parts)


def _read(name: str) -> Template:
    return Template((HERE / f"{name}.html").read_text(encoding="utf-8"))


def _names(present: str) -> str:
    links = (
        f'<a href="{address}"{" aria-current=page" * (address == present)}>{name}</a>'
        for address, name in NAMES.items()
    )
    return f'<nav aria-label="Pages">{"".join(links)}</nav>'


LISTENER = _page("listener", "./", Scope.SERVE)
ADMIN = _page("admin", "admin", Scope.ADMIN)
LAB = _page("lab", "lab", Scope.ADMIN)


@router.get("/", response_class=HTMLResponse)
async def listener() -> HTMLResponse:
    """Show the player."""
    return HTMLResponse(LISTENER, headers=STRICT)


@router.get("/admin", response_class=HTMLResponse)
async def admin() -> HTMLResponse:
    """Show what an operator looks at; all of it is asked of the API, with a key."""
    return HTMLResponse(ADMIN, headers=STRICT)


@router.get("/lab", response_class=HTMLResponse)
async def lab() -> HTMLResponse:
    """Show policies tried on simulated users."""
    return HTMLResponse(LAB, headers=STRICT)
