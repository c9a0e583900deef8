"""Swagger UI in a browser: it sends requests to the service, and to no other host."""

from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser

from service.api.page_files import STATIC, SWAGGER
from tools.browser import open_page


@pytest.mark.slow
def test_swagger_ui_sends_a_request_and_connects_to_no_other_host(
    server: str, browser: Browser
) -> None:
    if not (STATIC / SWAGGER[0]).is_file():
        pytest.skip("the scripts of /docs are not built ('make web')")
    stage = open_page(browser)
    page = stage.page
    page.goto(f"{server}/docs")
    # The page needs twice the time for /v1/mesh, which has more schemas and examples.
    operation = page.get_by_text("/v1/curve", exact=True).first
    description = page.locator("h2:has-text('About all operations')")
    script = "element => element.getBoundingClientRect().top"
    tops = [element.evaluate(script) for element in (operation, description)]
    assert tops == sorted(tops), "the operations must stand above the description"
    # The description lists the codes of errors, each once.
    assert page.get_by_text("malformed_json", exact=True).count() == 1
    operation.click()
    page.click(".try-out__btn")
    page.click(".execute")
    response = page.locator(".live-responses-table .response-col_status").last
    response.wait_for()
    assert response.inner_text().strip() == "200"
    page.close()
    assert stage.messages == []
    hosts = {urlsplit(url).netloc for url in stage.requested_urls if not url.startswith("data:")}
    assert hosts == {urlsplit(server).netloc}
