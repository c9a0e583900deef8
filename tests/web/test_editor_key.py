"""If the service needs a key, the editor asks for the key, sends it, and does not store it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Request

from service.api.guard.keys import format_entry, make_key
from service.settings.values import Settings
from tests.test_readme import run_shell
from tests.web.test_page_access import list_violations
from tests.web.test_page_sharing import copy_text
from tools.browser import Stage
from tools.editor import READY, SADDLE, open_profile
from tools.live import run_service

KEY = make_key()


@pytest.fixture(scope="module")
def private_service() -> Iterator[str]:
    settings = Settings(api_keys=(format_entry("alice", KEY),), public_reads=False)
    with run_service(settings) as url:
        yield url


@pytest.fixture(scope="module")
def locked_editor(private_service: str, browser: Browser) -> Iterator[tuple[Stage, list[Request]]]:
    """The editor before a key is entered, with its dialog open; and its requests so far."""
    stage = open_profile(browser)
    requests: list[Request] = []

    def record(request: Request) -> None:  # Playwright does not accept `requests.append`
        requests.append(request)

    stage.page.on("request", record)
    stage.page.goto(private_service + SADDLE)
    stage.page.wait_for_selector("#access[open]")
    yield stage, requests
    stage.page.context.close()


def enter_key(page: Page, key: str) -> None:
    """Types a key into the dialog, and presses Enter."""
    page.fill("#access-key", key)
    page.press("#access-key", "Enter")


@pytest.mark.slow
def test_the_editor_asks_for_the_key_sends_it_and_does_not_store_it(
    locked_editor: tuple[Stage, list[Request]], tmp_path: Path
) -> None:
    stage, requests = locked_editor
    page = stage.page
    # The dialog is visible and announced, and works with the keyboard alone.
    assert "needs a key" in page.inner_text("#access-why")
    assert page.evaluate("document.activeElement.id") == "access-key"
    assert list_violations(page) == []
    # A text that is not a key is not sent; for an unknown key the dialog shows an error.
    request_count = len(requests)
    enter_key(page, "password")
    assert page.is_visible("#access")
    assert len(requests) == request_count
    enter_key(page, make_key())
    page.wait_for_selector("#access-why:has-text('does not know')")
    # A closed dialog does not open again by itself. The page says that a key is missing, and has a
    # button that opens the dialog.
    page.keyboard.press("Escape")
    page.wait_for_selector("#problem-key")
    assert page.inner_text("#problem-title") == "A key is needed"
    assert list_violations(page) == []
    page.click("#problem-key")
    enter_key(page, f" {KEY}\n")  # the page removes spaces and line breaks around a pasted key
    page.wait_for_selector(READY)
    assert page.is_hidden("#problem")
    assert page.inner_text("#triangles") == "72"
    sent_keys = [request.headers.get("authorization") for request in requests]
    assert f"Bearer {KEY}" in sent_keys

    # The tab keeps the key until it is closed.
    page.reload()
    page.wait_for_selector(READY)
    assert page.evaluate("Object.values(sessionStorage)") == [KEY]
    assert page.evaluate("[localStorage.length, document.cookie]") == [0, ""]

    # The copied command names a variable, never the key, and has the URL of the service. A note
    # (`#copied-private`) says that others need a key, too.
    for button in ("copy-link", "copy-snippet", "copy-curl"):
        assert KEY not in copy_text(page, button)
        assert page.is_visible("#copied-private")
    command = copy_text(page, "copy-curl").replace("curl", "curl -sf")
    assert '-H "Authorization: Bearer $SURFACE_KEY"' in command
    run_shell(f"SURFACE_KEY={KEY}; {command}", tmp_path)
    (file,) = tmp_path.iterdir()
    assert file.read_bytes().startswith(b"glTF")
    assert not [request.url for request in requests if KEY in request.url]
    assert KEY not in page.url

    # After the key is removed, the page asks for it again.
    page.click("#api-key")
    assert list_violations(page) == []
    page.click("#access-forget")
    assert page.evaluate("sessionStorage.length") == 0
    page.fill("#resolution", "7")
    page.wait_for_selector("#access[open]")
    enter_key(page, KEY)
    page.wait_for_selector(READY)
    assert page.inner_text("#triangles") == "98"
    # The browser itself writes a message for each response with the status 401.
    assert [message for message in stage.messages if "401" not in message] == []


def test_the_editor_of_a_service_without_keys_does_not_ask_for_a_key(editor: Stage) -> None:
    page = editor.page
    assert page.is_hidden("#access")
    assert page.is_hidden("#api-key")
    assert page.is_hidden("#copied-private")
    assert "Authorization" not in copy_text(page, "copy-curl")
    names: list[str] = page.evaluate("Object.keys(sessionStorage)")
    assert [name for name in names if not name.startswith("surface-tab")] == []
