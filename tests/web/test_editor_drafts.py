"""Drafts of the editor: after a reload, a crash, or another surface, every edit is still there."""

from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from service.api.guard.keys import format_entry, make_key
from service.settings.values import Settings
from tests.web.test_page_access import list_violations
from tools.browser import Stage, record_page
from tools.editor import READY, SADDLE, WINDOW, open_profile, read_point, select_point, show
from tools.live import run_service

LIST_DRAFTS = """() => new Promise((resolve) => {
    const request = indexedDB.open('surface-drafts', 1);
    request.onupgradeneeded = () => {
        request.result.createObjectStore('drafts', { keyPath: 'id' });
        request.result.createObjectStore('texts');
    };
    request.onsuccess = () => {
        const database = request.result;
        const all = database.transaction('drafts').objectStore('drafts').getAll();
        all.onsuccess = () => { database.close(); resolve(all.result); };
    };
})"""
"""The records of all drafts on the device."""

DROP = """(text) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([text], 'dropped.json', { type: 'application/json' }));
    dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, cancelable: true }));
}"""
"""Drops a file with a text on the page."""

FILL_UP = """() => {
    const { put } = IDBObjectStore.prototype;
    IDBObjectStore.prototype.put = function (...values) {
        this.transaction.abort();
        throw new DOMException('full', 'QuotaExceededError');
    };
    Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); };
}"""
"""Lets a page find no room in IndexedDB and in the storage of the tab."""


@pytest.fixture
def stage(server: str, browser: Browser) -> Iterator[Stage]:
    """The editor with the saddle, in a new profile without drafts; its console must stay empty."""
    stage = open_profile(browser)
    show(stage.page, server + SADDLE)
    yield stage
    assert stage.messages == []
    stage.page.context.close()


@pytest.fixture
def page(stage: Stage) -> Page:
    return stage.page


def type_z(page: Page, value: float, number: int = 4) -> None:
    """Enters the z coordinate of a control point."""
    select_point(page, number)
    page.fill("#z", str(value))
    page.press("#z", "Enter")


def read_z(page: Page, number: int = 4) -> float:
    select_point(page, number)
    return read_point(page)[2]


def wait_for_drafts(page: Page, edits: list[int]) -> list[dict[str, Any]]:
    """Waits until the device has drafts with these numbers of edits, in any order."""
    for _ in range(100):
        drafts: list[dict[str, Any]] = page.evaluate(LIST_DRAFTS)
        if sorted(draft["edits"] for draft in drafts) == sorted(edits):
            return drafts
        page.wait_for_timeout(50)
    raise AssertionError([draft["edits"] for draft in drafts])


def open_page(context: BrowserContext, url: str) -> Page:
    """The editor in another tab of the same profile."""
    page = context.new_page()
    page.set_viewport_size(WINDOW)
    stage = record_page(page)
    page.goto(url)
    page.wait_for_selector(READY)
    assert stage.messages == []
    return page


@pytest.mark.slow
def test_a_reload_keeps_every_edit_with_the_steps_of_its_history(page: Page) -> None:
    """Also the number that is typed last, but not entered, and steps that were undone."""
    type_z(page, 1.75)
    type_z(page, 2.5)
    type_z(page, 3)
    page.click("#undo")
    page.reload()
    page.wait_for_selector(READY)
    assert page.inner_text("#title") == "Saddle"
    assert page.is_visible("#edited")
    assert read_z(page) == 2.5
    page.click("#redo")
    assert read_z(page) == 3
    page.fill("#x", "7")
    page.reload()
    page.wait_for_selector(READY)
    assert read_z(page) == 3
    assert read_point(page)[0] == 7
    for z in (3, 2.5, 1.75, 1):
        page.click("#undo")
        assert read_z(page) == z
    assert page.is_disabled("#undo")
    assert page.is_hidden("#edited")
    (draft,) = wait_for_drafts(page, [0])
    assert draft["about"]["title"] == "Saddle"


@pytest.mark.slow
def test_after_a_crash_another_tab_is_offered_the_draft(page: Page, server: str) -> None:
    type_z(page, 1.75)
    type_z(page, 2.5)
    wait_for_drafts(page, [2])
    context = page.context
    page.close(run_before_unload=False)
    other = open_page(context, server + "/?surface=sphere")
    other.wait_for_selector("#offer:visible")
    assert "a draft of Saddle, with 2 edits" in other.inner_text("#offer-text")
    assert list_violations(other) == []
    other.click("#offer-act")
    other.wait_for_selector('#title:has-text("Saddle")')
    assert other.is_visible("#offer")  # the sphere can be had back
    assert read_z(other) == 2.5
    other.click("#undo")
    assert read_z(other) == 1.75
    # It is the draft that the closed tab had, not a copy.
    wait_for_drafts(other, [1])


@pytest.mark.slow
def test_two_tabs_have_a_draft_each_and_a_duplicate_gets_its_own(page: Page, server: str) -> None:
    type_z(page, 1.75)
    other = open_page(page.context, server + SADDLE)
    assert other.is_hidden("#offer")  # the draft is open in the first tab
    type_z(other, 9)
    type_z(other, 8)
    wait_for_drafts(page, [1, 2])
    # A duplicated tab has the storage and the entry of the history of the first.
    state = page.evaluate("[{ ...sessionStorage }, history.state]")
    duplicate = page.context.new_page()
    duplicate.set_viewport_size(WINDOW)
    duplicate.add_init_script(
        f"""if (!sessionStorage.getItem('surface-tab')) {{
            const [storage, state] = {state!r};
            Object.entries(storage).forEach(([key, value]) => sessionStorage.setItem(key, value));
            history.replaceState(state, '');
        }}"""
    )
    show(duplicate, server + "/")
    assert read_z(duplicate) == 1.75
    type_z(duplicate, 4)
    type_z(duplicate, 5)
    wait_for_drafts(page, [1, 2, 3])
    assert len({draft["tab"] for draft in page.evaluate(LIST_DRAFTS)}) == 3
    assert read_z(page) == 1.75
    page.reload()
    page.wait_for_selector(READY)
    assert read_z(page) == 1.75
    wait_for_drafts(page, [1, 2, 3])


def test_a_tab_in_a_slow_browser_is_known_to_other_tabs(page: Page) -> None:
    """Every wait of limited time ends at once. A lock says that the draft is open in this tab."""
    page.evaluate("AbortSignal.timeout = () => AbortSignal.abort()")
    type_z(page, 1.75)
    (draft,) = wait_for_drafts(page, [1])
    names = page.evaluate("navigator.locks.query().then(({ held }) => held.map((l) => l.name))")
    assert names == [f"surface-tab-{draft['tab']}"]


@pytest.mark.slow
def test_opening_another_surface_is_undone_by_a_button_and_by_back(page: Page) -> None:
    type_z(page, 1.75)
    page.click("#open")
    page.click('[data-example="sphere"]')
    page.wait_for_selector("#offer:visible")
    assert page.inner_text("#offer-text") == "Opened in place of Saddle."
    page.wait_for_selector(READY)
    assert list_violations(page) == []
    page.click("#offer-act")
    page.wait_for_selector('#title:has-text("Saddle")')
    assert page.is_hidden("#offer")
    assert read_z(page) == 1.75
    page.click("#undo")
    assert read_z(page) == 1
    page.click("#redo")
    # A surface of the user has no address, but an entry, too.
    page.click("#open")
    page.fill("#paste", '{"name": "mine", "control_net": [[[0,0,0],[0,1,0]],[[1,0,0],[1,1,3]]]}')
    page.click("#paste-open")
    page.wait_for_selector('#title:has-text("mine")')
    page.wait_for_selector(READY)
    wait_for_drafts(page, [0, 1])
    page.click("#help")
    page.go_back()
    page.wait_for_selector('#title:has-text("Saddle")')
    assert page.is_hidden("#guide")
    assert read_z(page) == 1.75
    page.go_forward()
    page.wait_for_selector('#title:has-text("mine")')
    page.reload()
    page.wait_for_selector('#title:has-text("mine")')
    page.wait_for_selector(READY)
    assert read_z(page) == 3
    # If the draft was forgotten, another surface is open after a reload, and the page says why.
    page.click("#open")
    page.click("#drafts-forget")
    page.click("#forget button[value=forget]")
    page.wait_for_selector("#drafts-forget", state="hidden")
    page.reload()
    page.wait_for_selector('#offer-text:has-text("no longer kept")')
    assert page.inner_text("#title") == "Utah teapot"
    page.click("#offer-act")
    page.wait_for_selector("#library[open]")


@pytest.mark.slow
def test_dropping_a_file_is_undone_and_nothing_is_stored_in_the_service(stage: Stage) -> None:
    page, posted = stage.page, []
    page.on("request", lambda request: posted.append((request.method, urlsplit(request.url).path)))
    type_z(page, 1.75)
    page.evaluate(DROP, '{"name": "dropped", "control_net": [[[0,0,0],[0,1,0]],[[1,0,0],[1,1,3]]]}')
    page.wait_for_selector('#title:has-text("dropped")')
    type_z(page, 5)
    wait_for_drafts(page, [1, 1])
    page.reload()
    page.wait_for_selector('#title:has-text("dropped")')
    page.wait_for_selector(READY)
    assert read_z(page) == 5
    page.go_back()
    page.wait_for_selector('#title:has-text("Saddle")')
    assert read_z(page) == 1.75
    page.go_forward()
    page.wait_for_selector('#title:has-text("dropped")')
    assert read_z(page) == 5
    assert ("POST", "/v1/mesh") in posted
    assert ("POST", "/v1/surfaces") not in posted


@pytest.mark.slow
def test_drafts_are_listed_opened_and_forgotten_by_keyboard(page: Page) -> None:
    type_z(page, 1.75)
    page.click("#open")
    page.click('[data-example="sphere"]')
    page.wait_for_selector('#title:has-text("Sphere")')
    type_z(page, 0.5)
    type_z(page, 0.25)
    wait_for_drafts(page, [1, 2])
    page.click("#open")
    page.wait_for_selector("#draft-list li:nth-child(2)")
    texts = page.locator("#draft-list button").all_inner_texts()
    assert texts == ["Sphere\n2 edits, just now", "Saddle\n1 edit, just now"]
    assert "on this device only" in page.inner_text("#drafts-place")
    assert page.is_hidden("#drafts-keep-switch")
    assert list_violations(page) == []
    page.locator("#draft-list button").nth(1).press("Enter")
    page.wait_for_selector('#title:has-text("Saddle")')
    assert page.inner_text("#offer-text") == "Opened in place of Sphere."
    assert read_z(page) == 1.75
    page.click("#open")
    page.wait_for_selector("#drafts-forget:visible")
    page.press("#drafts-forget", "Enter")
    page.wait_for_selector("#forget[open]")
    assert list_violations(page) == []
    page.keyboard.press("Enter")  # the first button keeps them
    page.wait_for_selector("#forget", state="hidden")
    assert len(page.evaluate(LIST_DRAFTS)) == 2
    page.press("#drafts-forget", "Enter")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_selector("#drafts-forget", state="hidden")
    assert page.evaluate(LIST_DRAFTS) == []
    assert page.locator("#draft-list button").count() == 0
    page.keyboard.press("Escape")
    # The open surface stays, and its next edit begins another draft, with all steps.
    type_z(page, 2.5)
    wait_for_drafts(page, [2])
    page.reload()
    page.wait_for_selector(READY)
    assert read_z(page) == 2.5


def test_without_room_the_page_says_so_and_asks_before_it_is_left(page: Page) -> None:
    page.evaluate(FILL_UP)
    type_z(page, 1.75)
    page.wait_for_selector("#edited:has-text('not kept')")
    questions: list[str] = []

    def leave(dialog: Any) -> None:
        questions.append(dialog.type)
        dialog.accept()

    page.on("dialog", leave)
    page.reload()
    page.wait_for_selector(READY)
    assert questions == ["beforeunload"]
    assert read_z(page) == 1


@pytest.mark.slow
def test_without_indexeddb_drafts_stay_in_the_tab(server: str, browser: Browser) -> None:
    stage = open_profile(browser)
    page = stage.page
    page.add_init_script("IDBFactory.prototype.open = () => { throw new Error('private'); };")
    show(page, server + SADDLE)
    type_z(page, 1.75)
    page.reload()
    page.wait_for_selector(READY)
    assert read_z(page) == 1.75
    page.click("#open")
    page.wait_for_selector("#draft-list button")
    assert "this browser keeps nothing on the device" in page.inner_text("#drafts-place")
    assert stage.messages == []
    page.context.close()


@pytest.mark.slow
def test_while_a_key_is_in_use_drafts_stay_in_the_tab_unless_they_are_to_be_kept(
    browser: Browser,
) -> None:
    key = make_key()
    settings = Settings(api_keys=(format_entry("alice", key),), public_reads=False)
    with run_service(settings) as server:
        stage = open_profile(browser)
        page = stage.page
        page.goto(server + SADDLE)
        page.fill("#access-key", key)
        page.press("#access-key", "Enter")
        page.wait_for_selector(READY)
        type_z(page, 1.75)
        page.reload()
        page.wait_for_selector(READY)
        assert read_z(page) == 1.75
        assert page.evaluate(LIST_DRAFTS) == []
        assert page.evaluate("localStorage.length") == 0
        page.click("#open")
        page.wait_for_selector("#draft-list button")
        assert "in this tab only, because an API key is in use" in page.inner_text("#drafts-place")
        assert list_violations(page) == []
        page.check("#drafts-keep")
        wait_for_drafts(page, [1])
        assert "surface-draft:" not in page.evaluate("Object.keys(sessionStorage).join()")
        page.uncheck("#drafts-keep")
        wait_for_drafts(page, [])
        page.keyboard.press("Escape")
        # Without the key, too, what was edited with it stays in the tab.
        page.click("#api-key")
        page.click("#access-forget")
        page.reload()
        page.wait_for_selector("#access[open]")
        assert page.evaluate(LIST_DRAFTS) == []
        page.context.close()
