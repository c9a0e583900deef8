"""What a browser makes of the teapot: three.js in headless Chromium draws the served GLB."""

from typing import Any

import numpy as np
import pytest

from tests.web.browser import Stage

PARTS = ["rim", "body", "handle", "spout", "lid", "bottom"]


@pytest.fixture(scope="module")
def drawn(server: str, viewer: Stage) -> Stage:
    """The page with the teapot on it, drawn."""
    viewer.complaints.clear()
    viewer.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?resolution=16", 1800, 1200)
    return viewer


@pytest.fixture(scope="module")
def meshes(drawn: Stage) -> list[dict[str, Any]]:
    """What three.js holds of every mesh; positions and normals as they stand in the world."""
    return drawn.meshes()


def test_the_console_stays_silent(drawn: Stage) -> None:
    assert drawn.complaints == []


def test_every_part_is_a_named_mesh(meshes: list[dict[str, Any]]) -> None:
    assert sorted(mesh["name"] for mesh in meshes) == sorted(PARTS)
    assert all(mesh["triangles"] > 0 for mesh in meshes)


def test_normals_come_with_the_file_and_are_unit(meshes: list[dict[str, Any]]) -> None:
    for mesh in meshes:
        assert mesh["hasNormals"], mesh["name"]
        assert not mesh["flatShaded"], mesh["name"]
        assert mesh["longestNormalError"] < 1e-6, mesh["name"]


def test_the_teapot_stands_upright(meshes: list[dict[str, Any]]) -> None:
    """y is up: the pot stands on y = 0, and its highest point is the knob, on the axis."""
    points = np.concatenate([mesh["positions"] for mesh in meshes])
    low, high = points.min(axis=0), points.max(axis=0)
    assert low[1] == pytest.approx(0, abs=1e-6)
    assert high[1] < high[0] - low[0]
    knob = points[points[:, 1] > high[1] - 1e-3]
    assert np.hypot(knob[:, 0], knob[:, 2]).max() < 0.5


def test_the_outside_looks_outwards(meshes: list[dict[str, Any]]) -> None:
    """Normals of the body point away from the vertical axis."""
    body = next(mesh for mesh in meshes if mesh["name"] == "body")
    positions, normals = np.array(body["positions"]), np.array(body["normals"])
    outwards = positions[:, 0] * normals[:, 0] + positions[:, 2] * normals[:, 2]
    assert outwards.min() > 0


def test_the_picture_is_smooth(drawn: Stage) -> None:
    """Shaded by its normals the teapot shows hardly an edge; shaded flat, one at every triangle."""
    smooth = drawn.page.evaluate("window.viewer.measure()")
    assert 0.1 < smooth["coverage"] < 0.6
    drawn.page.evaluate("window.viewer.shadeFlat()")
    flat = drawn.page.evaluate("window.viewer.measure()")
    assert smooth["edges"] < 0.01
    assert flat["edges"] > 4 * smooth["edges"]
