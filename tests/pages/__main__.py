"""Takes the pictures in docs/pages, of the demo: `python -m tests.pages`."""

import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, expect, sync_playwright

from app.api.schemas.items import ItemPage
from app.api.schemas.model_views import ModelPage
from app.cli.session import perform
from app.demo import catalogue
from app.demo.listeners import Listener, Nature
from app.settings import Settings
from app.storage import migrate
from tests.app.service import ADMIN, Service
from tests.pages.browser import OPTIONS, WINDOWS, Watched, chromium

PICTURES = Path(__file__).parents[2] / "docs" / "pages"
PLAYS = 24
LISTENERS = 150
COUNTED_IN = 180  # seconds, of which plays settle for one minute
VIEWS = (
    *("overview", "policy", "experiments", "models"),
    *("items", "users/light", "health"),
)
LAB = "example=1&runs=1000&" + "&".join(
    f"policy={name}" for name in ("myopic", "exact_rollout", "whittle", "random")
)
EXPERIMENT = "/v1/admin/experiment"
SPLIT = {
    "name": "look-ahead",
    "arms": [
        {"name": "present", "share": 0.45},
        {"name": "myopic", "policy": {"name": "myopic"}, "share": 0.45},
    ],
    "holdout": 0.1,
    "note": "is looking ahead worth it?",
}
LIKED = 60  # per cent; from this chance on a play is liked, but for each fifth


def main() -> None:
    """Start a service with the demo's catalogue, and look at each page of it."""
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="encore-pages-") as folder:
        url = f"sqlite:///{folder}/encore.db"
        migrate.upgrade(url)
        settings = Settings(database_url=url, port=0, bootstrap_key=ADMIN)
        perform(
            settings,
            lambda session: catalogue.ensure(session.database, session.live),
        )
        service = Service.start(settings.with_changes(log_level="error"))
        try:
            _look(service)
        finally:
            service.stop()


def _look(service: Service) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=list(OPTIONS)
        )
        for name, window in WINDOWS.items():
            with Watched(browser, window) as watched:
                watched.page.goto(f"{service.url}/?user={name}#key={ADMIN}")
                _listen(watched.page)
                picture = PICTURES / f"listen-{name}.png"
                watched.page.screenshot(path=picture, full_page=name != "phone")
        _experiment(service)
        for name, window in WINDOWS.items():
            with Watched(browser, window) as watched:
                _operate(watched.page, service.url, name)
                _simulate(watched.page, service.url, name)
        browser.close()


def _experiment(service: Service) -> None:
    """Let listeners take part in an experiment, until all their plays are counted."""
    models = ModelPage.model_validate(service.client.get("/v1/models").json())
    items = ItemPage.model_validate(service.client.get("/v1/items").json())
    nature = Nature.of(models.models, items.items)
    service.client.put(EXPERIMENT, json=SPLIT).raise_for_status()
    for number in range(LISTENERS):
        listener = Listener(nature, np.random.default_rng(number))
        play = service.next(f"listener-{number}")
        for left in reversed(range(PLAYS)):
            signal = listener.hear(play["item"]).signal
            play = service.answer(play["play"], signal, next=left > 0)["next"]
    until = time.monotonic() + COUNTED_IN
    while _counted(service) < LISTENERS * PLAYS:
        if time.monotonic() > until:
            raise RuntimeError(f"only {_counted(service)} plays were counted")
        time.sleep(1)


def _counted(service: Service) -> int:
    arms = service.client.get(EXPERIMENT).json()["arms"]
    return sum(arm["answered"] for arm in arms)


def _operate(page: Page, url: str, name: str) -> None:
    page.goto(f"{url}/admin#key={ADMIN}")
    for view in VIEWS:
        page.evaluate("view => { location.hash = view; }", view)
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(1000)
        title = view.split("/")[0]
        whole = title == "users" and name != "phone"
        page.screenshot(path=PICTURES / f"{title}-{name}.png", full_page=whole)


def _simulate(page: Page, url: str, name: str) -> None:
    if name == "light":
        page.goto(f"{url}/admin#policy")
        page.get_by_label("Policy", exact=True).select_option("myopic")
        page.get_by_role("button", name="Try it first").click()
        expect(page.locator("section section")).to_have_count(3, timeout=600_000)
        page.screenshot(path=PICTURES / "preview-light.png", full_page=True)
    page.goto(f"{url}/lab?{LAB}")
    page.wait_for_selector("#result table", timeout=600_000)
    page.screenshot(path=PICTURES / f"lab-{name}.png", full_page=True)


def _listen(page: Page) -> None:
    page.wait_for_selector("#like:enabled")
    for number in range(PLAYS):
        said = page.locator("#slot").inner_text()
        likely = int(page.locator("#chance").inner_text().split()[0]) >= LIKED
        page.keyboard.press("ArrowRight" if likely ^ (number % 5 == 0) else "ArrowLeft")
        expect(page.locator("#slot")).not_to_have_text(said)
        expect(page.locator("#like")).to_be_enabled()
    page.wait_for_timeout(2000)  # bars have come to rest


if __name__ == "__main__":
    main()
