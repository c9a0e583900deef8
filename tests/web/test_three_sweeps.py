"""Tubes, ribbons and curves in a browser: three.js in headless Chromium draws the served GLB."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from playwright.sync_api import Page

from service.encoders.curves.registry import CURVES_BY_NAME
from service.engine.curves.options import CurveOptions
from service.pipeline.curve import render_curve
from service.surface.swept_shapes import trefoil
from tests.tools import chromium, node_package
from tests.web.browser import viewer

LINES = """async (url) => {
  const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
  const { scene } = await new GLTFLoader().loadAsync(url);
  const found = [];
  scene.traverse((node) => {
    if (node.isLine) found.push({
      name: node.name, type: node.type, points: node.geometry.attributes.position.count,
      attributes: Object.keys(node.geometry.attributes).sort(),
    });
  });
  return found;
}"""


class _Open(SimpleHTTPRequestHandler):
    def end_headers(self) -> None:
        self.send_header("Access-Control-Allow-Origin", "*")
        super().end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Nobody wants to read every request."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """URL of a folder that pages from elsewhere may read."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Open, directory=str(folder))) as httpd:
        thread = Thread(target=httpd.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{httpd.server_port}"
        finally:
            httpd.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def drawn(server: str) -> Iterator[tuple[Page, list[str]]]:
    """The trefoil in a browser, and what the console complained of."""
    node_package("three")
    model = f"{server}/v1/surfaces/trefoil-tube/mesh.glb?resolution=6"
    with viewer(chromium(), model) as (page, complaints):
        yield page, complaints


def test_three_draws_a_smooth_knot(drawn: tuple[Page, list[str]]) -> None:
    page, complaints = drawn
    assert page.evaluate("window.viewerError") is None
    assert complaints == []
    (mesh,) = page.evaluate("window.viewer.meshes()")
    assert mesh["triangles"] == 24 * 6 * 24 * 2
    assert mesh["longestNormalError"] < 1e-6
    # Its axis is z, and z is up: seen from the front the knot is three times as wide as high.
    low, high = (np.array(mesh["positions"]).min(axis=0), np.array(mesh["positions"]).max(axis=0))
    assert (high - low)[1] < (high - low)[0] / 2


def test_three_reads_a_curve(drawn: tuple[Page, list[str]], tmp_path: Path) -> None:
    page, complaints = drawn
    content = render_curve(trefoil(), CurveOptions(resolution=4), CURVES_BY_NAME["glb"])
    (tmp_path / "curve.glb").write_bytes(content)
    with served(tmp_path) as url:
        (line,) = page.evaluate(LINES, f"{url}/curve.glb")
    assert line["points"] == 97
    assert line["type"] == "Line"
    assert {"_arc_length", "_parameter", "_tangent", "position"} == set(line["attributes"])
    assert complaints == []
