"""Layout and looks of the editor: what is in sight, the view, clicks, sections, names of faces."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page

from tools.browser import WITHOUT_PIXELS, Stage, record_page
from tools.editor import WINDOW, reset_editor, show

PHONE, LAPTOP = (390, 844), (1280, 720)
"""Widths and heights of windows, in pixels."""

TARGETS = """() => [...document.querySelectorAll(
    'button, select, summary, a, input:not(.segments input):not(.file input), .segments label')]
  .filter((node) => node.checkVisibility({ visibilityProperty: true }) && !node.closest('.skip'))
  .map((node) => {
    const label = node.closest('label.switch') ?? node;
    const { width, height } = label.getBoundingClientRect();
    return [node.id || node.name || node.textContent.trim(), width, height];
  })"""
"""Name, width and height of all elements that a finger can press."""


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle and default choices; the console must stay empty."""
    editor.messages.clear()
    reset_editor(editor.page)
    yield editor.page
    editor.page.set_viewport_size(WINDOW)
    assert editor.messages == []


def box_of(element: Locator) -> tuple[float, float, float, float]:
    """Left, top, right and lower edge of an element in the window, in pixels."""
    box = element.bounding_box()
    assert box is not None
    return box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"]


def is_inside(page: Page, selector: str) -> bool:
    """Whether an element is inside the window, without scrolling."""
    left, top, right, bottom = box_of(page.locator(selector))
    size = page.viewport_size
    assert size is not None
    return 0 <= left <= right <= size["width"] and 0 <= top <= bottom <= size["height"]


def test_on_a_laptop_the_slider_and_all_of_mesh_are_in_sight(page: Page) -> None:
    page.set_viewport_size({"width": LAPTOP[0], "height": LAPTOP[1]})
    for selector in ("#view", "#resolution", 'section[aria-labelledby="h-mesh"]', ".readouts"):
        assert is_inside(page, selector), selector
    panel = box_of(page.locator(".settings"))
    assert box_of(page.locator('section[aria-labelledby="h-mesh"]'))[3] <= panel[3]


def test_on_a_phone_view_and_slider_are_in_sight_and_fingers_hit_all_controls(
    server: str, browser: Browser
) -> None:
    size: Any = {"width": PHONE[0], "height": PHONE[1]}
    context = browser.new_context(viewport=size, has_touch=True, is_mobile=True)
    stage = record_page(context.new_page(), ("error",))
    page = stage.page
    page.add_init_script(WITHOUT_PIXELS)
    show(page, f"{server}/?surface=utah-teapot&resolution=2")
    assert is_inside(page, "#view")
    assert is_inside(page, "#resolution")
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE[0]
    # The view stays in sight while the panel scrolls below it.
    page.locator("#section-x").scroll_into_view_if_needed()
    assert page.evaluate("scrollY") > 0
    assert is_inside(page, "#view")
    assert box_of(page.locator("#view"))[3] < box_of(page.locator("#section-x"))[1]
    page.fill("#point", "1")
    page.press("#point", "Enter")
    targets = page.evaluate(TARGETS)
    assert len(targets) > 40
    assert [target for target in targets if min(target[1:]) < 24] == []
    # All but the buttons in the bar of a narrow screen are as high as a finger is wide.
    assert [target for target in targets if target[2] < 44] == []
    context.close()
    assert stage.messages == []
