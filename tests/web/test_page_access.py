"""Accessibility of the editor: axe-core reports no violations, and the keyboard is enough."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

from service.encoders.registry import FORMATS
from tools.browser import Stage
from tools.editor import READY, WINDOW, read_value, reset_editor, select_point
from tools.programs import find_node_package

# Width and height of windows, in pixels.
WIDE_WINDOW, PHONE_WINDOW = (1200, 800), (360, 740)
# Returns the name of the element that has the focus, and whether the page shows the focus. The
# name of a format's button is the suffix of the format (`data-format`).
FOCUS = """() => {
    const { activeElement: element } = document;
    const { outlineStyle, boxShadow } = getComputedStyle(element);
    return [element.id || element.name || element.className || element.dataset.format
                || element.tagName,
            element.matches(':focus-visible')
                && (outlineStyle !== 'none' || boxShadow !== 'none')];
}"""

# Names of elements that the tab key must reach, in this order; of radio buttons, the checked one.
TAB_ORDER = [
    *("open", "help", "theme", "view", "fit", "accuracy", "resolution"),
    *("point-previous", "point", "point-next", "x", "y", "z", "weight-slider", "weight", "axis"),
    *("direction", "choose-all", "choose-line", "choose-none", "choose-several"),
    *("add-line", "delete-line", "raise-degree", "open-knot", "open-mirror"),
    *("look", "show-net", "show-wires", "section"),
    *(fmt.suffix for fmt in FORMATS),
    "save-json",
    *("copy-link", "copy-curl", "copy-snippet"),
]


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle and default choices; the console must stay empty."""
    editor.messages.clear()
    reset_editor(editor.page)
    yield editor.page
    editor.page.set_viewport_size(WINDOW)
    editor.page.emulate_media(color_scheme="light")
    assert editor.messages == []


def list_violations(page: Page) -> list[tuple[str, str, list[Any]]]:
    """Violations of accessibility that axe-core finds on the page: rule, impact, elements."""
    if not page.evaluate("'axe' in window"):
        page.evaluate((find_node_package("axe-core") / "axe.min.js").read_text(encoding="utf-8"))
    report = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
    return [
        (rule["id"], rule["impact"], [node["target"] for node in rule["nodes"]])
        for rule in report["violations"]
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "size"), [("light", WIDE_WINDOW), ("dark", PHONE_WINDOW)])
def test_axe_finds_no_violations_in_the_page_and_its_dialogs(
    page: Page, scheme: Any, size: tuple[int, int]
) -> None:
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    assert list_violations(page) == []
    for opener in ("#open", "#help"):
        page.click(opener)
        assert page.locator("dialog[open]").count() == 1
        assert list_violations(page) == [], opener
        page.keyboard.press("Escape")
    select_point(page, 2)
    page.check('input[name="section"][value="x"]', force=True)
    page.wait_for_selector("#section-row:visible")
    assert list_violations(page) == []
    # The page is not wider than the window, so it does not scroll sideways.
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]


def test_axe_finds_no_violations_while_an_error_is_shown(editor: Stage) -> None:
    page = editor.page
    reset_editor(page)
    select_point(page, 2)
    page.fill("#weight", "0")
    page.press("#weight", "Enter")
    page.wait_for_selector("#problem[role=alert]")
    assert list_violations(page) == []
    page.click("#problem-undo")
    page.wait_for_selector(READY)


def test_axe_finds_a_button_without_a_name(page: Page) -> None:
    """The test adds the button, to show that axe works."""
    page.evaluate("""() => {
        const nameless = document.createElement('button');
        nameless.id = 'nameless';
        document.querySelector('main').append(nameless);
    }""")
    assert [rule for rule, _, _ in list_violations(page)] == ["button-name"]
    page.evaluate("document.querySelector('#nameless').remove()")


def test_the_tab_key_reaches_all_elements_and_the_focus_is_visible(page: Page) -> None:
    select_point(page, 2)
    page.focus(".skip")
    names: list[str] = []
    for _ in range(80):  # more elements than the page has
        page.keyboard.press("Tab")
        name, is_focus_visible = page.evaluate(FOCUS)
        if name == "BODY" or name in names:
            break
        assert is_focus_visible, name
        names.append(name)
    assert [name for name in names if name in TAB_ORDER] == TAB_ORDER


def test_a_surface_is_edited_without_a_mouse(page: Page) -> None:
    """By keys alone, the test opens an example, selects a point, moves it, and undoes the move."""
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
    old_deviation = read_value(page, "deviation")
    keys.press("PageUp")
    page.wait_for_selector(READY)
    page.wait_for_selector("#status:has-text('triangles')")
    assert read_value(page, "deviation") != old_deviation
    keys.press("Control+z")
    page.wait_for_selector(READY)
    assert read_value(page, "deviation") == old_deviation
