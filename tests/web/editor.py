"""Actions of a person in the editor: choose a point, drag it, read the numbers."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from service.api.routes.pages import STATIC, THREE
from tests.web.browser import WITHOUT_PIXELS, Stage, listening

READY = 'html[data-state="ready"]'
"""Whether no request is running, and the last response was a mesh."""

SADDLE = "/?surface=saddle&resolution=6"
START = {"look": "shaded", "accuracy": "resolution"}


def open_profile(browser: Browser) -> Stage:
    """An empty page in a fresh profile, in which WebGL fills no pixels."""
    if not (STATIC / THREE).is_file():
        pytest.skip("three.js is not built ('make web')")
    context = browser.new_context(viewport={"width": 880, "height": 440}, reduced_motion="reduce")
    stage = listening(context.new_page())
    stage.page.add_init_script(WITHOUT_PIXELS)
    return stage


def open_editor(browser: Browser, address: str) -> Stage:
    """The editor in a fresh profile, after it shows its first mesh."""
    stage = open_profile(browser)
    show(stage.page, address)
    return stage


def start_anew(page: Page) -> None:
    """Resets the editor to a newly opened saddle, because loading the page takes seconds without a
    GPU."""
    if page.locator("#library").is_visible():
        page.keyboard.press("Escape")
    for name, choice in START.items():
        page.check(f'input[name="{name}"][value="{choice}"]', force=True)
    page.locator('[name="axis"][value="free"]').evaluate("radio => { radio.checked = true; }")
    page.fill("#resolution", "6")
    page.set_checked("#show-net", True)
    page.set_checked("#show-wires", False)
    page.click("#open")
    page.click('[data-example="saddle"]')
    page.wait_for_selector(READY)


def show(page: Page, address: str) -> None:
    page.goto(address)
    page.wait_for_selector(READY)


def read_value(page: Page, name: str) -> float:
    """A number of the readouts, with all of its digits."""
    return float(page.locator(f"#{name}").get_attribute("value") or "nan")


def read_point(page: Page) -> list[float]:
    return [float(page.input_value(f"#{axis}")) for axis in "xyz"]


def perform(page: Page, act: Callable[[], Any]) -> dict[str, Any]:
    """Performs an action that requests a mesh, waits for the mesh, and returns the request."""
    with page.expect_response(
        lambda response: (
            response.url.endswith("/v1/mesh")
            and "surface" in (response.request.post_data_json or {})
        )
    ) as waited:
        act()
    page.wait_for_selector(READY)
    request = waited.value.request.post_data_json
    assert isinstance(request, dict)
    return request


def choose(page: Page, number: int) -> tuple[float, float]:
    """Chooses a control point by its number; returns its place in the window."""
    page.fill("#point", str(number))
    page.press("#point", "Enter")
    marker = page.locator(f"#marker:has-text('{number}')")
    marker.wait_for()
    box = page.locator("#view").bounding_box()
    assert box is not None
    x, y = (float(marker.get_attribute(f"data-{axis}") or "nan") for axis in "xy")
    return box["x"] + x, box["y"] + y


def drag(page: Page, start: tuple[float, float], by: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + by[0] / 2, start[1] + by[1] / 2)
    page.mouse.move(start[0] + by[0], start[1] + by[1])
    page.mouse.up()
    page.wait_for_selector(READY)
