"""The lab: what is asked is in the address, and what comes of it can be kept."""

import csv
import json
from pathlib import Path
from urllib.parse import urlencode
from xml.etree import ElementTree as ET

import pytest
from playwright.sync_api import Browser, Page, expect

from app.settings import Settings
from tests.app.service import ADMIN, Service
from tests.pages.axe import violations
from tests.pages.browser import WINDOWS, Watched

ASKED = [
    ("example", 2),
    ("runs", 40),
    ("slots", 30),
    ("seed", 3),
    ("policy", "random"),
    ("policy", 'exact_rollout={"horizon":2}'),
]
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def bench(page: Page, service: Service) -> Page:
    """The lab, with the result of what its address asks for."""
    page.goto(f"{service.url}/lab?{urlencode(ASKED)}#key={ADMIN}")
    expect(page.locator("#result table tbody tr")).to_have_count(2)
    return page


def result(service: Service) -> dict[str, object]:
    """The same by the API."""
    form = dict(ASKED[:4]) | {
        "policies": [
            {"name": "random"},
            {"name": "exact_rollout", "params": {"horizon": 2}},
        ]
    }
    lines = service.client.post("/v1/admin/simulations", json=form).text.splitlines()
    told: dict[str, object] = json.loads(lines[-1])["result"]
    return told


def saved(page: Page, name: str, folder: Path) -> str:
    with page.expect_download() as download:
        page.get_by_role("button", name=name).first.click()
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path.read_text(encoding="utf-8")


def test_an_address_is_answered_again(bench: Page) -> None:
    numbers = bench.locator("#result table").inner_text()

    bench.reload()

    expect(bench.locator("#result table tbody tr")).to_have_count(2)
    again = bench.locator("#result table").inner_text()
    rewards = [line.split("\t")[:3] for line in numbers.splitlines()]
    assert [line.split("\t")[:3] for line in again.splitlines()] == rewards
    assert bench.locator("#policies li").count() == 2
    assert bench.locator("#runs").input_value() == "40"


def test_a_form_becomes_an_address(page: Page, service: Service) -> None:
    page.goto(f"{service.url}/lab#key={ADMIN}")
    expect(page.locator("#policies li")).to_have_count(3)
    for _ in range(2):
        page.get_by_role("button", name="Leave it out").first.click()
    page.get_by_role("button", name="Add a policy").click()
    page.get_by_label("Parameters").last.fill('{"horizon":3}')
    page.get_by_label("Policy", exact=True).last.select_option("rollout")
    page.locator("#runs").fill("10")
    page.locator("#slots").fill("5")
    page.get_by_role("button", name="Simulate").click()

    expect(page.locator("#result table tbody tr")).to_have_count(2)
    assert "runs=10" in page.url
    assert page.url.count("policy=") == 2
    assert "horizon" in page.url
    assert ADMIN not in page.url


def test_numbers_are_kept_as_csv(bench: Page, service: Service, tmp_path: Path) -> None:
    rows = list(csv.DictReader(saved(bench, "All of it", tmp_path).splitlines()))

    told = result(service)
    for one in told["policies"]:  # type: ignore[attr-defined]
        mine = [row for row in rows if row["policy"] == one["label"]]
        [reward] = [row for row in mine if row["value"] == "reward"]
        assert float(reward["mean"]) == one["mean"]
        assert float(reward["half_width_95"]) == one["ci95"]
        curve = [float(row["mean"]) for row in mine if row["value"] == "earned_by_slot"]
        assert curve == one["curve"]
        shares = [float(row["mean"]) for row in mine if row["value"] == "play_share"]
        assert shares == one["play_shares"]
    assert (
        float(next(r["mean"] for r in rows if r["value"] == "bound")) == told["bound"]
    )


def test_figures_are_kept_as_svg(bench: Page, tmp_path: Path) -> None:
    file = saved(bench, "Figure as SVG", tmp_path)

    figure = ET.fromstring(file)  # noqa: S314 - ours

    lines = figure.findall(f"{SVG}polyline")
    assert len(lines) == len(figure.findall(f"{SVG}polygon")) == 2
    assert all(line.get("stroke", "").startswith("rgb") for line in lines)
    assert lines[0].get("stroke") != lines[1].get("stroke")
    assert figure.get("viewBox") == "0 0 860 380"
    assert not figure.findall(".//*[@class]")


@pytest.mark.parametrize(
    ("params", "told"),
    [
        ('{"horizon": 0}', "policies.0.params.horizon"),
        ("{horizon}", "Parameters are JSON"),
    ],
)
def test_what_is_refused_names_its_field(
    browser: Browser, service: Service, params: str, told: str
) -> None:
    with Watched(browser) as watched:
        query = urlencode({"policy": f"exact_rollout={params}"})
        watched.page.goto(f"{service.url}/lab?{query}#key={ADMIN}")
        expect(watched.page.locator("#notice")).to_contain_text(told)
        if "422" in "".join(watched.errors):
            watched.forgive("422")


class TestPatience:
    @pytest.fixture
    def settings(self, settings: Settings) -> Settings:
        return settings.with_changes(simulation_budget="1000000")

    @pytest.fixture
    def long(self, page: Page, service: Service) -> Page:
        asked = {"example": 2, "runs": 1_000_000, "policy": "exact_rollout"}
        page.goto(f"{service.url}/lab?{urlencode(asked)}#key={ADMIN}")
        expect(page.locator("#notice")).to_contain_text("Simulating users")
        return page

    def test_it_tells_how_far_it_is_and_can_be_stopped(self, long: Page) -> None:
        expect(long.locator("#progress")).to_be_visible()
        long.get_by_role("button", name="Stop").click()
        expect(long.locator("#notice")).to_have_text("Stopped.")
        expect(long.locator("#progress")).to_be_hidden()
        long.locator("#runs").fill("5")
        long.locator("#slots").fill("5")
        long.get_by_role("button", name="Simulate").click()
        expect(long.locator("#result table tbody tr")).to_have_count(1)


@pytest.mark.parametrize("window", WINDOWS)
def test_everybody_can_use_it(browser: Browser, service: Service, window: str) -> None:
    with Watched(browser, WINDOWS[window]) as watched:
        page = watched.page
        page.goto(f"{service.url}/lab?{urlencode(ASKED)}#key={ADMIN}")
        expect(page.locator("#result table tbody tr")).to_have_count(2)

        assert violations(page) == []
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= page.viewport_size["width"]  # type: ignore[index]
        assert sum(watched.loaded.values()) < 300_000
