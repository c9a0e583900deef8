"""The documentation page in a browser: requests can be tried, and it uses no other host."""

from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser

from service.api.routes.pages import STATIC, SWAGGER
from tests.web.browser import open_page


def test_a_request_can_be_tried_without_connections_to_other_hosts(
    server: str, browser: Browser
) -> None:
    if not (STATIC / SWAGGER[0]).is_file():
        pytest.skip("the scripts of /docs are not built ('make web')")
    stage = open_page(browser)
    page = stage.page
    page.goto(f"{server}/docs")
    # For /v1/mesh the page needs twice the time, for its schemas and examples.
    operation = page.get_by_text("/v1/curve", exact=True).first
    prose = page.locator("h2:has-text('About all operations')")
    tops = [place.evaluate("it => it.getBoundingClientRect().top") for place in (operation, prose)]
    assert tops == sorted(tops), "the operations come first"
    assert page.get_by_text("malformed_json", exact=True).count() == 1
    operation.click()
    page.click(".try-out__btn")
    page.click(".execute")
    response = page.locator(".live-responses-table .response-col_status").last
    response.wait_for()
    assert response.inner_text().strip() == "200"
    page.close()
    assert stage.complaints == []
    hosts = {urlsplit(url).netloc for url in stage.asked if not url.startswith("data:")}
    assert hosts == {urlsplit(server).netloc}
