"""One browser for all tests of this folder, because its start takes longer than most tests."""

from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser

from tests.web.clients import open_blank_page
from tools.browser import FOLDER, Stage, open_browser, open_page, open_viewer, serve_folder
from tools.editor import SADDLE, open_editor
from tools.programs import find_chromium, find_node_package


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Headless Chromium for all tests of this folder.

    It is closed before other tests run, because no event loop can start beside that of Playwright.
    """
    with open_browser(find_chromium()) as browser:
        yield browser


@pytest.fixture(scope="package")
def viewer(browser: Browser) -> Iterator[Stage]:
    """The viewer page, which stays open for all tests; without shadows (`?plain`), to save time."""
    find_node_package("three")
    with serve_folder(FOLDER) as pages:
        stage = open_page(browser)
        open_viewer(stage, pages, "?plain")
        yield stage


@pytest.fixture(scope="package")
def visitor(browser: Browser) -> Stage:
    """A page in which tests open other URLs; a new page for each test would take 0.5 s."""
    return open_blank_page(browser)


@pytest.fixture(scope="package")
def editor(server: str, browser: Browser) -> Iterator[Stage]:
    """The editor, which stays open for all tests and may send requests only to the service."""
    stage = open_editor(browser, server + SADDLE)
    yield stage
    hosts = {
        urlsplit(url).netloc
        for url in stage.requested_urls
        if not url.startswith(("blob:", "data:"))
    }
    assert hosts == {urlsplit(server).netloc}
    stage.page.context.close()


@pytest.fixture
def stage(viewer: Stage) -> Iterator[Stage]:
    """The viewer page for one test, during which its console must stay empty."""
    viewer.messages.clear()
    yield viewer
    assert viewer.messages == []
