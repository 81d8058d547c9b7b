"""What stands in the way of people who see, hear or point otherwise: axe-core."""

from pathlib import Path

import axe_playwright_python
from playwright.sync_api import Page

AXE = (Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text()


def violations(page: Page) -> list[tuple[str, str]]:
    """Rules that are broken, and where first."""
    page.evaluate(AXE)
    found = page.evaluate("axe.run()")
    return [(one["id"], one["nodes"][0]["html"]) for one in found["violations"]]
