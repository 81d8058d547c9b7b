"""Debian's Chromium, and what it must not report."""

import os
import shutil
from collections.abc import Mapping
from types import TracebackType
from typing import Any, Self

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Response

OPTIONS = (
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",
)
WINDOWS: Mapping[str, Mapping[str, Any]] = {
    "light": {"color_scheme": "light", "viewport": {"width": 1280, "height": 900}},
    "dark": {"color_scheme": "dark", "viewport": {"width": 1280, "height": 900}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True},
}
NAMES = ("chromium", "chromium-browser", "google-chrome")


def chromium() -> str:
    """Where a browser is; where it need not be there, its tests are left out."""
    for name in NAMES:
        if found := shutil.which(name):
            return found
    reason = "there is no Chromium; `sh scripts/tools` installs it on Debian"
    if os.environ.get("ENCORE_TOOLS") == "required":
        pytest.fail(reason)
    pytest.skip(reason)


class Watched:
    """A window of which all errors and all that is loaded are kept.

    Attributes:
        errors: what the console was told, and what failed.
        loaded: bytes of what came from the service, by address.
    """

    def __init__(
        self, browser: Browser, window: Mapping[str, Any] | None = None
    ) -> None:
        self._context = browser.new_context(**(window or {}))
        self.page: Page = self._context.new_page()
        self.errors: list[str] = []
        self.loaded: dict[str, int] = {}
        self.page.on("console", self._told)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on(
            "requestfinished", lambda request: self._loaded(request.response())
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self._context.close()
        if kind is None:
            assert not self.errors, self.errors

    def forgive(self, text: str) -> None:
        """Take errors that a test provokes for what they are."""
        assert any(text in error for error in self.errors), self.errors
        self.errors = [error for error in self.errors if text not in error]

    def _told(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self.errors.append(message.text)

    def _loaded(self, response: Response | None) -> None:
        if response is not None and "/static/" in response.url:
            self.loaded[response.url] = len(response.body())
