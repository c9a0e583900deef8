"""Sharing from the editor: a link that opens the same surface elsewhere, a snippet, a
command; and that the editor sends requests to the service only."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from tests.test_readme import run_shell
from tests.web.browser import FILL_PIXELS, Stage
from tests.web.clients import read_meshes, serve_site, visit
from tests.web.editor import READY, choose, drag, open_editor, read_point, read_value, start_anew

VIEWER = """<!doctype html><html lang="en"><title>A shop</title><link rel="icon" href="data:,">
<script type="module" src="/node_modules/@google/model-viewer/dist/model-viewer.min.js"></script>
"""


@pytest.fixture(scope="module")
def edited(editor: Stage) -> Iterator[Page]:
    """The saddle by a tolerance, with one of its corners dragged away."""
    page = editor.page
    start_anew(page)
    page.check('input[name="accuracy"][value="tolerance"]', force=True)
    page.wait_for_selector(READY)
    before = [read_value(page, name) for name in ("triangles", "deviation", "bytes")]
    picture = take_picture(editor)
    editor.complaints.clear()
    drag(page, choose(page, 4), (90, -70))
    after = [read_value(page, name) for name in ("triangles", "deviation", "bytes")]
    assert all(was != now for was, now in zip(before, after, strict=True)), (before, after)
    assert (np.abs(take_picture(editor) - picture).max(axis=1) > 30).mean() > 0.02
    yield page
    assert editor.complaints == []


def take_picture(stage: Stage) -> NDArray[np.int64]:
    """Hides the control net, whose look depends on the mouse."""
    stage.page.evaluate(FILL_PIXELS)
    stage.page.set_checked("#show-net", False)
    picture = stage.picture()
    stage.page.set_checked("#show-net", True)
    stage.page.evaluate("document.querySelector('#view').getContext('webgl2')")
    return picture


def copy_text(page: Page, button: str) -> str:
    """The text that a button has copied, or shows for copying."""
    page.locator("#copied").evaluate("place => place.replaceChildren()")
    page.click(f"#{button}")
    page.wait_for_selector("#copied:not(:empty)")
    return page.inner_text("#copied").removeprefix("Copied: ")


def test_the_link_opens_an_equal_surface_in_a_fresh_profile(
    edited: Page, server: str, browser: Browser
) -> None:
    address = copy_text(edited, "copy-link")
    assert address.startswith(f"{server}/?surface=")
    fresh = open_editor(browser, address)
    for name in ("triangles", "vertices", "bytes", "deviation"):
        assert read_value(fresh.page, name) == read_value(edited, name)
    choose(fresh.page, 4)
    assert read_point(fresh.page) == read_point(edited)
    assert fresh.page.is_checked('input[name="accuracy"][value="tolerance"]')
    assert {urlsplit(url).netloc for url in fresh.asked} == {urlsplit(server).netloc}
    assert fresh.complaints == []
    fresh.page.context.close()


def test_the_snippet_draws_it_on_a_page_of_another_origin(edited: Page, visitor: Stage) -> None:
    with serve_site({"/": VIEWER + copy_text(edited, "copy-snippet")}) as origin:
        visit(visitor, f"{origin}/")
        (mesh,) = read_meshes(visitor)
        assert len(mesh["triangles"]) == 3 * read_value(edited, "triangles")
        assert len(mesh["positions"]) == read_value(edited, "vertices")
        assert visitor.complaints == []


def test_the_command_writes_the_file(edited: Page, tmp_path: Path) -> None:
    command = copy_text(edited, "copy-curl")
    run_shell(command.replace("curl", "curl -s"), tmp_path)
    (written,) = tmp_path.iterdir()
    assert written.name in shlex.split(command)
    assert written.stat().st_size == read_value(edited, "bytes")
