"""The player: what a listener sees and does, in a real browser."""

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.service import ADMIN, Service
from tests.pages.axe import violations
from tests.pages.browser import WINDOWS, Watched

LARGEST = 300_000  # bytes of a page, with all that it loads


def plays(service: Service) -> list[dict[str, object]]:
    """What ann has answered, the first first."""
    found = service.client.get("/v1/users/ann/plays", params={"limit": 100}).json()
    played: list[dict[str, object]] = found["plays"]
    return played[::-1]


def press(page: Page, key: str) -> None:
    """Answer, and wait for the next play."""
    said = page.locator("#slot").inner_text()
    page.keyboard.press(key)
    expect(page.locator("#slot")).not_to_have_text(said)
    expect(page.locator("#like")).to_be_enabled()


def test_a_listener_plays_thirty_items_by_keyboard(
    player: Page, example: Service
) -> None:
    keys = [("ArrowRight", "ArrowRight", "ArrowLeft")[n % 3] for n in range(30)]

    for key in keys:
        press(player, key)

    told = plays(example)
    named = {"ArrowRight": "like", "ArrowLeft": "skip"}
    assert [play["signal"] for play in told] == [named[key] for key in keys]
    assert player.locator("#line .dot.like").count() == keys.count("ArrowRight")
    assert player.locator("#line .dot.skip").count() == keys.count("ArrowLeft")
    assert "20 liked" in (player.locator("#line").get_attribute("aria-label") or "")


def test_bars_show_what_is_believed(player: Page, example: Service) -> None:
    for key in ("ArrowRight", "ArrowLeft", "ArrowRight", "ArrowRight"):
        press(player, key)
    believed = example.beliefs("ann")["beliefs"]
    rows = player.locator("#beliefs li")
    expect(rows).to_have_count(len(believed))
    expect(player.locator("#beliefs li.latest")).to_have_count(1)

    for belief in believed:
        name = example.client.get(f"/v1/items/{belief['item']}").json()["title"]
        row = rows.filter(has_text=name or belief["item"])
        shown = [
            float(each.evaluate("part => part.style.flexGrow"))
            for each in row.locator(".bar span").all()
        ]
        assert shown == pytest.approx(belief["belief"], abs=1e-5)
        expect(row.locator("strong")).to_have_text(f"{belief['like'] * 100:.0f} %")
    assert player.locator("#legend li").all_inner_texts() == believed[0]["states"]


def test_it_is_told_why_and_what_others_would_play(
    player: Page, example: Service
) -> None:
    press(player, "ArrowRight")

    expect(player.locator("#why")).to_contain_text("candidates")
    expect(player.locator("#plan-a li")).not_to_have_count(0)
    player.locator("#policy-b").select_option("round_robin")
    form = {"length": 6, "repeats": True, "policy": {"name": "round_robin"}}
    planned = example.client.post("/v1/users/ann/playlist", json=form).json()["plays"]
    titles = [play["title"] or play["item"] for play in planned if not play["pending"]]
    expect(player.locator("#plan-b li span")).to_have_text(titles)
    assert example.client.get("/v1/admin/policy").json()["name"] == "myopic"


def test_the_next_play_is_that_of_a_policy_swapped_meanwhile(
    player: Page, example: Service
) -> None:
    expect(player.locator("#slot")).to_contain_text("myopic")
    example.set_policy("random")

    press(player, "ArrowRight")

    expect(player.locator("#slot")).to_contain_text("random")


def test_an_answer_is_sent_until_it_arrives_and_counts_once(
    example: Service, browser: Browser
) -> None:
    with Watched(browser) as other:
        page = other.page
        page.goto(f"{example.url}/?user=ann#key={ADMIN}")
        page.wait_for_selector("#like:enabled")
        page.route("**/feedback*", lambda route: route.abort())
        page.keyboard.press("ArrowRight")
        expect(page.locator("#notice")).to_contain_text("Trying again")
        page.keyboard.press("ArrowLeft")  # has no effect while one is on its way
        page.unroute("**/feedback*")
        expect(page.locator("#like")).to_be_enabled()
        expect(page.locator("#notice")).to_have_text("")
        other.forgive("net::ERR_FAILED")

    assert [play["signal"] for play in plays(example)] == ["like"]


def test_a_restart_of_the_service_is_outlived(
    example: Service, browser: Browser
) -> None:
    with Watched(browser) as watched:
        page = watched.page
        page.goto(f"{example.url}/?user=ann#key={ADMIN}")
        page.wait_for_selector("#like:enabled")
        expect(page.locator("#plan-b li")).not_to_have_count(0)
        example.stop()
        page.locator("#policy-a").select_option("random")
        expect(page.locator("#notice")).to_have_text("The service does not answer.")
        said = page.locator("#slot").inner_text()
        page.keyboard.press("ArrowRight")
        expect(page.locator("#notice")).to_contain_text("Trying again")

        port = int(example.url.rsplit(":", maxsplit=1)[-1])
        again = Service.start(example.settings.model_copy(update={"port": port}))
        expect(page.locator("#slot")).not_to_have_text(said)
        expect(page.locator("#like")).to_be_enabled()
        expect(page.locator("#notice")).to_have_text("")
        watched.forgive("net::ERR_CONNECTION_REFUSED")
        assert [play["signal"] for play in plays(again)] == ["like"]
    again.stop()


def test_a_key_is_asked_for_and_stays_in_the_tab(
    browser: Browser, example: Service
) -> None:
    with Watched(browser) as watched:
        page = watched.page
        page.goto(f"{example.url}/?user=ann")
        expect(page.locator("#door")).to_be_visible()
        page.locator("#key").fill("encore_nobody")
        page.keyboard.press("Enter")
        expect(page.locator("#door-wrong")).not_to_be_empty()
        watched.forgive("401")
        page.locator("#key").fill(ADMIN)
        page.keyboard.press("Enter")
        page.wait_for_selector("#like:enabled")

        page.goto(f"{example.url}/?user=ann#key={ADMIN}")
        page.reload()
        page.wait_for_selector("#like:enabled")
        assert ADMIN not in page.url
        assert page.evaluate("Object.keys(localStorage).length") == 0
        assert page.context.cookies() == []


def test_text_of_others_stays_text(page: Page, example: Service) -> None:
    title = "<img src=x onerror=document.title='broken'>"
    form = {"model": "m1", "title": title, "tags": ["<b>bold</b>"]}
    model = example.client.get("/v1/items/item-1").json()["model"]
    for item in ("item-1", "item-2", "item-3", "item-4", "item-5"):
        answer = example.client.put(f"/v1/items/{item}", json=form | {"model": model})
        assert answer.is_success

    page.goto(f"{example.url}/?user=ann#key={ADMIN}")
    page.wait_for_selector("#like:enabled")
    press(page, "ArrowRight")

    expect(page.locator("#title")).to_have_text(title)
    expect(page.locator("#tags .tag")).to_have_text(["<b>bold</b>"])
    assert page.title() == "Encore: listen"


def test_an_empty_service_says_so(browser: Browser, service: Service) -> None:
    with Watched(browser) as watched:
        watched.page.goto(f"{service.url}/#key={ADMIN}")

        expect(watched.page.locator("#title")).to_have_text("Nothing to play yet")
        expect(watched.page.locator("#first-steps a").last).to_be_visible()
        watched.forgive("409")


def test_an_empty_service_takes_the_demo_s_catalogue(
    browser: Browser, service: Service
) -> None:
    with Watched(browser) as watched:
        page = watched.page
        page.goto(f"{service.url}/?user=ann#key={ADMIN}")
        page.get_by_role("button", name="Bring the demo's catalogue").click()
        page.wait_for_selector("#like:enabled")
        expect(page.locator("#first-steps")).to_be_hidden()
        press(page, "ArrowRight")
        watched.forgive("409")

    items = service.client.get("/v1/items", params={"limit": 1000}).json()["items"]
    assert len(items) == 65


@pytest.mark.parametrize("window", WINDOWS)
def test_everybody_can_use_it(browser: Browser, example: Service, window: str) -> None:
    with Watched(browser, WINDOWS[window]) as watched:
        page = watched.page
        page.goto(f"{example.url}/?user=ann#key={ADMIN}")
        page.wait_for_selector("#like:enabled")
        for key in ("ArrowRight", "ArrowLeft"):
            press(page, key)
        expect(page.locator("#plan-b li")).not_to_have_count(0)

        assert violations(page) == []
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= page.viewport_size["width"]  # type: ignore[index]
        assert 10_000 < sum(watched.loaded.values()) < LARGEST
