"""The documentation page in a browser: requests can be tried there, and no other host is asked."""

from urllib.parse import urlsplit

import pytest

from service.api.docs import ASSETS
from tests.tools import chromium
from tests.web.browser import open_page


def test_a_request_can_be_tried_and_no_other_host_is_asked(server: str) -> None:
    if not (ASSETS / "swagger-ui-bundle.js").is_file():
        pytest.skip("the scripts of /docs are not built ('make web')")
    asked: list[str] = []
    with open_page(chromium()) as (page, complaints):
        page.on("request", lambda request: asked.append(request.url))
        page.goto(f"{server}/docs")
        page.get_by_text("/v1/mesh", exact=True).first.click()
        page.get_by_role("button", name="Try it out").click()
        page.get_by_role("button", name="Execute").click()
        answer = page.locator(".live-responses-table .response-col_status").last
        answer.wait_for()
        assert answer.inner_text().strip() == "200"
    assert complaints == []
    hosts = {urlsplit(url).netloc for url in asked if not url.startswith("data:")}
    assert hosts == {urlsplit(server).netloc}
