"""Headless Chromium, with any page, and with a viewer page that draws models by three.js."""

import base64
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache, partial
from http.server import SimpleHTTPRequestHandler
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Browser, ConsoleMessage, Page, sync_playwright

from tests.live import serve

FOLDER = Path(__file__).parent

# Software WebGL, for machines without a graphics card; no connections to any other host.
CHROMIUM_FLAGS = (
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-rasterization",
    "--disable-gpu-compositing",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--js-flags=--no-opt",
)


# Console messages without a graphics card: of model-viewer if two frames take more than 0.5 s, of
# Chromium if a picture is read.
TOO_SLOW = ("rAF timed out in updateSource", "GPU stall due to ReadPixels")

# Added to pages whose pictures are not tested: WebGL fills no pixels, which takes most of the time
# without a graphics card. It still compiles shaders, and checks every call to draw.
WITHOUT_PIXELS = """const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    const context = getContext.call(this, kind, ...more);
    if (kind === 'webgl2') context?.enable(context.RASTERIZER_DISCARD);
    return context;
};"""

# Added to pages that draw continuously: 20 frames per second are enough for a picture.
SLOW_FRAMES = """window.requestAnimationFrame = (draw) => (
    setTimeout(() => draw(performance.now()), 50));
window.cancelAnimationFrame = clearTimeout;"""

# Makes such a page fill pixels from now on, until it gets its context again.
FILL_PIXELS = """for (const canvas of document.querySelectorAll('canvas')) {
    const context = canvas.getContext('webgl2');
    context?.disable(context.RASTERIZER_DISCARD);
}"""

READ_PICTURE = """async (image) => {
    const bytes = Uint8Array.from(atob(image), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes]));
    const paper = new OffscreenCanvas(96, 64).getContext('2d');
    paper.imageSmoothingEnabled = false;
    paper.drawImage(bitmap, 0, 0, 96, 64);
    return Array.from(paper.getImageData(0, 0, 96, 64).data);
}"""


class QuietHandler(SimpleHTTPRequestHandler):
    """Files of a folder."""

    def log_message(self, format: str, *args: Any) -> None:
        """Writes no log line for each request."""


def serve_folder(folder: Path) -> AbstractContextManager[str]:
    """URL at which the files of `folder` are served, on a free port of this machine."""
    return serve(partial(QuietHandler, directory=str(folder)))


@dataclass(frozen=True)
class Stage:
    """A page of the browser, the complaints of its console, and its requests."""

    page: Page
    complaints: list[str]
    asked: list[str] = field(default_factory=list)

    def show(self, model: str | bytes, width: int = 480, height: int = 320) -> None:
        """Draws a model, given by its URL or as a GLB, in the viewer, which must be open."""
        self.page.set_viewport_size({"width": width, "height": height})
        if isinstance(model, bytes):
            model = "data:model/gltf-binary;base64," + base64.b64encode(model).decode()
        self.page.evaluate("url => window.show(url)", model)

    def picture(self) -> NDArray[np.int64]:
        """The page's picture, reduced to 96 × 64 pixels of red, green and blue.

        Another page reads the picture, because this page may forbid it.
        """
        image = base64.b64encode(self.page.screenshot()).decode()
        browser = self.page.context.browser
        assert browser is not None
        rgba = _reader(browser).evaluate(READ_PICTURE, image)
        return np.reshape(rgba, (-1, 4))[:, :3]

    def draw_edges(self) -> None:
        """Draws the edges of all triangles over the picture."""
        self.page.evaluate("window.viewer.drawEdges()")

    def meshes(self) -> list[dict[str, Any]]:
        """All meshes in three.js, with positions and normals in world coordinates."""
        result: list[dict[str, Any]] = self.page.evaluate("window.viewer.meshes()")
        return result

    def lines(self) -> list[dict[str, Any]]:
        """All lines in three.js."""
        result: list[dict[str, Any]] = self.page.evaluate("window.viewer.lines()")
        return result

    def light(self) -> list[float]:
        """The brightness of the model in the lower and in the upper half of the picture."""
        result: list[float] = self.page.evaluate("window.viewer.light()")
        return result


@lru_cache(maxsize=1)
def _reader(browser: Browser) -> Page:
    """An empty page that decodes pictures."""
    return browser.new_page()


@contextmanager
def open_browser(chromium: str) -> Iterator[Browser]:
    """Chromium, until the block ends."""
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=chromium, args=[*CHROMIUM_FLAGS]) as browser,
    ):
        yield browser


def listening(page: Page, kinds: Collection[str] | None = None) -> Stage:
    """A page, with its requests and console messages from now on."""
    stage = Stage(page, [])

    def hear(message: ConsoleMessage) -> None:
        is_slow = any(text in message.text for text in TOO_SLOW)
        if not is_slow and (kinds is None or message.type in kinds):
            stage.complaints.append(message.text)

    page.on("pageerror", lambda error: stage.complaints.append(str(error)))
    page.on("console", hear)
    page.on("request", lambda request: stage.asked.append(request.url))
    return stage


def open_page(browser: Browser) -> Stage:
    """A new blank page."""
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    page.set_default_timeout(120_000)  # model-viewer computes its light slowly on a busy machine
    return listening(page, ("error", "warning"))


def open_viewer(stage: Stage, pages: str, query: str = "") -> None:
    """Opens the page that draws models, served at `pages`, and waits until it can."""
    stage.page.goto(f"{pages}/viewer.html{query}")
    stage.page.wait_for_function("window.show !== undefined")
