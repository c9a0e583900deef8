"""Headless Chromium: any page, and the one here that draws a model with three.js."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import quote

from playwright.sync_api import Page, sync_playwright

FOLDER = Path(__file__).parent

# Software WebGL, since nobody has a graphics card for us; and no calls home.
CHROMIUM_FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


class _QuietHandler(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Nobody wants to read every request."""


@contextmanager
def serve_folder(folder: Path) -> Iterator[str]:
    """URL at which the files of `folder` are served, on a free port of this machine."""
    handler = partial(_QuietHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as httpd:
        thread = threading.Thread(target=httpd.serve_forever, name="pages")
        thread.start()
        try:
            yield f"http://127.0.0.1:{httpd.server_port}"
        finally:
            httpd.shutdown()
            thread.join()


@contextmanager
def open_page(chromium: str) -> Iterator[tuple[Page, list[str]]]:
    """A blank page, and the list that what its console complains of is added to."""
    complaints: list[str] = []
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=chromium, args=[*CHROMIUM_FLAGS]) as browser,
    ):
        page = browser.new_page(viewport={"width": 1200, "height": 800})
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "console",
            lambda message: (
                complaints.append(message.text) if message.type in ("error", "warning") else None
            ),
        )
        yield page, complaints


def show(page: Page, pages: str, model_url: str) -> None:
    """Opens the viewer, which is served at `pages`, and waits until it has drawn the model."""
    page.goto(f"{pages}/viewer.html?model={quote(model_url, safe='')}")
    page.wait_for_function("window.viewer || window.viewerError")


@contextmanager
def viewer(chromium: str, model_url: str) -> Iterator[tuple[Page, list[str]]]:
    """The page that shows the model, drawn, and what the browser's console complained of."""
    with serve_folder(FOLDER) as pages, open_page(chromium) as (page, complaints):
        show(page, pages, model_url)
        yield page, complaints
