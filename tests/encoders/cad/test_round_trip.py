"""STEP and IGES that the service writes, read by the service: the same parts come back."""

import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from oracles.solids import INVALID, MEASURES, VALID, read_solid
from service.decoders.format import DEFAULT_FILE_LIMITS
from service.decoders.registry import DECODERS
from service.encoders.cad.registry import DEFINITIONS_BY_NAME
from service.surface.brep import BrepSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.sizes import SurfaceKind
from tests.encoders.cad.test_step import BOLT, allow_any, make_group, place, read_surface

READERS = {decoder.name: decoder for decoder in DECODERS}


def send(surface: SurfaceKind, fmt: str) -> SurfaceKind:
    """The surface that is read in the file of a surface."""
    file = DEFINITIONS_BY_NAME[fmt].encode(surface.lower(), surface.unit, allow_any)
    decoded = READERS[fmt].decode(bytes(file.content), None, DEFAULT_FILE_LIMITS)
    assert decoded.reading is not None
    assert not decoded.reading.get("skipped_faces")
    return read_surface(decoded.tree)


def read_brep(surface: SurfaceKind) -> BrepSurface:
    assert isinstance(surface, BrepSurface)
    return surface


def read_nets(brep: BrepSurface) -> list[np.ndarray]:
    """The control points of each face."""
    starts = brep.surfaces.point_starts
    return [brep.surfaces.points[a:b] for a, b in pairwise(starts.tolist())]


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURES)
def test_step_keeps_faces_edges_and_shells_of_solids(name: str) -> None:
    """Control points of splines are equal, and those of planes are in the planes."""
    before = read_brep(read_surface(read_solid(name)))
    after = read_brep(send(before, "step"))
    assert after.unit == 0.001
    assert after.is_closed.tolist() == before.is_closed.tolist()
    assert after.shell_counts.tolist() == before.shell_counts.tolist()
    assert after.face_names == before.face_names
    assert after.is_reversed.tolist() == before.is_reversed.tolist()
    assert np.count_nonzero(~after.is_degenerate) == np.count_nonzero(~before.is_degenerate)
    scale = float(np.abs(before.vertices).max())
    for one, other in zip(read_nets(before), read_nets(after), strict=True):
        if len(one) == 4:
            normal = np.cross(one[1] - one[0], one[2] - one[0])
            distance = (other - one[0]) @ normal / np.linalg.norm(normal)
            assert np.abs(distance).max() <= 1e-12 * scale
        elif len(one) == len(other):
            assert np.abs(one - other).max() <= 1e-12 * scale
    own = {tuple(point) for point in before.vertices.tolist()}
    assert own >= {tuple(point) for point in after.vertices.tolist()}


@pytest.mark.slow
@pytest.mark.parametrize("name", VALID)
def test_iges_keeps_solids_closed(name: str) -> None:
    before = read_brep(read_surface(read_solid(name)))
    after = read_brep(send(before, "iges"))
    assert after.is_closed.all()
    assert len(after.surfaces) == len(before.surfaces)
    assert sorted(after.face_names) == sorted(before.face_names)
    assert INVALID not in VALID


@pytest.mark.parametrize("fmt", ["step", "iges"])
@pytest.mark.parametrize(
    "name", ["sphere", "torus", "cylinder", "octahedral-sphere", "bspline-ring", "nurbs-goblet"]
)
def test_closed_surfaces_of_patches_come_back_as_closed_breps(name: str, fmt: str) -> None:
    assert read_brep(send(find(name).surface(), fmt)).is_closed.tolist() == [True]


def test_step_keeps_instances_names_colours_and_units() -> None:
    bolt = read_solid("bolt") | {"name": BOLT}
    bolt["faces"][0]["color"] = [1, 1, 0]
    blue = [0.2, 0.4, 0.8]
    group: dict[str, Any] = make_group(
        {"name": "left", "surface": bolt, "color": blue},
        {"name": "turned", "surface": bolt, "color": blue, "matrix": place(50, 0.7)},
        {"name": "plain", "surface": bolt, "matrix": place(80)},
    ) | {"metres_per_unit": 0.0254}
    before = read_surface(group)
    after = send(before, "step")
    again = send(after, "step")
    for each in (after, again):
        assert isinstance(each, GroupSurface)
        assert each.unit == pytest.approx(0.0254, rel=1e-15)
        placed = each.lower().members
        assert [copy.name.rpartition("/")[2] for copy in placed] == ["left", "turned", "plain"]
        assert [copy.color and copy.color[:3] for copy in placed] == [tuple(blue)] * 2 + [None]
        matrices = [np.eye(4) if copy.matrix is None else copy.matrix for copy in placed]
        expected = np.array([np.eye(4).tolist(), place(50, 0.7), place(80)])
        assert np.allclose(matrices, expected, atol=1e-14)
        (body, *_) = each.definitions
        assert read_brep(body).palette.tolist() == [[1, 1, 0, 1]]
        assert body.name == BOLT


def test_step_keeps_names_of_assemblies() -> None:
    """An instance of an assembly and its product have two names; nothing grows from file to file.

    The root is a member that is not placed, below which all else is.
    """
    members = [
        {"name": "machine"},
        {"name": "lower", "parent": 0},
        {"name": "frame", "parent": 1},
        {"name": "bolt 1", "parent": 2, "definition": 0},
        {"name": "bolt 2", "parent": 2, "definition": 0, "matrix": place(30)},
        {"name": "upper", "parent": 0, "matrix": place(60, 0.7)},
        {"name": "frame", "parent": 5},
        {"name": "bolt 1", "parent": 6, "definition": 0},
        {"name": "bolt 2", "parent": 6, "definition": 0, "matrix": place(30)},
        {"name": "lonely", "parent": 0},
        {"name": "inner", "parent": 9},
        {"name": "innermost", "parent": 10},
        {"name": "bolt 3", "parent": 11, "definition": 0, "matrix": place(90)},
    ]
    tree = {"type": "group", "up": "z", "name": "machine", "metres_per_unit": 0.001}
    before = read_surface(tree | {"definitions": [read_solid("bolt")], "members": members})
    file = DEFINITIONS_BY_NAME["step"].encode(before.lower(), before.unit, allow_any)
    content = bytes(file.content)
    for name in (b"frame", b"machine"):  # one product, of the two instances and of the root
        assert len(re.findall(rb"=PRODUCT\('[^']*','%b'" % name, content)) == 1
    after = send(before, "step")
    again = send(after, "step")
    for each in (after, again):
        assert isinstance(each, GroupSurface)
        assert sorted(copy.name for copy in each.lower().members) == [
            "machine/lonely/inner/innermost/bolt 3",
            "machine/lower/frame/bolt 1",
            "machine/lower/frame/bolt 2",
            "machine/upper/frame/bolt 1",
            "machine/upper/frame/bolt 2",
        ]
