"""Opens web pages of clients, which have another origin than the service, and reads their meshes.

`docs/browser.md` has a page for three.js, for model-viewer and for Babylon.js. This module reads
these pages, replaces the URL of the model, and opens them in the browser.
"""

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray
from playwright.sync_api import Browser

from tools.browser import FOLDER, SLOW_FRAMES, WITHOUT_PIXELS, QuietHandler, Stage, open_page
from tools.live import serve
from tools.programs import find_node_package

PAGE = Path(__file__).parents[2] / "docs" / "browser.md"
READ_MESHES = FOLDER / "read_meshes.js"
# For each library, a word that occurs only in its page.
LIBRARIES = {"three": "GLTFLoader", "model-viewer": "</model-viewer>", "babylon": "BABYLON"}
TESTED_LIBRARIES = [*LIBRARIES] if os.environ.get("BROWSER_LIBRARIES") == "all" else ["three"]
"""Libraries of this test run: all in `make test-libraries`, else only three.js."""
PACKAGES = ("three", "@google/model-viewer", "babylonjs", "babylonjs-loaders", "meshoptimizer")
SERVED_AT = "http://127.0.0.1:8000"
MODEL = re.compile(rf"{SERVED_AT}/v1/surfaces/[\w-]+/mesh\.glb[^'\"]*")


def turn_upright(rows: ArrayLike) -> NDArray[np.float64]:
    """Vectors (N, 3) with z up, rotated to y up as in glTF: (x, y, z) → (x, z, −y)."""
    x, y, z = np.asarray(rows).T
    return np.stack([x, z, -y], axis=1)


def to_linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """The linear light of an sRGB value (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def read_blocks(language: str) -> list[str]:
    """The blocks of code in `docs/browser.md` that are in this language."""
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def read_page(library: str) -> str:
    """The HTML page in `docs/browser.md` for this library."""
    (page,) = (block for block in read_blocks("html") if LIBRARIES[library] in block)
    return page


def write_client(library: str, model: str) -> str:
    """The page of a library with another model; `model` is its URL, maybe a `data:` URL."""
    page, replacements = MODEL.subn(lambda _: model, read_page(library))
    assert replacements == 1
    return page


class _SiteHandler(QuietHandler):
    """Serves the pages of a site, and files for all other paths."""

    def __init__(self, *args: Any, pages: Mapping[str, str], **options: Any) -> None:
        self.pages = pages
        super().__init__(*args, **options)

    def send_head(self) -> BytesIO | BinaryIO | None:
        page = self.pages.get(self.path)
        if page is None:
            return super().send_head()
        content = page.encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        return BytesIO(content)


@contextmanager
def serve_site(pages: Mapping[str, str]) -> Iterator[str]:
    """The origin of a server of these pages, by path, and of the files of this folder.

    The libraries are among the files, below `/node_modules/`; if a library is missing, the test is
    skipped. Pages may be added to the mapping while the server runs.
    """
    for name in PACKAGES:
        find_node_package(name)
    with serve(partial(_SiteHandler, pages=pages, directory=str(FOLDER))) as origin:
        yield origin


def open_blank_page(browser: Browser, has_pictures: bool = False) -> Stage:
    """A blank page, prepared for `read_meshes`; its pictures are empty unless `has_pictures`."""
    stage = open_page(browser)
    stage.page.add_init_script(path=READ_MESHES)
    stage.page.add_init_script(SLOW_FRAMES)
    if not has_pictures:
        stage.page.add_init_script(WITHOUT_PIXELS)
    return stage


def visit(stage: Stage, url: str, width: int = 240, height: int = 160) -> None:
    """Opens a URL in a page of this size, after an empty page, and forgets earlier messages."""
    stage.page.goto("about:blank")
    stage.messages.clear()
    stage.page.set_viewport_size({"width": width, "height": height})
    stage.page.goto(url)


def read_meshes(stage: Stage) -> list[dict[str, Any]]:
    """The meshes that the library of this page has loaded; waits for the first.

    Each has a `name`, `triangles` (three indices for each), and rows of `positions`, `normals` and
    `colors` (linear, as the shader gets them). The coordinates are as in glTF: right-handed, y up.
    """
    stage.page.wait_for_function("window.readMeshes().length > 0")
    meshes: list[dict[str, Any]] = stage.page.evaluate("window.readMeshes()")
    return meshes
