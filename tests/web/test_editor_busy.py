"""In the editor, a bar shows the work that the page waits for; work is stopped, or sent again."""

from collections.abc import Callable, Iterator
from time import monotonic
from typing import Any

import pytest
from playwright.sync_api import Page, Route

from tests.web.test_page_access import PHONE_WINDOW, list_violations
from tools.browser import Stage
from tools.editor import READY, WINDOW, perform, read_value, reset_editor, select_point

MESHES = "**/v1/mesh*"
BAR = "#busy:visible"
STOPPED = "#problem-title:text('Stopped')"


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle, whose requests tests intercept."""
    reset_editor(editor.page)
    yield editor.page
    editor.page.unroute_all()
    editor.page.set_viewport_size(WINDOW)
    editor.page.emulate_media(color_scheme="light")
    reset_editor(editor.page)


@pytest.fixture
def held(page: Page) -> list[Route]:
    """The requests of meshes, which wait until a test answers them."""
    routes: list[Route] = []
    hold(page, MESHES, routes)
    return routes


def hold(page: Page, paths: str, routes: list[Route]) -> None:
    """Adds the requests to these paths to a list, and answers none of them."""

    def keep(route: Route) -> None:
        routes.append(route)

    page.route(paths, keep)


def wait_for(page: Page, condition: Callable[[], bool]) -> None:
    """Waits for a condition of the requests that the test intercepts."""
    deadline = monotonic() + 30
    while not condition():
        assert monotonic() < deadline
        page.evaluate("new Promise(requestAnimationFrame)")


def press_escape(page: Page) -> None:
    page.keyboard.press("Escape")


def stop_by_keys(page: Page) -> None:
    page.focus("#busy-stop")
    page.keyboard.press("Enter")


def tap_stop(page: Page) -> None:
    """Touches the button."""
    box = page.locator("#busy-stop").bounding_box()
    assert box is not None
    point = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    touch = page.context.new_cdp_session(page)
    touch.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [point]})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    touch.send("Emulation.setTouchEmulationEnabled", {"enabled": False})
    touch.detach()


def record_status(page: Page) -> None:
    """Records in `window.announced` the texts for screen readers from now on."""
    page.evaluate("""() => {
        const status = document.getElementById('status');
        window.announced = [];
        new MutationObserver(() => window.announced.push(status.textContent))
            .observe(status, { childList: true });
    }""")


def test_short_work_shows_no_bar(page: Page) -> None:
    shown = """() => {
        window.hasShown = false;
        new MutationObserver(() => { window.hasShown ||= !document.getElementById('busy').hidden; })
            .observe(document.getElementById('busy'), { attributes: true });
    }"""
    page.evaluate(shown)
    perform(page, lambda: page.fill("#resolution", "3"))
    assert page.is_hidden("#busy")


def test_the_bar_says_what_the_page_waits_for(page: Page, held: list[Route]) -> None:
    page.fill("#resolution", "7")
    page.wait_for_selector(BAR)
    assert page.inner_text("#busy-what") == "Computing the mesh of Saddle at resolution 7"
    assert page.inner_text("#status") == f"{page.inner_text('#busy-what')}. Escape stops it."
    page.wait_for_selector("#busy-detail:text('1 s')")
    held.pop().continue_()
    page.wait_for_selector(READY)
    assert page.is_hidden("#busy")
    assert read_value(page, "triangles") == 98


@pytest.mark.slow
@pytest.mark.usefixtures("held")
@pytest.mark.parametrize(
    "stop", [lambda page: page.click("#busy-stop"), press_escape, stop_by_keys, tap_stop]
)
def test_work_is_stopped_by_mouse_keys_and_touch(page: Page, stop: Callable[[Page], None]) -> None:
    page.fill("#resolution", "7")
    page.wait_for_selector(BAR)
    with page.expect_event("requestfailed") as failed:  # the service cancels what it computes
        stop(page)
    assert "/v1/mesh?" in failed.value.url
    page.wait_for_selector(STOPPED)
    assert "Computing the mesh of Saddle at resolution 7" in page.inner_text("#problem-detail")
    assert page.is_hidden("#busy")
    assert read_value(page, "triangles") == 72, "the last mesh"
    page.unroute_all()
    page.click("#problem-retry")
    page.wait_for_selector(READY)
    assert read_value(page, "triangles") == 98
    assert page.is_hidden("#problem")


@pytest.mark.slow
def test_every_request_of_the_page_can_be_stopped(page: Page) -> None:
    """Each action sends a request that gets no answer; Escape stops it, and the surface stays."""
    hold(page, "**/v1/**", [])
    actions: list[tuple[str, Callable[[], Any]]] = [
        ("Measuring the area and the volume", lambda: page.click("#measure")),
        ("Finding the point that was clicked", lambda: click_surface(page)),
        ("Computing the section", lambda: page.check('[name="section"][value="x"]', force=True)),
        ("Making saddle.off", lambda: page.click('[data-format="off"]')),
        ("Opening Sphere", lambda: open_example(page, "sphere")),
    ]
    for what, act in actions:
        act()
        page.wait_for_selector(BAR)
        assert page.inner_text("#busy-what") == what
        page.keyboard.press("Escape")
        page.wait_for_selector(STOPPED)
        assert page.is_hidden("#busy")
        assert page.inner_text("#title") == "Saddle"
        assert read_value(page, "triangles") == 72
        page.click("#problem-close")


def click_surface(page: Page) -> None:
    box = page.locator("#view").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.4)


def open_example(page: Page, name: str) -> None:
    page.click("#open")
    page.click(f'[data-example="{name}"]')


def test_escape_in_a_dialog_closes_the_dialog_and_stops_no_work(
    page: Page, held: list[Route]
) -> None:
    page.fill("#resolution", "7")
    page.wait_for_selector(BAR)
    page.click("#help")
    page.keyboard.press("Escape")
    assert page.is_hidden("#guide")
    assert page.is_visible("#busy")
    held.pop().continue_()
    page.wait_for_selector(READY)


@pytest.mark.usefixtures("held")
def test_escape_stops_the_mesh_of_a_number_that_is_typed(page: Page) -> None:
    select_point(page, 4)
    page.fill("#z", "3")
    page.wait_for_selector(BAR)
    page.keyboard.press("Escape")
    page.wait_for_selector(STOPPED)
    assert page.input_value("#z") == "3"
    page.unroute_all()
    page.keyboard.press("Control+z")
    page.wait_for_selector(READY)
    assert page.input_value("#z") == "1"


def test_a_request_that_is_out_of_date_is_aborted(page: Page, held: list[Route]) -> None:
    page.fill("#resolution", "7")
    wait_for(page, lambda: len(held) == 1)
    with page.expect_event("requestfailed") as failed:
        page.fill("#resolution", "8")
    assert (failed.value.post_data_json or {})["resolution"] == 7
    wait_for(page, lambda: len(held) == 2)
    assert (held[1].request.post_data_json or {})["resolution"] == 8
    held[1].continue_()
    page.wait_for_selector(READY)
    assert page.is_hidden("#problem")
    assert read_value(page, "triangles") == 128


def test_a_service_that_comes_back_is_noticed_and_asked_again(page: Page) -> None:
    """Without a click: the browser says that it is online, and the page asks at once."""
    record_status(page)
    for path in (MESHES, "**/health"):
        page.route(path, lambda route: route.abort("connectionrefused"))
    page.fill("#resolution", "7")
    page.wait_for_selector('html[data-state="away"]')
    assert "The page asks again by itself" in page.inner_text("#problem")
    page.wait_for_selector(BAR)
    assert page.inner_text("#busy-detail").startswith("waits for the service")
    # An answer of the service is not enough while requests fail.
    page.evaluate("dispatchEvent(new Event('focus'))")
    assert page.get_attribute("html", "data-state") == "away"
    page.unroute_all()
    page.evaluate("dispatchEvent(new Event('online'))")
    page.wait_for_selector(READY)
    assert page.is_hidden("#problem")
    assert read_value(page, "triangles") == 98
    announced = page.evaluate("announced")
    assert "The service is back" in announced
    assert announced[-1].startswith("98 triangles")


def test_the_newest_change_is_sent_to_a_service_that_comes_back(page: Page) -> None:
    page.route(MESHES, lambda route: route.abort("connectionrefused"))
    page.route("**/health", lambda route: route.abort("connectionrefused"))
    page.fill("#resolution", "7")
    page.wait_for_selector('html[data-state="away"]')
    page.fill("#resolution", "9")
    request = perform(page, page.unroute_all)  # the page notices this by itself
    assert request["resolution"] == 9
    assert read_value(page, "triangles") == 162


def test_work_at_which_the_service_fails_each_time_ends(page: Page) -> None:
    """The service is there, but each answer to this request is lost: it is sent four times."""
    count = 0

    def lose(route: Route) -> None:
        nonlocal count
        count += 1
        route.abort("connectionreset")

    page.route(MESHES, lose)
    page.fill("#resolution", "7")
    page.wait_for_selector('html[data-state="away"]')
    deadline = monotonic() + 30
    while page.is_visible("#busy") or count < 4:
        assert monotonic() < deadline, (count, page.inner_text("#busy"))
        page.evaluate("dispatchEvent(new Event('focus'))")
    assert count == 4
    assert page.is_visible("#problem-retry")
    page.unroute_all()
    page.click("#problem-retry")
    page.wait_for_selector(READY)


def assert_inside_window(page: Page, selector: str) -> None:
    box, window = page.locator(selector).bounding_box(), page.viewport_size
    assert box is not None
    assert window is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= window["width"]
    assert box["y"] + box["height"] <= window["height"]


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "size"), [("light", (1200, 800)), ("dark", PHONE_WINDOW)])
def test_axe_finds_no_violations_while_work_runs_or_the_service_is_away(
    page: Page, held: list[Route], scheme: Any, size: tuple[int, int]
) -> None:
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.fill("#resolution", "7")
    page.wait_for_selector(BAR)
    assert list_violations(page) == []
    assert_inside_window(page, "#busy")
    page.route("**/health", lambda route: route.abort("connectionrefused"))
    held.pop().abort("connectionrefused")
    page.wait_for_selector('html[data-state="away"]')
    assert list_violations(page) == []
    assert_inside_window(page, "#busy")
    assert_inside_window(page, "#problem")
    page.keyboard.press("Escape")
    page.wait_for_selector(STOPPED)
    box = page.locator("#problem").bounding_box()
    assert box is not None
    assert 0 <= box["x"] <= box["x"] + box["width"] <= size[0]
    assert list_violations(page) == []
