"""Accessibility of the editor: checked by axe, and used by keyboard alone."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

from service.encoders.registry import FORMATS
from tests.programs import find_node_package
from tests.web.browser import Stage
from tests.web.editor import READY, choose, read_value, start_anew

WIDE, NARROW = (1200, 800), (360, 740)
# The place of the mouse pointer has no meaning for users without a mouse.
FOCUS = """() => {
    const { activeElement: now } = document;
    const { outlineStyle, boxShadow } = getComputedStyle(now);
    return [now.id || now.name || now.className || now.dataset.format || now.tagName,
            now.matches(':focus-visible') && (outlineStyle !== 'none' || boxShadow !== 'none')];
}"""

# The elements that the tab key reaches, in this order; of radio buttons only the checked one.
REACHED = [
    *("open", "help", "theme", "view", "fit", "point-previous", "point", "point-next"),
    *("x", "y", "z", "weight-slider", "weight", "axis"),
    *("look", "show-net", "show-wires", "accuracy", "resolution"),
    *(fmt.suffix for fmt in FORMATS),
    *("copy-link", "copy-curl", "copy-snippet"),
]


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The saddle, freshly opened; the console must stay silent."""
    editor.complaints.clear()
    start_anew(editor.page)
    yield editor.page
    editor.page.set_viewport_size({"width": 900, "height": 640})
    editor.page.emulate_media(color_scheme="light")
    assert editor.complaints == []


def list_violations(page: Page) -> list[tuple[str, str, list[Any]]]:
    """Findings of axe on the page: rule, impact and places."""
    if not page.evaluate("'axe' in window"):
        page.evaluate((find_node_package("axe-core") / "axe.min.js").read_text(encoding="utf-8"))
    result = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
    return [
        (rule["id"], rule["impact"], [node["target"] for node in rule["nodes"]])
        for rule in result["violations"]
    ]


@pytest.mark.parametrize(("scheme", "size"), [("light", WIDE), ("dark", NARROW)])
def test_axe_reports_nothing(page: Page, scheme: Any, size: tuple[int, int]) -> None:
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    assert list_violations(page) == []
    for opener in ("#open", "#help"):
        page.click(opener)
        assert page.locator("dialog[open]").count() == 1
        assert list_violations(page) == [], opener
        page.keyboard.press("Escape")
    choose(page, 2)
    assert list_violations(page) == []
    # The page never scrolls sideways, at any width.
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]


def test_axe_reports_nothing_for_a_refusal(editor: Stage) -> None:
    page = editor.page
    start_anew(page)
    choose(page, 2)
    page.fill("#weight", "0")
    page.press("#weight", "Enter")
    page.wait_for_selector("#problem[role=alert]")
    assert list_violations(page) == []
    page.click("#problem-undo")
    page.wait_for_selector(READY)


def test_axe_can_find_something(page: Page) -> None:
    """axe finds a planted fault, a button without a name."""
    page.evaluate("""() => {
        const nameless = document.createElement('button');
        nameless.id = 'nameless';
        document.querySelector('main').append(nameless);
    }""")
    assert [rule for rule, _, _ in list_violations(page)] == ["button-name"]
    page.evaluate("document.querySelector('#nameless').remove()")


def test_the_tab_key_reaches_everything_and_shows_where_it_is(page: Page) -> None:
    choose(page, 2)
    page.focus(".skip")
    walked: list[str] = []
    for _ in range(80):
        page.keyboard.press("Tab")
        name, is_seen = page.evaluate(FOCUS)
        if name == "BODY" or name in walked:
            break
        assert is_seen, name
        walked.append(name)
    assert [name for name in walked if name in REACHED] == REACHED


def test_a_surface_is_edited_without_a_mouse(page: Page) -> None:
    """Opens an example, chooses a point, moves it, and undoes this, by keys alone."""
    keys = page.keyboard
    page.focus("#open")
    keys.press("Enter")
    page.wait_for_selector("#library[open]")
    while page.evaluate("document.activeElement.dataset.example") != "sphere":
        keys.press("Tab")
    keys.press("Enter")
    page.wait_for_selector(READY)
    assert page.inner_text("#title") == "Sphere"
    assert page.evaluate("document.activeElement.id") == "open"
    page.focus(".skip")
    keys.press("Enter")
    assert page.evaluate("document.activeElement.id") == "view"
    keys.press("]")
    assert page.inner_text("#status").startswith("Control point 1 of 28")
    before = read_value(page, "deviation")
    keys.press("PageUp")
    page.wait_for_selector(READY)
    page.wait_for_selector("#status:has-text('triangles')")
    assert read_value(page, "deviation") != before
    keys.press("Control+z")
    page.wait_for_selector(READY)
    assert read_value(page, "deviation") == before
