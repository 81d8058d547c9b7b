"""The operator's page: what is shown is what is, and what is done is done."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from app import __version__
from tests.app.service import ADMIN, Service
from tests.pages.axe import violations
from tests.pages.browser import WINDOWS, Watched

VIEWS = ("overview", "policy", "experiments", "models", "items", "users/ann", "health")


@pytest.fixture
def played(example: Service) -> Service:
    """Ann has liked three plays and skipped one; another waits."""
    play = example.next("ann")
    for signal in ("like", "like", "skip", "like"):
        play = example.answer(play["play"], signal, next=True)["next"]
    return example


@pytest.fixture
def desk(browser: Browser, played: Service) -> Iterator[Page]:
    with Watched(browser) as watched:
        watched.page.goto(f"{played.url}/admin#key={ADMIN}")
        watched.page.wait_for_selector("#view h1")
        yield watched.page


def go(page: Page, view: str) -> None:
    page.evaluate("view => { location.hash = view; }", view)
    title = view.split("/", maxsplit=1)[0].capitalize()
    expect(page.locator("#view h1")).to_have_text(title)


def test_an_operator_swaps_the_policy_and_the_next_play_obeys(
    desk: Page, played: Service
) -> None:
    go(desk, "policy")
    desk.get_by_label("Policy", exact=True).select_option("exact_rollout")
    desk.get_by_label("horizon").fill("4")
    desk.get_by_label("leaf").select_option("none")
    desk.get_by_label("base").select_option(["myopic", "round_robin"])
    desk.get_by_label("Why").fill("from the page")
    desk.get_by_role("button", name="Put in force").click()

    expect(desk.locator(".told")).to_contain_text(["exact_rollout is in force"])
    present = played.client.get("/v1/admin/policy").json()
    assert present["note"] == "from the page"
    assert present["params"]["base"] == ["myopic", "round_robin"]
    assert (present["params"]["horizon"], present["params"]["leaf"]) == (4, "none")
    assert played.next("ben")["policy"]["name"] == "exact_rollout"
    desk.get_by_role("button", name="Roll back").click()
    expect(desk.locator("table tbody tr")).to_have_count(4)
    assert played.client.get("/v1/admin/policy").json()["name"] == "myopic"


def test_what_is_refused_is_told_with_its_field(
    browser: Browser, played: Service
) -> None:
    with Watched(browser) as watched:
        page = watched.page
        page.goto(f"{played.url}/admin#key={ADMIN}")
        go(page, "policy")
        page.get_by_label("Policy", exact=True).select_option("rollout")
        page.get_by_label("trajectories").fill("-3")
        page.get_by_role("button", name="Put in force").click()

        expect(page.locator(".told.wrong")).to_contain_text("params.trajectories")
        watched.forgive("422")
    assert played.client.get("/v1/admin/policy").json()["name"] == "myopic"


def test_a_second_browser_sees_the_swap(desk: Page, played: Service) -> None:
    go(desk, "policy")
    expect(desk.locator("section").first).to_contain_text("myopic")

    played.set_policy("random")

    expect(desk.locator("section").first).to_contain_text("random", timeout=20_000)


def test_an_import_with_three_bad_lines_names_them_and_changes_nothing(
    browser: Browser, played: Service, tmp_path: Path
) -> None:
    model = played.client.get("/v1/items/item-1").json()["model"]
    file = tmp_path / "items.csv"
    good = f"new-1,{model},A song,calm,\n"
    bad = f"new-2,nobody,B,,\nnew-3,{model},C,,[1]\n,{model},D,,\n"
    file.write_text(f"id,model,title,tags,payload\n{good}{bad}")
    with Watched(browser) as watched:
        page = watched.page
        page.goto(f"{played.url}/admin#key={ADMIN}")
        go(page, "items")
        page.get_by_label("File").set_input_files(file)
        page.get_by_role("button", name="Import", exact=True).click()
        errors = page.locator(".told.wrong li")
        expect(errors).to_have_count(3)
        lines = [re.search(r"\d+", text) for text in errors.all_inner_texts()]
        assert [found and found.group() for found in lines] == ["3", "4", "5"]
        watched.forgive("422")
        assert played.client.get("/v1/items/new-1").status_code == 404

        file.write_text(f"id,model,title,tags,payload\n{good}")
        page.get_by_label("File").set_input_files(file)
        page.get_by_role("button", name="Try it").click()
        expect(page.locator(".told").last).to_contain_text("Would be done")
        assert played.client.get("/v1/items/new-1").status_code == 404
        page.get_by_role("button", name="Import", exact=True).click()
        expect(page.locator("table")).to_contain_text("A song")
    assert played.client.get("/v1/items/new-1").json()["tags"] == ["calm"]


def test_the_overview_counts_what_was_played(desk: Page) -> None:
    go(desk, "overview")

    row = desk.locator("table tbody tr").filter(has_text="myopic")
    expect(row.locator("td").nth(1)).to_have_text("1")
    expect(row.locator("td").nth(3)).to_have_text("4")
    expect(desk.locator(".tile").nth(1)).to_contain_text("75.0 %")


def test_a_user_is_found_explained_and_erased(desk: Page, played: Service) -> None:
    go(desk, "users")
    desk.get_by_label("User").fill("ann")
    desk.get_by_label("User").press("Enter")
    expect(desk.locator("table tbody tr")).to_have_count(4)
    expect(desk.locator(".badge.good")).to_have_count(3)
    desk.get_by_role("button", name="Why?").first.click()
    expect(desk.locator(".told").first).to_contain_text("candidates")
    shown = desk.get_by_role("img", name="Chance of a like from slot 0")
    expect(shown.locator("rect")).to_have_count(5 * 4)
    pressed = desk.locator(".beliefs button").last
    pressed.click()
    expect(desk.get_by_role("heading", level=2)).to_contain_text(
        [f"Interest in {pressed.inner_text()}"]
    )
    with desk.expect_download() as held:
        desk.get_by_role("button", name="Export").click()
    assert '"user": "ann"' in held.value.path().read_text()

    desk.once("dialog", lambda dialog: dialog.accept())
    desk.get_by_role("button", name="Erase").click()

    expect(desk.locator(".told").last).to_contain_text("erased")
    assert played.beliefs("ann")["slot"] == 0


def test_an_experiment_is_begun_and_ended(desk: Page, played: Service) -> None:
    go(desk, "experiments")
    desk.get_by_role("button", name="Begin or change").click()
    expect(desk.locator("table").first).to_contain_text("control")
    assert played.client.get("/v1/admin/experiment").json()["running"]

    desk.once("dialog", lambda dialog: dialog.accept())
    desk.get_by_role("button", name="End it").click()

    expect(desk.locator("section").first).to_contain_text("has ended")


def test_a_serve_key_does_not_open_it(browser: Browser, played: Service) -> None:
    form = {"name": "player", "scope": "serve"}
    key = played.client.post("/v1/admin/keys", json=form).json()["key"]
    with Watched(browser) as watched:
        watched.page.goto(f"{played.url}/admin#key={key}")

        expect(watched.page.locator("#door-wrong")).not_to_be_empty()
        watched.forgive("403")


@pytest.mark.parametrize("window", WINDOWS)
def test_everybody_can_use_it(browser: Browser, played: Service, window: str) -> None:
    with Watched(browser, WINDOWS[window]) as watched:
        page = watched.page
        page.goto(f"{played.url}/admin#key={ADMIN}")
        for view in VIEWS:
            go(page, view)
            page.wait_for_load_state("networkidle")
            assert violations(page) == []
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert wide <= page.viewport_size["width"]  # type: ignore[index]
        assert 10_000 < sum(watched.loaded.values()) < 300_000


def test_a_policy_is_tried_before_it_is_put_in_force(
    desk: Page, played: Service
) -> None:
    go(desk, "policy")
    desk.get_by_label("Policy", exact=True).select_option("random")
    desk.get_by_role("button", name="Try it first").click()

    expect(desk.locator(".told")).to_contain_text(["simulated users"])
    tried = desk.locator("section section table tbody tr")
    expect(tried).to_have_count(2)
    expect(tried.first).to_contain_text("myopic (in force)")
    expect(tried.last).to_contain_text("random")
    expect(desk.locator("section section svg.chart")).to_have_count(2)
    assert played.client.get("/v1/admin/policy").json()["name"] == "myopic"


def test_an_item_is_found_and_edited(desk: Page, played: Service) -> None:
    go(desk, "items")
    expect(desk.locator("tbody tr")).to_have_count(5)
    desk.get_by_label("Find").fill("ITEM-3")
    expect(desk.locator("tbody tr")).to_have_count(1)
    desk.get_by_role("button", name="item-3").click()
    desk.get_by_label("Title").fill("Another title")
    desk.get_by_role("button", name="Save").click()

    expect(desk.locator("tbody tr")).to_contain_text(["Another title"])
    assert played.client.get("/v1/items/item-3").json()["title"] == "Another title"
    desk.get_by_label("Find").fill("another t")
    expect(desk.locator("tbody tr")).to_have_count(1)
    desk.get_by_label("Find").fill("no such")
    expect(desk.locator("tbody tr")).to_have_count(0)


def test_health_tells_the_release(desk: Page) -> None:
    go(desk, "health")
    expect(desk.locator(".tile").first).to_have_text(f"Release{__version__}")
