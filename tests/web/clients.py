"""Pages of front ends, at another origin than the service, and the data in their libraries.

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

from tests.live import serve
from tests.programs import find_node_package
from tests.web.browser import FOLDER, SLOW_FRAMES, WITHOUT_PIXELS, QuietHandler, Stage, open_page

PAGE = Path(__file__).parents[2] / "docs" / "browser.md"
HELD = FOLDER / "held.js"
# For each library, a word that only its page has.
LIBRARIES = {"three": "GLTFLoader", "model-viewer": "</model-viewer>", "babylon": "BABYLON"}
TRIED = [*LIBRARIES] if os.environ.get("BROWSER_LIBRARIES") == "all" else ["three"]
"""Libraries that draw in a test run: all of them in that of `make test-libraries`."""
PACKAGES = ("three", "@google/model-viewer", "babylonjs", "babylonjs-loaders", "meshoptimizer")
SERVED_AT = "http://127.0.0.1:8000"
MODEL = re.compile(rf"{SERVED_AT}/v1/surfaces/[\w-]+/mesh\.glb[^'\"]*")


def turn_upright(rows: ArrayLike) -> NDArray[np.float64]:
    """Points whose third coordinate points up, as glTF has them: (x, y, z) → (x, z, −y)."""
    x, y, z = np.asarray(rows).T
    return np.stack([x, z, -y], axis=1)


def to_linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """The linear light of an sRGB value (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def read_blocks(language: str) -> list[str]:
    """The blocks of code of the documentation's page that are in this language."""
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def read_page(library: str) -> str:
    """The documentation's page for this library."""
    (page,) = (block for block in read_blocks("html") if LIBRARIES[library] in block)
    return page


def write_client(library: str, model: str) -> str:
    """The page of a library, changed to load another model, whose URL may be a `data:` URL."""
    page, replaced = MODEL.subn(lambda _: model, read_page(library))
    assert replaced == 1
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
    """The origin of a server that has these pages at their paths, and `/node_modules/…`.

    Pages may be added to the mapping while the site runs.
    """
    for name in PACKAGES:
        find_node_package(name)
    with serve(partial(_SiteHandler, pages=pages, directory=str(FOLDER))) as origin:
        yield origin


def open_blank_page(browser: Browser, pixels: bool = False) -> Stage:
    """A blank page, which `read_meshes` can read; if `pixels` is true, it can be photographed."""
    stage = open_page(browser)
    stage.page.add_init_script(path=HELD)
    stage.page.add_init_script(SLOW_FRAMES)
    if not pixels:
        stage.page.add_init_script(WITHOUT_PIXELS)
    return stage


def visit(stage: Stage, url: str, width: int = 240, height: int = 160) -> None:
    """Opens another URL in the page; checks that its console has no complaints so far."""
    stage.page.goto("about:blank")
    stage.complaints.clear()
    stage.page.set_viewport_size({"width": width, "height": height})
    stage.page.goto(url)


def read_meshes(stage: Stage) -> list[dict[str, Any]]:
    """Waits for the meshes in the library of this page, and returns them.

    Of each `name`, `triangles` (indices, three a triangle), and rows of `positions`, `normals` and
    `colors` (as the shader gets them: linear), in the world of glTF: right-handed, y up.
    """
    stage.page.wait_for_function("window.held().length > 0")
    result: list[dict[str, Any]] = stage.page.evaluate("window.held()")
    return result
