"""Meshes of the client are drawn in this process: the same silhouettes as those of the service."""

import sys
from io import BytesIO

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from service.client import Local, Mesh, Picture, bezier

SQUARE = bezier([[[-1, -1, 0], [-1, 1, 0]], [[1, -1, 0], [1, 1, 0]]])


def read(picture: Picture) -> NDArray[np.float64]:
    """The pixels (height, width, 4)."""
    return np.asarray(Image.open(BytesIO(picture)).convert("RGBA"), np.float64)


@pytest.fixture(scope="module")
def local() -> Local:
    return Local()


@pytest.mark.parametrize("name", ["utah-teapot", "tea-service", "swept-wing"])
def test_a_fine_mesh_looks_like_its_surface(local: Local, name: str) -> None:
    """In outline, colours and light; the vertical axis of these surfaces is z."""
    mesh = local.mesh(name, relative_tolerance=1e-3)
    drawn, asked = (
        read(mesh.draw(width=120, height=90)),
        read(local.image(name, width=120, height=90)),
    )
    assert (np.abs(drawn - asked)[..., 3] > 128).mean() < 0.01
    both = (drawn[..., 3] == 255) & (asked[..., 3] == 255)
    assert both.mean() > 0.1
    assert np.abs(drawn - asked)[both].mean() < 3


def test_the_vertical_axis_can_be_y(local: Local) -> None:
    mesh = local.mesh(SQUARE, resolution=1)
    below, before = mesh.draw(elevation=0, azimuth=0), mesh.draw(up="y", elevation=0, azimuth=0)
    assert (read(below)[..., 3] > 0).mean() < 0.01  # a plane seen from its edge
    assert (read(before)[..., 3] > 0).mean() > 0.5


def test_quads_lines_and_faces_without_normals_are_drawn(local: Local) -> None:
    triangles = local.mesh("nurbs-goblet", resolution=3).draw(width=60, height=60)
    quads = local.mesh("nurbs-goblet", resolution=3, faces="quads").draw(width=60, height=60)
    assert (read(triangles)[..., 3] == read(quads)[..., 3]).mean() > 0.99
    flat = local.mesh("nurbs-goblet", resolution=3, normals=False).draw(width=60, height=60)
    np.testing.assert_array_equal(read(flat)[..., 3], read(triangles)[..., 3])
    assert flat != triangles
    net = local.mesh(SQUARE, overlays=["control_net"]).draw(elevation=90)
    assert net != local.mesh(SQUARE).draw(elevation=90)
    lines = local.mesh(SQUARE, faces="none", isocurves=2).draw(elevation=90)
    assert 0 < (read(lines)[..., 3] > 0).mean() < 0.1


def test_a_notebook_shows_a_mesh_unless_it_cannot_be_drawn(
    local: Local, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh: Mesh = local.mesh(SQUARE, resolution=1)
    shown = mesh._repr_png_()
    assert shown is not None
    assert read(Picture(shown)).shape == (360, 480, 4)
    monkeypatch.setitem(sys.modules, "service.client.drawing", None)
    assert mesh._repr_png_() is None
