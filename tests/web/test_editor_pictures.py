"""Pictures in the list of examples: drawn by the service when the list is open, and decoration."""

from collections.abc import Iterator
from time import monotonic
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from service.api.guard.keys import format_entry, make_key
from service.engine.mesh.mesh import ENGINE
from service.settings.values import Settings
from service.surface.examples.catalogue import EXAMPLES
from tools.browser import Stage
from tools.editor import READY, SADDLE, open_profile, show
from tools.live import run_service

KEY = make_key()
LIST_PICTURES = """() => [...document.querySelectorAll('#examples img')].map((image) => ({
    id: image.dataset.picture, alt: image.getAttribute('alt'), loading: image.loading,
    size: [image.getAttribute('width'), image.getAttribute('height')], source: image.currentSrc,
    isShown: image.complete && image.naturalWidth === 192 && image.naturalHeight === 128,
}))"""


def list_pictures(page: Page) -> list[dict[str, Any]]:
    """The pictures of the examples, in the order of the list."""
    pictures: list[dict[str, Any]] = page.evaluate(LIST_PICTURES)
    return pictures


def wait_for_pictures(page: Page, part: slice) -> list[dict[str, Any]]:
    """The pictures in a part of the list, as soon as they are shown."""
    deadline = monotonic() + 60
    while True:
        pictures = list_pictures(page)[part]
        if all(each["isShown"] for each in pictures):
            return pictures
        assert monotonic() < deadline, pictures
        page.wait_for_timeout(50)


@pytest.fixture
def stage(browser: Browser) -> Iterator[Stage]:
    stage = open_profile(browser)
    yield stage
    stage.page.context.close()


def test_the_list_of_examples_has_pictures_that_load_when_it_is_open(
    stage: Stage, server: str
) -> None:
    page = stage.page
    show(page, server + SADDLE)
    assert not [url for url in stage.requested_urls if "/image.png" in url]
    before = list_pictures(page)
    assert [each["id"] for each in before] == list(EXAMPLES)
    assert {(each["alt"], each["loading"], *each["size"]) for each in before} == {
        ("", "lazy", "192", "128")
    }
    page.click("#open")
    boxes = "[...document.querySelectorAll('#examples button')].map((each) => each.offsetHeight)"
    heights = page.evaluate(boxes)
    after = wait_for_pictures(page, slice(0, 3))
    assert page.evaluate(boxes) == heights, "the list does not move while pictures come"
    path = f"image.png?width=192&height=128&engine={ENGINE}"
    for each in after:
        assert each["source"] == f"{server}/v1/surfaces/{each['id']}/{path}"
    assert stage.messages == []


@pytest.mark.slow
def test_a_picture_that_does_not_come_leaves_its_place_empty(stage: Stage, server: str) -> None:
    page = stage.page
    show(page, server + SADDLE)
    page.route("**/utah-teapot/image.png*", lambda route: route.fulfill(status=503))
    page.click("#open")
    wait_for_pictures(page, slice(1, 3))
    assert page.locator("#examples img").first.get_attribute("src") is None
    # When the list is opened again, the page asks again.
    page.unroute_all()
    page.keyboard.press("Escape")
    page.click("#open")
    wait_for_pictures(page, slice(0, 1))


@pytest.mark.slow
def test_with_private_reads_only_a_page_with_a_key_shows_pictures(stage: Stage) -> None:
    settings = Settings(api_keys=(format_entry("alice", KEY),), public_reads=False)
    with run_service(settings) as url:
        page = stage.page
        page.goto(url + SADDLE)
        page.wait_for_selector("#access[open]")
        page.keyboard.press("Escape")
        page.click("#open")
        page.wait_for_timeout(500)
        assert not [url for url in stage.requested_urls if "/image.png" in url]
        page.keyboard.press("Escape")
        page.click("#problem-key")
        page.fill("#access-key", KEY)
        page.press("#access-key", "Enter")
        page.wait_for_selector(READY)
        page.click("#open")
        assert wait_for_pictures(page, slice(0, 3))[0]["source"].startswith("blob:")
        assert not [url for url in stage.requested_urls if KEY in url]
