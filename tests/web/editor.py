"""What tests do with the editor, as a person would: choose a point, drag it, read the numbers."""

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page

from tests.web.browser import Stage

READY = 'html[data-state="ready"]'
"""No request is under way, and the last one was answered with a mesh."""


def listening(page: Page) -> Stage:
    """A page with all that its console says from now on."""
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text))
    return Stage(page, complaints)


def show(page: Page, address: str) -> None:
    page.goto(address)
    page.wait_for_selector(READY)


def value(page: Page, name: str) -> float:
    """A number of the readouts, all of its digits."""
    return float(page.locator(f"#{name}").get_attribute("value") or "nan")


def point(page: Page) -> list[float]:
    return [float(page.input_value(f"#{axis}")) for axis in "xyz"]


def settled(page: Page, act: Callable[[], Any]) -> dict[str, Any]:
    """Does something that makes the page ask for a mesh, and waits for it; tells what was asked."""
    with page.expect_response(
        lambda answer: (
            answer.url.endswith("/v1/mesh") and "surface" in (answer.request.post_data_json or {})
        )
    ) as waited:
        act()
    page.wait_for_selector(READY)
    asked = waited.value.request.post_data_json
    assert isinstance(asked, dict)
    return asked


def choose(page: Page, number: int) -> tuple[float, float]:
    """Chooses a control point by its number; tells where in the window it is seen."""
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
