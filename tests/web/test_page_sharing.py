"""Sharing a surface from the editor: by a link, by HTML for another page, and by a command."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from tests.test_readme import run_shell
from tests.web.clients import read_meshes, serve_site, visit
from tools.browser import FILL_PIXELS_SCRIPT, Stage
from tools.editor import (
    READY,
    drag,
    open_editor,
    read_point,
    read_value,
    reset_editor,
    select_point,
)

VIEWER = """<!doctype html><html lang="en"><title>A shop</title><link rel="icon" href="data:,">
<script type="module" src="/node_modules/@google/model-viewer/dist/model-viewer.min.js"></script>
"""


@pytest.fixture(scope="module")
def edited(editor: Stage) -> Iterator[Page]:
    """The editor with a mesh of the saddle by tolerance; one corner of the saddle was dragged."""
    page = editor.page
    reset_editor(page)
    page.check('input[name="accuracy"][value="tolerance"]', force=True)
    page.wait_for_selector(READY)
    old_values = [read_value(page, name) for name in ("triangles", "deviation", "bytes")]
    picture = take_picture(editor)
    editor.messages.clear()
    drag(page, select_point(page, 4), (90, -70))
    new_values = [read_value(page, name) for name in ("triangles", "deviation", "bytes")]
    assert all(old != new for old, new in zip(old_values, new_values, strict=True))
    # The picture changes visibly: at least 2 % of its pixels change by more than 30 of 255 steps.
    changes = np.abs(take_picture(editor) - picture).max(axis=1)
    assert (changes > 30).mean() > 0.02
    yield page
    assert editor.messages == []


def take_picture(stage: Stage) -> NDArray[np.int64]:
    """A picture without the control net, whose look depends on the mouse.

    The page of the editor fills pixels only while this function runs, to save time.
    """
    stage.page.evaluate(FILL_PIXELS_SCRIPT)
    stage.page.set_checked("#show-net", False)
    picture = stage.take_picture()
    stage.page.set_checked("#show-net", True)
    # After a call of `getContext` the page again fills no pixels.
    stage.page.evaluate("document.querySelector('#view').getContext('webgl2')")
    return picture


def copy_text(page: Page, button: str) -> str:
    """The text that a click on this button copies."""
    page.locator("#copied").evaluate("element => element.replaceChildren()")
    page.click(f"#{button}")
    page.wait_for_selector("#copied:not(:empty)")
    return page.inner_text("#copied").removeprefix("Copied: ")


def test_the_link_opens_an_equal_surface_in_another_profile(
    edited: Page, server: str, browser: Browser
) -> None:
    url = copy_text(edited, "copy-link")
    assert url.startswith(f"{server}/?surface=")
    other_editor = open_editor(browser, url)
    for name in ("triangles", "vertices", "bytes", "deviation"):
        assert read_value(other_editor.page, name) == read_value(edited, name)
    select_point(other_editor.page, 4)
    assert read_point(other_editor.page) == read_point(edited)
    assert other_editor.page.is_checked('input[name="accuracy"][value="tolerance"]')
    assert {urlsplit(url).netloc for url in other_editor.requested_urls} == {
        urlsplit(server).netloc
    }
    assert other_editor.messages == []
    other_editor.page.context.close()


def test_the_copied_html_draws_the_surface_on_a_page_of_another_origin(
    edited: Page, visitor: Stage
) -> None:
    with serve_site({"/": VIEWER + copy_text(edited, "copy-snippet")}) as origin:
        visit(visitor, f"{origin}/")
        (mesh,) = read_meshes(visitor)
        assert len(mesh["triangles"]) == 3 * read_value(edited, "triangles")
        assert len(mesh["positions"]) == read_value(edited, "vertices")
        assert visitor.messages == []


def test_the_copied_command_writes_the_file(edited: Page, tmp_path: Path) -> None:
    command = copy_text(edited, "copy-curl")
    run_shell(command.replace("curl", "curl -s"), tmp_path)
    (file,) = tmp_path.iterdir()
    assert file.name in shlex.split(command)
    assert file.stat().st_size == read_value(edited, "bytes")
