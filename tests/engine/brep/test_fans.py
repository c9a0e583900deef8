"""Edges with more than two triangles: cubes that touch along an edge, and sheets around one."""

from itertools import product
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from oracles.topology import count_topology
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.fans import separate_fans
from service.engine.mesh.mesh import MeshReport
from service.pipeline.mesh import plan_mesh
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document

SQUARES = (
    (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
)  # fmt: skip
"""The sides of a cube whose corner k has the bits of k as x, y and z; seen from outside."""


def build_cubes(
    *corners: tuple[int, int, int],
) -> tuple[list[list[float]], list[list[int]], list[int]]:
    """Cubes with these lowest corners: points, shared where they touch; squares; their cubes."""
    numbers: dict[tuple[int, ...], int] = {}
    squares, cubes = [], []
    for cube, lowest in enumerate(corners):
        points = [tuple(np.add(lowest, step).tolist()) for step in product((0, 1), repeat=3)]
        number = [numbers.setdefault(point, len(numbers)) for point in points]
        squares += [[number[k] for k in square] for square in SQUARES]
        cubes += [cube] * 6
    return [list(map(float, point)) for point in numbers], squares, cubes


def triangulate(points: list[list[float]], squares: list[list[int]]) -> BrepTriangulation:
    """Two triangles in each square; each corner of a square is a corner of its face."""
    faces = np.repeat(np.arange(len(squares)), 2)
    first = 4 * np.arange(len(squares))[:, np.newaxis]
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    triangles = (first[:, np.newaxis] + halves).reshape(-1, 3)
    return BrepTriangulation(
        positions=np.array(points),
        triangles=triangles,
        faces=faces,
        points=np.array(squares).ravel(),
        corner_faces=np.repeat(np.arange(len(squares)), 4),
        places=np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (len(squares), 1)),
        face_bounds=np.zeros(len(squares)),
        edge_bounds=np.zeros(0),
        mesh_bounds=None,
        edge_starts=np.zeros(1, np.intp),
        edge_points=np.empty(0, np.intp),
        rounds=1,
    )


def list_points(triangulation: BrepTriangulation) -> list[list[int]]:
    points: list[list[int]] = triangulation.points[triangulation.triangles].tolist()
    return points


def test_cubes_that_touch_along_an_edge_are_separated() -> None:
    points, squares, cubes = build_cubes((0, 0, 0), (1, 1, 0))
    before = triangulate(points, squares)
    assert not count_topology(list_points(before)).watertight
    after, unpaired = separate_fans(before, np.zeros(12, np.intp))
    assert len(unpaired) == 0
    assert count_topology(list_points(after)).watertight
    assert len(after.positions) == 16
    # No vertex of one cube is one of the other, and nothing moved.
    rows = after.points[after.triangles]
    of_cube = [set(rows[np.array(cubes)[after.faces] == cube].ravel().tolist()) for cube in (0, 1)]
    assert not of_cube[0] & of_cube[1]
    np.testing.assert_array_equal(
        after.positions[rows], before.positions[before.points[before.triangles]]
    )
    np.testing.assert_array_equal(after.places[after.triangles], before.places[before.triangles])
    np.testing.assert_array_equal(after.corner_faces[after.triangles[:, 0]], after.faces)


def test_towers_that_touch_along_a_line_of_two_edges_are_separated() -> None:
    points, squares, _ = build_cubes((0, 0, 0), (1, 1, 0), (0, 0, 1), (1, 1, 1))
    # The two squares between a cube and the one above it are inside.
    uses = [sum(sorted(square) == sorted(other) for other in squares) for square in squares]
    kept = [square for square, count in zip(squares, uses, strict=True) if count == 1]
    assert len(kept) == 20
    after, unpaired = separate_fans(triangulate(points, kept), np.zeros(len(kept), np.intp))
    assert len(unpaired) == 0
    assert count_topology(list_points(after)).watertight


def test_pairs_that_are_connected_around_both_ends_stay_one_edge() -> None:
    # Two cubes touch along an edge, and cubes above and below both of them connect them.
    ring = [(x, y, z) for z in (0, 2) for x in (0, 1) for y in (0, 1)]
    points, squares, _ = build_cubes((0, 0, 1), (1, 1, 1), *ring)
    uses = [sum(sorted(square) == sorted(other) for other in squares) for square in squares]
    kept = [square for square, count in zip(squares, uses, strict=True) if count == 1]
    before = triangulate(points, kept)
    after, unpaired = separate_fans(before, np.zeros(len(kept), np.intp))
    assert len(unpaired) == 1
    ends = before.positions[unpaired[0]]
    assert ends.tolist() == [[1, 1, 1], [1, 1, 2]]
    assert not count_topology(list_points(after)).watertight


def test_cubes_of_two_shells_share_their_edge() -> None:
    points, squares, cubes = build_cubes((0, 0, 0), (1, 1, 0))
    before = triangulate(points, squares)
    after, unpaired = separate_fans(before, np.array(cubes))
    assert after is before
    assert len(unpaired) == 0


def test_cubes_that_touch_at_a_corner_are_not_changed() -> None:
    points, squares, _ = build_cubes((0, 0, 0), (1, 1, 1))
    before = triangulate(points, squares)
    assert separate_fans(before, np.zeros(12, np.intp))[0] is before


@pytest.mark.parametrize("count", [3, 5])
def test_an_odd_number_of_sheets_forms_no_pairs(count: int) -> None:
    points: list[list[float]] = [[0.0, 0, 0], [0, 0, 1]]
    squares = []
    for k in range(count):
        x, y = cos(2 * pi * k / count), sin(2 * pi * k / count)
        points += [[x, y, 0], [x, y, 1]]
        square = [0, 2 * k + 2, 2 * k + 3, 1]
        squares.append(square[:: (-1) ** k])
    before = triangulate(points, squares)
    after, unpaired = separate_fans(before, np.zeros(count, np.intp))
    assert after is before
    assert unpaired.tolist() == [[0, 1]]


def test_sheets_that_lie_on_each_other_form_no_pairs() -> None:
    points: list[list[float]] = [
        [0.0, 0, 0],
        [0, 0, 1],
        [1, 0, 0],
        [1, 0, 1],
        [1, 0, 0],
        [1, 0, 1],
        [-1, 0, 0],
        [-1, 0, 1],
    ]
    points += [[0, -1, 0], [0, -1, 1]]
    squares = [[0, 2, 3, 1], [1, 5, 4, 0], [0, 6, 7, 1], [1, 9, 8, 0]]
    after, unpaired = separate_fans(triangulate(points, squares), np.zeros(4, np.intp))
    assert unpaired.tolist() == [[0, 1]]
    assert len(after.positions) == 10


def describe(
    points: list[list[float]], squares: list[list[int]], shells: list[list[int]]
) -> dict[str, Any]:
    """A brep of plane squares."""
    pairs = sorted({tuple(sorted((s[k], s[k - 1]))) for s in squares for k in range(4)})
    faces = []
    for square in squares:
        a, b, c, d = (points[k] for k in square)
        steps = [(square[k], square[(k + 1) % 4]) for k in range(4)]
        loop = {
            "edges": [pairs.index((min(step), max(step))) for step in steps],
            "reversed": [step[0] > step[1] for step in steps],
        }
        faces.append({"surface": {"control_net": [[a, d], [b, c]]}, "loops": [loop]})
    return {
        "type": "brep",
        "vertices": points,
        "edges": [{"vertices": list(pair)} for pair in pairs],
        "faces": faces,
        "shells": [{"faces": shell, "closed": True} for shell in shells],
    }


def make_report(surface: dict[str, Any]) -> MeshReport:
    request = validate_document(MeshRequest, {"surface": surface})
    plan = plan_mesh(request.to_surface(), request.mesh_options(), BY_NAME["glb"], EncodeOptions())
    report = plan.run().report
    assert report is not None
    return report


def test_a_shell_of_two_cubes_at_an_edge_is_closed() -> None:
    points, squares, _ = build_cubes((0, 0, 0), (1, 1, 0))
    report = make_report(describe(points, squares, [list(range(12))]))
    assert report.brep is not None
    assert (report.brep.non_manifold_edges, report.brep.double_edges) == (0, 0)
    assert report.watertight
    assert report.triangles == 24


def test_sheets_around_an_edge_are_counted() -> None:
    points, squares, _ = build_cubes((0, 0, 0))
    # A wall inside of the cube's neighbour: a fifth and a sixth square at one edge, lying on each
    # other, which no angle puts in order.
    points += [[2.0, 2, 0], [2, 2, 1]]
    wall = [6, 8, 9, 7]
    squares += [wall, wall[::-1]]
    report = make_report(describe(points, squares, [list(range(8))]))
    assert report.brep is not None
    assert report.brep.non_manifold_edges == 1
    assert not report.watertight
