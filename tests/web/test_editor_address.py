"""The address of the editor follows what is open; copied links keep the camera and the settings."""

import re
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page

from tests.web.test_page_sharing import copy_text
from tools.browser import Stage
from tools.editor import READY, SADDLE, open_profile, perform, read_point, select_point, show
from tools.processes import ROOT

LIST_OPTIONS = "[...new URLSearchParams(location.hash.slice(1)).keys()]"
READ_CAMERA = "new URLSearchParams(location.hash.slice(1)).get('camera')"


@pytest.fixture(scope="module")
def stage(browser: Browser) -> Iterator[Stage]:
    """The editor in a profile of its own; its console must stay empty."""
    stage = open_profile(browser)
    yield stage
    assert stage.messages == []
    stage.page.context.close()


@pytest.fixture
def page(stage: Stage, server: str) -> Page:
    stage.page.goto("about:blank")
    show(stage.page, server + SADDLE)
    return stage.page


def wait_for_address(page: Page, text: str) -> None:
    """Waits until the query and the fragment are these."""
    page.wait_for_function("text => location.search + location.hash === text", arg=text)


def turn(page: Page) -> str:
    """Turns the camera by keys; returns the camera in the address."""
    page.focus("#view")
    page.keyboard.press("Escape")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("+")
    page.wait_for_function(f"() => {READ_CAMERA} !== null")
    camera: str = page.evaluate(READ_CAMERA)
    assert len(camera.split(",")) == 6
    return camera


@pytest.mark.slow
def test_the_address_names_the_surface_and_an_edited_one_has_none(page: Page) -> None:
    wait_for_address(page, "?surface=saddle#resolution=6")
    page.fill("#resolution", "9")
    wait_for_address(page, "?surface=saddle#resolution=9")
    page.click("#open")
    perform(page, lambda: page.click('[data-example="sphere"]'))
    wait_for_address(page, "?surface=sphere#resolution=9")
    page.fill("#resolution", "16")
    wait_for_address(page, "?surface=sphere")
    select_point(page, 1)
    page.fill("#z", "3")
    page.press("#z", "Enter")
    wait_for_address(page, "")
    assert page.evaluate("history.state.draft")
    page.click("#undo")
    wait_for_address(page, "?surface=sphere")
    page.go_back()
    page.wait_for_selector('#title:has-text("Saddle")')
    page.wait_for_selector(READY)
    assert page.input_value("#resolution") == "9"
    wait_for_address(page, "?surface=saddle#resolution=9")
    page.go_forward()
    page.wait_for_selector('#title:has-text("Sphere")')
    assert page.input_value("#resolution") == "16"
    assert page.is_enabled("#redo")


@pytest.mark.slow
def test_the_link_of_an_edited_surface_keeps_camera_and_settings(
    page: Page, browser: Browser
) -> None:
    assert page.is_hidden("#share-stores")
    select_point(page, 4)
    page.fill("#z", "2.5")
    page.press("#z", "Enter")
    page.wait_for_selector("#share-stores:visible")
    assert "store the surface in the service" in page.inner_text("#share-stores")
    assert page.get_attribute("#copy-link", "aria-describedby") == "share-stores"
    camera = turn(page)
    page.set_checked("#show-net", False)
    url = copy_text(page, "copy-link")
    assert page.is_hidden("#share-stores")
    parts = urlsplit(url)
    assert parts.query.startswith("surface=")
    assert parts.fragment == f"resolution=6&net=0&camera={camera}"
    # The page has the same address now, without being stored again.
    page.wait_for_function("url => location.href === url", arg=url)
    other = open_profile(browser)
    show(other.page, url)
    assert other.page.evaluate(READ_CAMERA) == camera
    assert not other.page.is_checked("#show-net")
    assert other.page.input_value("#resolution") == "6"
    other.page.set_checked("#show-net", True)
    select_point(other.page, 4)
    assert read_point(other.page)[2] == 2.5
    assert other.messages == []
    other.page.context.close()


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "free"])
def test_a_link_keeps_the_plane_of_the_section(page: Page, browser: Browser, axis: str) -> None:
    page.check(f'input[name="section"][value="{axis}"]', force=True)
    if axis == "free":
        page.fill("#section-ny", "2")
    page.fill("#section-position", "0.25")
    page.press("#section-position", "Enter")
    page.check('input[name="section-shown"][value="below"]', force=True)
    section = {"x": "1,0,0,0.25", "free": "1,2,1,0.25"}[axis]
    address = f"?surface=saddle#resolution=6&section={section}&section_shown=below"
    wait_for_address(page, address)
    text = page.inner_text("#section-offset-value")
    other = open_profile(browser)
    show(other.page, copy_text(page, "copy-link"))
    assert other.page.is_checked(f'input[name="section"][value="{axis}"]')
    assert other.page.is_checked('input[name="section-shown"][value="below"]')
    assert other.page.input_value("#section-position") == "0.25"
    assert other.page.inner_text("#section-offset-value") == text
    other.page.wait_for_selector("#section-row:visible")
    # Back and Forward lead from plane to plane, and without a plane the address has none.
    other.page.click("#open")
    perform(other.page, lambda: other.page.click('[data-example="sphere"]'))
    other.page.check('input[name="section"][value="off"]', force=True)
    wait_for_address(other.page, "?surface=sphere#resolution=6")
    other.page.go_back()
    wait_for_address(other.page, address)
    other.page.wait_for_selector("#section-row:visible")
    assert other.page.input_value("#section-position") == "0.25"
    assert other.messages == []
    other.page.context.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "section", ["1,0,0", "0,0,0,1", "1,0,0,NaN", "x,0,0,1", "1,0,0,1,2", "1,0,0,", "1e400,0,0,1"]
)
def test_an_invalid_plane_in_an_address_counts_as_missing(
    stage: Stage, server: str, section: str
) -> None:
    stage.page.goto("about:blank")
    show(stage.page, f"{server}/?surface=saddle#resolution=6&section={section}")
    assert stage.page.is_checked('input[name="section"][value="off"]')


@pytest.mark.slow
def test_a_reload_keeps_the_camera_of_each_entry(page: Page) -> None:
    camera = turn(page)
    page.click("#open")
    perform(page, lambda: page.click('[data-example="sphere"]'))
    assert page.evaluate(READ_CAMERA) is None
    page.go_back()
    page.wait_for_selector('#title:has-text("Saddle")')
    page.wait_for_selector(READY)
    assert page.evaluate(READ_CAMERA) == camera
    page.reload()
    page.wait_for_selector(READY)
    page.wait_for_function(f"(camera) => {READ_CAMERA} === camera", arg=camera)


@pytest.mark.slow
@pytest.mark.parametrize(
    "fragment",
    [
        "view",
        "resolution=-3",
        "resolution=6&camera=1,2,3",
        "camera=1,2,3,1,2,3",
        "camera=1e99,0,0,0,0,0",
        "camera=NaN,0,0,0,0,1",
        "camera=0x10,0,0,0,0,1",
        "look=%FF&net=2&wires=yes&relative_tolerance=soon",
        "=",
        "&&&",
        "a=b=c",
        "<script>alert(1)</script>",
        "camera=" + "1," * 3000,
    ],
)
def test_an_invalid_fragment_is_as_none(stage: Stage, server: str, fragment: str) -> None:
    page = stage.page
    page.goto("about:blank")
    show(page, f"{server}/?surface=saddle#{fragment}")
    assert page.is_hidden("#problem")
    page.wait_for_function("() => !location.hash.includes('camera') && location.hash.length < 30")
    assert page.is_checked("#show-net")
    # It may also be typed while the page is open.
    page.evaluate("fragment => { location.hash = fragment; }", fragment)
    page.wait_for_function("() => !location.hash.includes('camera') && location.hash.length < 30")
    assert page.inner_text("#title") == "Saddle"


def test_the_address_in_the_documentation_opens_what_it_says(stage: Stage, server: str) -> None:
    text = (ROOT / "docs" / "editor.md").read_text(encoding="utf-8")
    (address,) = re.findall(r"http://127.0.0.1:8000(/\?surface=\S+)", text)
    page = stage.page
    show(page, server + address)
    assert page.inner_text("#title") == "Saddle"
    assert page.inner_text("#triangles") == "162"
    assert page.is_checked("#show-wires")
    assert page.is_checked('input[name="look"][value="normals"]')
    assert page.url == server + address
    # The table names all options of the address.
    names = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`.*?) \|", text, re.MULTILINE))))
    assert set(page.evaluate(LIST_OPTIONS)) <= names


def test_a_fragment_that_is_typed_changes_the_view(page: Page) -> None:
    page.evaluate("location.hash = 'resolution=9&wires=1&camera=1,2,3,0,0,0'")
    page.wait_for_selector("#triangles[value='162']")
    assert page.is_checked("#show-wires")
    assert page.evaluate(READ_CAMERA) == "1,2,3,0,0,0"
    page.go_back()
    page.wait_for_selector("#triangles[value='72']")


def test_the_link_to_the_view_leaves_the_address_as_it_is(page: Page) -> None:
    wait_for_address(page, "?surface=saddle#resolution=6")
    page.focus("#skip")
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "view"
    wait_for_address(page, "?surface=saddle#resolution=6")
