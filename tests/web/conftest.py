"""One browser for all tests of this folder, because its start takes longer than most tests."""

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, Route

from tests.web.clients import open_blank_page, visit
from tools.browser import FOLDER, Stage, open_browser, open_page, open_viewer, serve_folder
from tools.editor import SADDLE, open_editor
from tools.page_build import build_modules
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
def module_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with every module of the editor by its own name; the service has only bundles."""
    return build_modules(tmp_path_factory.mktemp("modules"))


@pytest.fixture(scope="module")
def modules(server: str, visitor: Stage, module_folder: Path) -> Iterator[Page]:
    """A page of the service without scripts, which may import single modules of the editor.

    Their URLs are those of their names: `await import('/page/net.js')`.
    """

    def respond(route: Route) -> None:
        path = module_folder / urlsplit(route.request.url).path.rpartition("/")[2]
        route.fulfill(path=path, content_type="text/javascript")

    visit(visitor, f"{server}/health")
    visitor.page.route("**/page/*.js", respond)
    yield visitor.page
    visitor.page.unroute("**/page/*.js", respond)


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
