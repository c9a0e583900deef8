"""A browser's cache of a stored surface's mesh: the server counts the requests."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import httpx
import pytest
from playwright.sync_api import Page
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tests.live import run_service
from tests.web.browser import Stage
from tests.web.clients import serve_site, visit

SAIL = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}


@dataclass
class Watched:
    """A service that records its requests for meshes: whether each had a condition, and the status
    of its response."""

    app: ASGIApp
    seen: list[tuple[bool, int]] = field(default_factory=list)
    url: str = ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start" and "/mesh." in scope["path"]:
                conditional = b"if-none-match" in dict(scope["headers"])
                self.seen.append((conditional, message["status"]))
            await send(message)

        await self.app(scope, receive, sent)


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    built: list[Watched] = []

    def around(app: ASGIApp) -> ASGIApp:
        built.append(Watched(app))
        return built[0]

    with run_service(wrap=around) as url:
        built[0].url = url
        yield built[0]


@pytest.fixture(scope="module")
def links(watched: Watched) -> dict[str, str]:
    """The URLs of the meshes of a stored surface."""
    response = httpx.post(f"{watched.url}/v1/surfaces", json={"surface": SAIL})
    return {suffix: watched.url + link for suffix, link in response.json()["links"]["mesh"].items()}


EMPTY = "<!doctype html><title>A page</title><link rel=icon href='data:,'>"
LOADS = {
    "glb": "url => fetch(url).then((a) => a.arrayBuffer()).then((b) => b.byteLength)",
    "ply": """url => new Promise((resolve) => {
        const asked = new XMLHttpRequest();
        asked.open('GET', url);
        asked.responseType = 'arraybuffer';
        asked.onload = () => resolve(asked.response.byteLength);
        asked.send();
    })""",
}
"""Scripts that load a file and return its length, by the suffix of the file: as three.js and
model-viewer load files, and as Babylon.js does."""


@pytest.fixture(scope="module", params=LOADS)
def loaded(
    request: pytest.FixtureRequest, watched: Watched, links: dict[str, str], visitor: Stage
) -> Iterator[tuple[Page, str, str]]:
    """A page of another origin that has loaded the mesh once, its script, and the URL."""
    load, link = LOADS[request.param], links[request.param]
    with serve_site({"/": EMPTY}) as origin:
        visit(visitor, f"{origin}/")
        watched.seen.clear()
        visitor.page.evaluate(load, link)
        assert watched.seen == [(False, 200)]
        yield visitor.page, load, link


def test_a_second_load_sends_no_request(watched: Watched, loaded: tuple[Page, str, str]) -> None:
    page, load, link = loaded
    page.goto(page.url)
    content = httpx.get(link).content
    watched.seen.clear()
    assert page.evaluate(load, link) == len(content)
    assert watched.seen == []
    sizes = page.evaluate(
        "url => performance.getEntriesByName(url).map((e) => [e.transferSize, e.decodedBodySize])",
        link,
    )
    assert sizes == [[0, len(content)]]


def test_a_load_that_asks_the_server_gets_304(
    watched: Watched, loaded: tuple[Page, str, str]
) -> None:
    """The browser adds the condition itself, and gives its copy to the page."""
    watched.seen.clear()
    page, _, link = loaded
    status, size = page.evaluate(
        """async (url) => {
            const response = await fetch(url, { cache: 'no-cache' });
            return [response.status, (await response.arrayBuffer()).byteLength];
        }""",
        link,
    )
    assert watched.seen == [(True, 304)]
    assert (status, size) == (200, len(httpx.get(link).content))


def test_a_reload_gets_304(watched: Watched, links: dict[str, str], visitor: Stage) -> None:
    """Reloads a mesh that is open in the browser, as the browser's button does."""
    page = visitor.page
    watched.seen.clear()
    page.goto(links["json"])
    page.reload()
    assert watched.seen == [(False, 200), (True, 304)]
    assert page.locator("body").inner_text().startswith('{"vertices":')


def test_a_page_of_another_origin_can_fetch_a_visited_file(
    watched: Watched, links: dict[str, str], visitor: Stage
) -> None:
    """A script may read a file that is cached because it was visited: its headers allow it."""
    with serve_site({"/": EMPTY}) as origin:
        page = visitor.page
        watched.seen.clear()
        page.goto(links["json"])
        page.goto(f"{origin}/")
        text = page.evaluate("url => fetch(url).then((response) => response.text())", links["json"])
        assert text.startswith('{"vertices":')
        assert {status for _, status in watched.seen} <= {200, 304}
