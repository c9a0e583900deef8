"""Sharing a surface from the editor: by a link, by HTML for another page, and by a command."""

import json
import re
import shlex
from base64 import b64encode
from collections.abc import Iterator
from hashlib import sha384
from html import unescape
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from service.engine.mesh.mesh import ENGINE
from tests.test_readme import run_shell
from tests.web.clients import read_meshes, visit
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
from tools.programs import find_node_package


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


@pytest.mark.slow
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


def test_the_copied_html_draws_the_surface_alone_in_a_file(
    edited: Page, visitor: Stage, tmp_path: Path, server: str
) -> None:
    """The file has only the copied text; its script comes from a public host, here from npm."""
    html = copy_text(edited, "copy-snippet")
    (src,) = re.findall(r'src="(https://[^"]+)"', html)
    package = find_node_package("@google/model-viewer")
    version = json.loads((package / "package.json").read_text(encoding="utf-8"))["version"]
    host, path = src.split(f"/npm/@google/model-viewer@{version}/")
    script = (package / path).read_bytes()
    assert f'integrity="sha384-{b64encode(sha384(script).digest()).decode()}"' in html
    (address,) = re.findall(r'src="(http:[^"]+)"', html)
    query = dict(parse_qsl(urlsplit(unescape(address)).query))
    assert query["engine"] == str(ENGINE)
    # The comment says which hosts the page needs, and what to do with another engine.
    comment = html[: html.index("-->")]
    assert all(word in comment for word in (host, server, "SURFACE_CORS_ORIGINS", "410"))
    file = tmp_path / "surface.html"
    file.write_text(html, encoding="utf-8")
    headers = {"Access-Control-Allow-Origin": "*"}
    visitor.page.route(
        f"{host}/**",
        lambda route: route.fulfill(body=script, content_type="text/javascript", headers=headers),
    )
    try:
        visit(visitor, file.as_uri())
        (mesh,) = read_meshes(visitor)
    finally:
        visitor.page.unroute(f"{host}/**")
    assert len(mesh["triangles"]) == 3 * read_value(edited, "triangles")
    assert len(mesh["positions"]) == read_value(edited, "vertices")
    assert visitor.messages == []


def test_the_copied_command_writes_the_file(edited: Page, tmp_path: Path) -> None:
    command = copy_text(edited, "copy-curl")
    run_shell(command.replace("curl", "curl -s"), tmp_path)
    (file,) = tmp_path.iterdir()
    assert file.name in shlex.split(command)
    # The page shows the same mesh, compressed.
    assert file.stat().st_size >= read_value(edited, "bytes")
