"""Headless Chromium for tests: any page, and the viewer page, which draws models with three.js."""

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

from tools.live import serve

FOLDER = Path(__file__).parents[1] / "tests" / "web"

# WebGL in software, for machines without a graphics card; no connections to other hosts; and no
# optimization of scripts (`--no-opt`), from which pages that are open so briefly do not gain.
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


# Messages that appear on machines without a graphics card: model-viewer writes the first if two
# frames take more than 0.5 s, and Chromium the second if a script reads pixels.
SLOWNESS_MESSAGES = ("rAF timed out in updateSource", "GPU stall due to ReadPixels")

# Script for pages whose pictures are not tested: WebGL fills no pixels, because that takes most of
# the time without a graphics card. It still compiles shaders, and checks every call to draw.
WITHOUT_PIXELS = """const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    const context = getContext.call(this, kind, ...more);
    if (kind === 'webgl2') context?.enable(context.RASTERIZER_DISCARD);
    return context;
};"""

# Script for pages that draw continuously: 20 frames per second are enough for a picture.
SLOW_FRAMES = """window.requestAnimationFrame = (draw) => (
    setTimeout(() => draw(performance.now()), 50));
window.cancelAnimationFrame = clearTimeout;"""

# Script that lets WebGL fill pixels on a page with WITHOUT_PIXELS, until a script calls
# `getContext` again.
FILL_PIXELS_SCRIPT = """for (const canvas of document.querySelectorAll('canvas')) {
    const context = canvas.getContext('webgl2');
    context?.disable(context.RASTERIZER_DISCARD);
}"""

# Returns the red, green, blue and opacity of a PNG file, reduced to 96 × 64 pixels.
READ_PICTURE = """async (image) => {
    const bytes = Uint8Array.from(atob(image), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes]));
    const paper = new OffscreenCanvas(96, 64).getContext('2d');
    paper.imageSmoothingEnabled = false;
    paper.drawImage(bitmap, 0, 0, 96, 64);
    return Array.from(paper.getImageData(0, 0, 96, 64).data);
}"""


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves the files of a folder, and writes no log."""

    def log_message(self, format: str, *args: Any) -> None:
        """Writes no log to the terminal."""


def serve_folder(folder: Path) -> AbstractContextManager[str]:
    """The URL of a server of the files in `folder`, on a free port of this machine."""
    return serve(partial(QuietHandler, directory=str(folder)))


@dataclass(frozen=True)
class Stage:
    """A page of the browser, the messages in its console, and the URLs of its requests.

    The methods other than `take_picture` need the viewer page (`open_viewer`).
    """

    page: Page
    messages: list[str]
    requested_urls: list[str] = field(default_factory=list)

    def show(self, model: str | bytes, width: int = 480, height: int = 320) -> None:
        """Draws a model in the viewer; `model` is its URL or the bytes of a GLB file."""
        self.page.set_viewport_size({"width": width, "height": height})
        if isinstance(model, bytes):
            model = "data:model/gltf-binary;base64," + base64.b64encode(model).decode()
        self.page.evaluate("url => window.show(url)", model)

    def take_picture(self) -> NDArray[np.int64]:
        """A picture of the page, reduced to 96 × 64 pixels: red, green and blue, (6144, 3).

        Another page decodes the picture, because the policy of this page may forbid it.
        """
        image = base64.b64encode(self.page.screenshot()).decode()
        browser = self.page.context.browser
        assert browser is not None
        rgba = _open_reader(browser).evaluate(READ_PICTURE, image)
        return np.reshape(rgba, (-1, 4))[:, :3]

    def draw_edges(self) -> None:
        """Draws the edges of all triangles over the model."""
        self.page.evaluate("window.viewer.drawEdges()")

    def read_meshes(self) -> list[dict[str, Any]]:
        """All meshes of the model in three.js, with positions and normals in world coordinates."""
        meshes: list[dict[str, Any]] = self.page.evaluate("window.viewer.meshes()")
        return meshes

    def read_lines(self) -> list[dict[str, Any]]:
        """All lines of the model in three.js, with positions in world coordinates."""
        lines: list[dict[str, Any]] = self.page.evaluate("window.viewer.lines()")
        return lines

    def measure_light(self) -> list[float]:
        """The brightness of the model in the lower and in the upper half of the picture."""
        brightness: list[float] = self.page.evaluate("window.viewer.light()")
        return brightness


@lru_cache(maxsize=1)
def _open_reader(browser: Browser) -> Page:
    """An empty page that decodes pictures; it is opened only once."""
    return browser.new_page()


@contextmanager
def open_browser(chromium: str) -> Iterator[Browser]:
    """Headless Chromium, which runs until the block ends."""
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=chromium, args=[*CHROMIUM_FLAGS]) as browser,
    ):
        yield browser


def record_page(page: Page, kinds: Collection[str] | None = None) -> Stage:
    """Records the requests, the errors and the console messages of a page from now on.

    `kinds` are those of the console messages to record, such as "error"; by default, all. Uncaught
    errors are always recorded, and `SLOWNESS_MESSAGES` never.
    """
    stage = Stage(page, [])

    def record_message(message: ConsoleMessage) -> None:
        is_slowness = any(text in message.text for text in SLOWNESS_MESSAGES)
        if not is_slowness and (kinds is None or message.type in kinds):
            stage.messages.append(message.text)

    page.on("pageerror", lambda error: stage.messages.append(str(error)))
    page.on("console", record_message)
    page.on("request", lambda request: stage.requested_urls.append(request.url))
    return stage


def open_page(browser: Browser) -> Stage:
    """A new blank page, whose errors and warnings are recorded."""
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    page.set_default_timeout(120_000)  # model-viewer computes its light slowly on a busy machine
    return record_page(page, ("error", "warning"))


def open_viewer(stage: Stage, pages: str, query: str = "") -> None:
    """Opens the viewer, which is served at the URL `pages`, and waits until it can draw models."""
    stage.page.goto(f"{pages}/viewer.html{query}")
    stage.page.wait_for_function("window.show !== undefined")
