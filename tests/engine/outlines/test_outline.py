"""Outlines: surfaces of patches as breps whose borders, seams and poles are edges."""

from collections.abc import Sequence
from dataclasses import fields, replace
from math import cos, sin, tau
from typing import Any

import numpy as np
import pytest

from service.engine.brep.preparation.prepare import prepare
from service.engine.outlines.outline import outline
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface
from service.surface.brep_model import BrepModel
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind

PATCHES = [
    name for name, each in EXAMPLES.items() if isinstance(each.surface().lower(), PatchModel)
]

EXPECTED = {
    "saddle": [(1, 4, 4, False)],
    "cylinder": [(12, 28, 10, True)],
    "sphere": [(8, 20, 6, True)],
    "torus": [(16, 32, 16, True)],
    "octahedral-sphere": [(8, 20, 6, True)],
    "bspline-ring": [(1, 2, 1, True)],
    "nurbs-goblet": [(1, 3, 2, True)],
    "bspline-hills": [(1, 4, 4, False)],
}
"""Faces, edges, vertices and whether all shells are closed, of each brep.

Each pole counts as an edge. The ring has two seams, the goblet a seam and two poles.
"""


def lower(surface: SurfaceKind) -> PatchModel:
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model


def read(document: dict[str, Any]) -> SurfaceKind:
    return validate_document(MeshRequest, {"surface": document}).to_surface()


def check(model: BrepModel) -> BrepModel:
    """The brep as a request would give it, with all its checks; its shells stay closed."""
    names = {each.name for each in fields(BrepSurface) if each.init} & {
        each.name for each in fields(BrepModel)
    }
    columns = {name: getattr(model, name) for name in names}
    checked = BrepSurface(**columns).lower()
    assert checked.is_closed.tolist() == model.is_closed.tolist()
    return checked


@pytest.mark.parametrize("name", PATCHES)
def test_outlines_are_valid_breps_with_their_own_parameter_curves(name: str) -> None:
    """Edges are on their surfaces, and no parameter curve must be made anew."""
    for brep in outline(lower(find(name).surface())):
        checked = check(replace(brep, uncertainty=1e-7 * brep.diagonal))
        prepared = prepare(checked)
        assert not prepared.is_replaced.any()
        assert not prepared.skipped_faces
        assert prepared.gaps.max() <= 1e-10 * brep.diagonal


@pytest.mark.parametrize("name", EXPECTED)
def test_numbers_of_faces_edges_and_vertices(name: str) -> None:
    found = [
        (brep.face_count, len(brep.edge_vertices), len(brep.vertices), bool(brep.is_closed.all()))
        for brep in outline(lower(find(name).surface()))
    ]
    assert found == EXPECTED[name]


def test_each_closed_shell_is_a_brep_of_its_own_and_open_ones_are_together() -> None:
    """The teapot has four shells, which are open where they meet; its faces are named by parts."""
    (teapot,) = outline(lower(find("utah-teapot").surface()))
    assert teapot.shell_counts.tolist() == [16, 4, 4, 8]
    assert not teapot.is_closed.any()
    names = [part.name for part in lower(find("utah-teapot").surface()).parts]
    assert list(dict.fromkeys(teapot.face_names)) == names
    ball, cube = find("sphere").surface(), find("cylinder").surface()
    assert len(outline(lower(ball))) == len(outline(lower(cube))) == 1


def _cell(points: Sequence[Sequence[float]]) -> dict[str, Any]:
    a, b, c, d = points
    return {"type": "bezier", "control_net": [[a, b], [c, d]]}


def test_faces_that_face_inwards_are_turned() -> None:
    """The sides of a cube, with any directions of u and v: all normals point outwards."""
    vertices = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
    sides = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (2, 3, 6, 7), (0, 2, 4, 6), (1, 3, 5, 7)]
    patches = [[[a, b], [c, d]] for a, b, c, d in sides]
    (cube,) = outline(lower(read({"type": "patches", "vertices": vertices, "patches": patches})))
    assert cube.is_closed.tolist() == [True]
    assert (len(cube.edge_vertices), len(cube.vertices)) == (12, 8)
    for face in range(6):
        net = cube.surfaces.points[4 * face : 4 * face + 4]
        normal = np.cross(net[2] - net[0], net[1] - net[0])
        outwards = (normal @ (net.mean(axis=0) - 0.5)) > 0
        assert cube.is_reversed[face] == (not outwards)
    check(cube)


def test_borders_that_agree_in_part_are_divided() -> None:
    """A spline of two spans beside two patches: its border becomes two edges."""
    wide = {
        "type": "bspline",
        "degree": 1,
        "knots": [[0, 0, 1, 1], [0, 0, 1, 2, 2]],
        "control_net": [[[0, 0, 0], [0, 1, 0], [0, 2, 0]], [[1, 0, 0], [1, 1, 0], [1, 2, 0]]],
    }
    low = _cell([[1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])
    high = _cell([[1, 1, 0], [1, 2, 0], [2, 1, 0], [2, 2, 0]])
    (sheet,) = outline(lower(read({"type": "multipatch", "surfaces": [wide, low, high]})))
    assert (sheet.face_count, len(sheet.shell_counts)) == (3, 1)
    assert sheet.loop_counts.tolist() == [5, 4, 4]
    # 13 sides, of which three pairs are one edge.
    assert len(sheet.edge_vertices) == 10
    assert check(sheet).loop_counts.tolist() == [5, 4, 4]


def test_strips_with_one_side_stay_open() -> None:
    """The ends of a Möbius strip would join the strip to its own back: they stay two edges."""
    angles = np.linspace(0, 2 * np.pi, 9)
    rows = []
    for angle in angles:
        middle = np.array([np.cos(angle), np.sin(angle), 0.0])
        across = np.cos(angle / 2) * middle + np.array([0, 0, np.sin(angle / 2)])
        rows.append([middle - 0.3 * across, middle + 0.3 * across])
    net = np.array(rows)
    net[-1] = net[0, ::-1]
    strip = {"type": "bspline", "degree": [1, 1], "control_net": net.tolist()}
    (brep,) = outline(lower(read(strip)))
    assert brep.is_closed.tolist() == [False]
    assert len(brep.edge_vertices) == 4
    check(brep)


def test_three_faces_at_one_edge_keep_edges_of_their_own() -> None:
    ends = [[0, 0, 0], [0, 0, 1]]
    wings = [_cell([*ends, [x, y, 0], [x, y, 1]]) for x, y in ((1, 0), (0, 1), (-1, 0))]
    (brep,) = outline(lower(read({"type": "multipatch", "surfaces": wings})))
    assert brep.shell_counts.tolist() == [1, 1, 1]
    assert len(brep.edge_vertices) == 12


def test_periodic_splines_are_closed_to_the_last_bit() -> None:
    """Clamping adds knots at both ends of the period; the ends stay equal."""
    profile = ((0, 1), (1, 1.3), (2, 0.7), (3, 1))
    net = [[[cos(k * tau / 7) * r, sin(k * tau / 7) * r, z] for z, r in profile] for k in range(7)]
    tube = {"type": "bspline", "knots": ["periodic", "clamped"], "control_net": net}
    (brep,) = outline(lower(read(tube)))
    assert (brep.face_count, len(brep.edge_vertices), len(brep.vertices)) == (1, 3, 2)
    points = brep.surfaces.points.reshape(*brep.surfaces.counts[0], 3)
    assert np.array_equal(points[0], points[-1])
    # Only the ends get more knots: the seam keeps the continuity of the others.
    knots = brep.surfaces.knots[: brep.surfaces.knot_starts[1]]
    assert np.unique(knots, return_counts=True)[1].tolist() == [4, *[1] * 6, 4]


def test_unclamped_splines_keep_their_points() -> None:
    net = [[[x, y, (x - 2) ** 2 * y] for y in range(5)] for x in range(5)]
    sheet = {"type": "bspline", "knots": ["uniform", "uniform"], "control_net": net}
    model = lower(read(sheet))
    (brep,) = outline(model)
    prepare(check(brep))
    corners = model.batches[0].corners.reshape(2, 2, 2, 2, 3)
    outer = [corners[u, v, u, v] for u in (0, 1) for v in (0, 1)]
    found = {tuple(np.round(point, 12)) for point in brep.vertices.tolist()}
    assert found == {tuple(np.round(point, 12)) for point in outer}


def test_discontinuous_splines_become_several_faces() -> None:
    """At a knot of multiplicity degree + 1 the surface may jump."""
    net = [[[x + 3 * (x > 1), y, 0] for y in range(2)] for x in range(4)]
    sheet = {
        "type": "bspline",
        "degree": 1,
        "knots": [[0, 0, 1, 1, 2, 2], [0, 0, 1, 1]],
        "control_net": net,
    }
    (brep,) = outline(lower(read(sheet)))
    assert (brep.face_count, brep.shell_counts.tolist()) == (2, [1, 1])
