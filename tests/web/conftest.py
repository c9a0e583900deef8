"""One browser for all tests of this folder, because starting one takes longer than most tests."""

from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser

from tests.programs import find_chromium, find_node_package
from tests.web.browser import FOLDER, Stage, open_browser, open_page, open_viewer, serve_folder
from tests.web.clients import open_blank_page
from tests.web.editor import SADDLE, open_editor


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Headless Chromium, closed after these tests, because no event loop can start beside
    Playwright's."""
    with open_browser(find_chromium()) as browser:
        yield browser


@pytest.fixture(scope="package")
def viewer(browser: Browser) -> Iterator[Stage]:
    """The page that draws models, kept open."""
    find_node_package("three")
    with serve_folder(FOLDER) as pages:
        stage = open_page(browser)
        open_viewer(stage, pages, "?plain")
        yield stage


@pytest.fixture(scope="package")
def visitor(browser: Browser) -> Stage:
    """A page for all tests that open other pages, because a new page takes 0.5 s of CPU time."""
    return open_blank_page(browser)


@pytest.fixture(scope="package")
def editor(server: str, browser: Browser) -> Iterator[Stage]:
    """The editor, kept open; checks that it sends requests to the service only."""
    stage = open_editor(browser, server + SADDLE)
    yield stage
    hosts = {urlsplit(url).netloc for url in stage.asked if not url.startswith(("blob:", "data:"))}
    assert hosts == {urlsplit(server).netloc}
    stage.page.context.close()


@pytest.fixture
def stage(viewer: Stage) -> Iterator[Stage]:
    """The shared page for one test, in which its console must stay silent."""
    viewer.complaints.clear()
    yield viewer
    assert viewer.complaints == []
