"""Actions of a user in the editor: opens surfaces, selects and drags points, reads numbers."""

import json
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qsl

from playwright.sync_api import Browser, Page, ViewportSize

from tools.browser import WITHOUT_PIXELS, Stage, record_page
from tools.page_build import need_bundles

READY = 'html[data-state="ready"]'
"""Selector of the page in the state in which no request runs and the last response was a mesh."""

SADDLE = "/?surface=saddle&resolution=6"
WINDOW: ViewportSize = {"width": 880, "height": 440}
DEFAULT_CHOICES = {"look": "shaded", "accuracy": "resolution", "section": "off"}


def open_profile(browser: Browser) -> Stage:
    """An empty page in a new profile of the browser; to save time, WebGL draws no pixels on it."""
    need_bundles()
    context = browser.new_context(viewport=WINDOW, reduced_motion="reduce")
    stage = record_page(context.new_page())
    stage.page.add_init_script(WITHOUT_PIXELS)
    return stage


def open_editor(browser: Browser, url: str) -> Stage:
    """The editor in a new profile of the browser, when it shows its first mesh."""
    stage = open_profile(browser)
    show(stage.page, url)
    return stage


def reset_editor(page: Page) -> None:
    """Opens the saddle with the default choices, as if the page were loaded again.

    Without a graphics card, loading the page would take seconds.
    """
    if page.locator("#library").is_visible():
        page.keyboard.press("Escape")
    for name, choice in DEFAULT_CHOICES.items():
        page.check(f'input[name="{name}"][value="{choice}"]', force=True)
    # `check` cannot reach this radio button, because it is hidden while no point is selected.
    page.locator('[name="axis"][value="free"]').evaluate("radio => { radio.checked = true; }")
    # This slider is hidden while the resolution is chosen.
    page.locator("#tolerance").evaluate(
        "slider => { slider.value = -3; slider.dispatchEvent(new Event('input')); }"
    )
    page.fill("#resolution", "6")
    page.set_checked("#show-net", True)
    page.set_checked("#show-wires", False)
    page.click("#open")
    page.click('[data-example="saddle"]')
    page.wait_for_selector(READY)


def show(page: Page, url: str) -> None:
    """Opens a URL of the editor, and waits for its mesh."""
    page.goto(url)
    page.wait_for_selector(READY)


def read_value(page: Page, name: str) -> float:
    """A number that the panel shows, with all of its digits."""
    return float(page.locator(f"#{name}").get_attribute("value") or "nan")


def read_point(page: Page) -> list[float]:
    """The coordinates of the selected control point in the panel."""
    return [float(page.input_value(f"#{axis}")) for axis in "xyz"]


def perform(page: Page, act: Callable[[], Any]) -> dict[str, Any]:
    """Performs an action that requests a mesh, and waits for the mesh; returns the request.

    The request of the first mesh of an example or a stored surface is its URL; it is returned in
    the form of the others, with the surface that has this name or id.
    """
    with page.expect_response(
        lambda response: (
            "/mesh.glb?" in response.url
            or (
                "/v1/mesh?" in response.url and "surface" in (response.request.post_data_json or {})
            )
        )
    ) as response:
        act()
    page.wait_for_selector(READY)
    sent = response.value.request
    request = _read_address(page, sent.url) if sent.method == "GET" else sent.post_data_json
    assert isinstance(request, dict)
    return request


def _read_address(page: Page, url: str) -> dict[str, Any]:
    """The request that the URL of a mesh stands for."""
    address, _, query = url.partition("/mesh.glb?")
    options: dict[str, Any] = {
        name: value.split(",") if name == "overlays" else _read_text(value)
        for name, value in parse_qsl(query)
    }
    return {"surface": page.request.get(address).json()["surface"], **options}


def _read_text(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def select_point(page: Page, number: int) -> tuple[float, float]:
    """Selects a control point by its number; returns its position in the window, in pixels."""
    page.fill("#point", str(number))
    page.press("#point", "Enter")
    marker = page.locator(f"#marker:has-text('{number}')")
    marker.wait_for()
    box = page.locator("#view").bounding_box()
    assert box is not None
    x, y = (float(marker.get_attribute(f"data-{axis}") or "nan") for axis in "xy")
    return box["x"] + x, box["y"] + y


def drag(page: Page, start: tuple[float, float], shift: tuple[float, float]) -> None:
    """Drags the mouse from `start` by `shift` pixels, and waits for the mesh."""
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + shift[0] / 2, start[1] + shift[1] / 2)
    page.mouse.move(start[0] + shift[0], start[1] + shift[1])
    page.mouse.up()
    page.wait_for_selector(READY)
