"""Triangular patches in a browser: three.js in headless Chromium draws the served GLB."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page

from tests.tools import chromium, node_package
from tests.web.browser import viewer


@pytest.fixture(scope="module")
def drawn(server: str) -> Iterator[tuple[Page, list[str]]]:
    """The rounded box in a browser, and what the console complained of."""
    node_package("three")
    model = f"{server}/v1/surfaces/rounded-box/mesh.glb?resolution=4"
    with viewer(chromium(), model) as (page, complaints):
        yield page, complaints


def test_three_draws_a_smooth_box(drawn: tuple[Page, list[str]]) -> None:
    page, complaints = drawn
    assert page.evaluate("window.viewerError") is None
    assert complaints == []
    (mesh,) = page.evaluate("window.viewer.meshes()")
    assert mesh["triangles"] == 18 * 32 + 8 * 16
    assert mesh["longestNormalError"] < 1e-6
