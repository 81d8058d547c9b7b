"""A browser, and services for it to look at."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from app.settings import Settings
from tests.app.conftest import (
    _compiled,
    example,
    postgres,
    postgres_url,
    service,
    sqlite_template,
    sqlite_url,
)
from tests.app.service import ADMIN, Service, settings_of
from tests.pages.browser import OPTIONS, Watched, chromium

__all__ = [
    "_compiled",
    "example",
    "postgres",
    "postgres_url",
    "service",
    "sqlite_template",
    "sqlite_url",
]


expect.set_options(timeout=60_000)  # a busy machine is no fault of a test


@pytest.fixture
def settings(sqlite_url: str) -> Settings:
    """One database will do: pages call the API, which is tried on both."""
    return settings_of(sqlite_url)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser for the tests of a file.

    It lives no longer: while it does, an event loop runs in this thread, and no test
    that has one of its own could.
    """
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=chromium(), args=list(OPTIONS)
        )
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Browser, service: Service) -> Iterator[Page]:
    """A page in a window of its own; at the end nothing must have gone wrong in it.

    It is closed before the service ends, which it may be asking something.
    """
    assert service.url
    with Watched(browser) as watched:
        yield watched.page


@pytest.fixture
def player(page: Page, example: Service) -> Page:
    """The player, with a key, at its first play."""
    page.goto(f"{example.url}/?user=ann#key={ADMIN}")
    page.wait_for_selector("#like:enabled")
    return page
