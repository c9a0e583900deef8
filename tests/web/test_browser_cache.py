"""A browser caches the mesh of a stored surface; the service records which requests it sends."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import httpx
import pytest
from playwright.sync_api import Page
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tests.web.clients import serve_site, visit
from tools.browser import Stage
from tools.live import run_service

SAIL = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}


@dataclass
class RecordingService:
    """A service that records requests for meshes.

    For each, `requests` has whether it had the header `If-None-Match`, and the response's status.
    """

    app: ASGIApp
    requests: list[tuple[bool, int]] = field(default_factory=list)
    url: str = ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def record_and_send(message: Message) -> None:
            if message["type"] == "http.response.start" and "/mesh." in scope["path"]:
                is_conditional = b"if-none-match" in dict(scope["headers"])
                self.requests.append((is_conditional, message["status"]))
            await send(message)

        await self.app(scope, receive, record_and_send)


@pytest.fixture(scope="module")
def service() -> Iterator[RecordingService]:
    services: list[RecordingService] = []

    def wrap(app: ASGIApp) -> ASGIApp:
        services.append(RecordingService(app))
        return services[0]

    with run_service(wrap=wrap) as url:
        services[0].url = url
        yield services[0]


@pytest.fixture(scope="module")
def links(service: RecordingService) -> dict[str, str]:
    """The URLs of the meshes of a stored surface, by suffix."""
    response = httpx.post(f"{service.url}/v1/surfaces", json={"surface": SAIL})
    return {suffix: service.url + link for suffix, link in response.json()["links"]["mesh"].items()}


EMPTY_PAGE = "<!doctype html><title>A page</title><link rel=icon href='data:,'>"
SCRIPTS = {
    "glb": "url => fetch(url).then((a) => a.arrayBuffer()).then((b) => b.byteLength)",
    "ply": """url => new Promise((resolve) => {
        const request = new XMLHttpRequest();
        request.open('GET', url);
        request.responseType = 'arraybuffer';
        request.onload = () => resolve(request.response.byteLength);
        request.send();
    })""",
}
"""Scripts that load a file and return its length, by the suffix of the file.

The first loads as three.js and model-viewer do, the second as Babylon.js does.
"""


@pytest.fixture(scope="module", params=SCRIPTS)
def page_with_mesh(
    request: pytest.FixtureRequest, service: RecordingService, links: dict[str, str], visitor: Stage
) -> Iterator[tuple[Page, str, str]]:
    """A page of another origin that has loaded the mesh once, its script, and the mesh's URL."""
    script, link = SCRIPTS[request.param], links[request.param]
    with serve_site({"/": EMPTY_PAGE}) as origin:
        visit(visitor, f"{origin}/")
        service.requests.clear()
        visitor.page.evaluate(script, link)
        assert service.requests == [(False, 200)]
        yield visitor.page, script, link


def test_a_second_load_sends_no_request(
    service: RecordingService, page_with_mesh: tuple[Page, str, str]
) -> None:
    page, script, link = page_with_mesh
    page.goto(page.url)
    content = httpx.get(link).content
    service.requests.clear()
    assert page.evaluate(script, link) == len(content)
    assert service.requests == []
    sizes = page.evaluate(
        "url => performance.getEntriesByName(url).map((e) => [e.transferSize, e.decodedBodySize])",
        link,
    )
    assert sizes == [[0, len(content)]]


def test_a_load_that_bypasses_the_cache_gets_304(
    service: RecordingService, page_with_mesh: tuple[Page, str, str]
) -> None:
    """The browser sends the entity tag itself, and gives its cached copy to the page."""
    service.requests.clear()
    page, _, link = page_with_mesh
    status, size = page.evaluate(
        """async (url) => {
            const response = await fetch(url, { cache: 'no-cache' });
            return [response.status, (await response.arrayBuffer()).byteLength];
        }""",
        link,
    )
    assert service.requests == [(True, 304)]
    assert (status, size) == (200, len(httpx.get(link).content))


def test_a_reload_by_the_user_gets_304(
    service: RecordingService, links: dict[str, str], visitor: Stage
) -> None:
    """The mesh itself is open in the browser, and the user presses the button to reload."""
    page = visitor.page
    service.requests.clear()
    page.goto(links["json"])
    page.reload()
    assert service.requests == [(False, 200), (True, 304)]
    assert page.locator("body").inner_text().startswith('{"vertices":')


def test_a_page_of_another_origin_can_fetch_a_file_that_a_visit_cached(
    service: RecordingService, links: dict[str, str], visitor: Stage
) -> None:
    """The cached response has the headers that let scripts of other origins read it."""
    with serve_site({"/": EMPTY_PAGE}) as origin:
        page = visitor.page
        page.goto(links["json"])
        page.goto(f"{origin}/")
        service.requests.clear()
        text = page.evaluate("url => fetch(url).then((response) => response.text())", links["json"])
        assert text.startswith('{"vertices":')
        assert service.requests == []
