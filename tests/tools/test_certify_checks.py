"""Tests of the checks of `make certify`: each check detects its fault."""

import numpy as np
import pytest

from oracles.sheets import build_sheets
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.bezier import BezierSurface
from tools.certify.judge import count_edges, count_reversed_triangles, find_flat_triangles
from tools.certify.models import BODIES, build_complex
from tools.certify.rounding import is_flattened_by_rounding
from tools.certify.seams import LoweredSurface, SeamReport, check_order, check_seams
from tools.certify.surfaces import FAMILIES
from tools.certify.written import Written, read_file

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def write_model(kind: str, seed: int) -> Written:
    """The mesh of a model at 3 × 3 divisions, written to a file and read from it."""
    net_complex = build_complex(kind, seed)
    model = net_complex.model(range(len(net_complex.nets)))
    options = MeshOptions(resolution=(3, 3), normals=False)
    return read_file("json", render(LoweredSurface(model), options, BY_NAME["json"]))


def test_families_build_equal_surfaces_from_equal_seeds() -> None:
    assert sum(family.count for family in FAMILIES.values()) >= 1000
    for family in FAMILIES.values():
        first_net, second_net = (family.surface(7).control_net for _ in range(2))
        np.testing.assert_array_equal(first_net, second_net)
        assert family.surface(8).control_net.tobytes() != first_net.tobytes()


def test_triangles_without_area_are_found() -> None:
    collinear_points = np.array([[0.1, 0, 0], [0.7, 0, 0], [0.3, 0, 0]])
    thin_triangle = collinear_points + np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 1e-300]])
    right_triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    corners = np.array(
        [collinear_points, thin_triangle, right_triangle, collinear_points[[0, 0, 1]]]
    )
    assert find_flat_triangles(corners) == [0, 3]


def test_reversed_triangles_are_counted() -> None:
    places = SQUARE[np.array([[0, 1, 2], [0, 2, 3], [0, 3, 2]])]
    assert count_reversed_triangles(places) == 1
    # The third corner is so near to the line that the rounding of float32 may move it across.
    line = np.array([[[0.0, 0], [1, 1], [0.5, 0.5 - 1e-9]]])
    assert count_reversed_triangles(line) == 0


def test_edges_with_one_triangle_and_with_more_than_two_are_counted() -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    assert count_edges(faces) == (4, 0)
    assert count_edges(np.append(faces, [[2, 0, 4]], axis=0)) == (6, 1)


@pytest.mark.parametrize("kind", BODIES)
def test_models_with_equal_edges_are_joined(kind: str) -> None:
    seam_report = SeamReport(kind=kind, seed=1)
    net_complex = build_complex(kind, 1)
    assert net_complex.alike == set(net_complex.edges())
    sides = check_seams(seam_report, net_complex, write_model(kind, 1))
    assert seam_report.faults == []
    assert len(sides) == sum(map(len, net_complex.loops))
    # Each edge of the model that is no seam has three divisions, which are boundary edges.
    assert seam_report.seams + seam_report.boundary // 3 == len(net_complex.edges())


def test_a_crack_is_detected() -> None:
    """A corner of one triangle becomes a vertex of its own, moved to the next float."""
    mesh = write_model("prisms", 1)
    faces = mesh.faces.copy()
    faces[0, 0] = len(mesh.vertices)
    moved_corner = np.nextafter(mesh.vertices[mesh.faces[0, :1]], 9.0)
    vertices = np.concatenate([mesh.vertices, moved_corner])
    seam_report = SeamReport(kind="prisms", seed=1)
    cracked_mesh = Written(vertices, faces, mesh.report, parts=mesh.parts)
    check_seams(seam_report, build_complex("prisms", 1), cracked_mesh)
    assert seam_report.faults
    check_order(seam_report, mesh, cracked_mesh)
    assert seam_report.faults[-1] == "patch 0 depends on the order of the patches"


def test_a_vertex_on_a_seam_that_the_neighbour_does_not_have_is_detected() -> None:
    """One triangle at a seam is split in two, but its neighbour on the other side is not."""
    mesh = write_model("tori", 1)
    net_complex = build_complex("tori", 1)
    seam_report = SeamReport(kind="tori", seed=1)
    sides = check_seams(seam_report, net_complex, mesh)
    assert not seam_report.faults
    # The keys of `sides` are the number of a patch and the pair of corners at the ends of a side;
    # the values are the vertices of the side. The first edge of a side of patch 0 is split.
    a, b, *_ = sides[0, min(pair for k, pair in sides if k == 0)]
    first_face, end_face = mesh.parts["patch 0"]
    (row,) = (k for k in range(first_face, end_face) if {a, b} <= set(mesh.faces[k].tolist()))
    (opposite_vertex,) = set(mesh.faces[row].tolist()) - {a, b}
    new_vertex = len(mesh.vertices)
    vertices = np.append(mesh.vertices, mesh.vertices[[a, b]].mean(axis=0)[None], axis=0)
    faces = mesh.faces.copy()
    faces[row] = a, new_vertex, opposite_vertex
    faces = np.insert(faces, row, [new_vertex, b, opposite_vertex], axis=0)
    # Patch 0 has one triangle more, so the triangles of later patches move by one.
    parts = {
        name: (begin + (begin > first_face), end + (begin >= first_face))
        for name, (begin, end) in mesh.parts.items()
    }
    check_seams(seam_report, net_complex, Written(vertices, faces, mesh.report, parts=parts))
    assert any("differ" in text for text in seam_report.faults)


def test_a_triangle_without_area_is_excused_only_if_rounding_is_the_reason() -> None:
    """The strip is 1e-9 wide; rounding to float32 makes three of its points collinear."""
    net = np.array([[[0.5, 0, 0], [0.5, 1e-9, 0]], [[0.75, 0, 0.5], [0.75, 1e-9, 0.5]],
                    [[1, 0, 0], [1, 1e-9, 0]]])  # fmt: skip
    (sheet,) = build_sheets(BezierSurface(net))
    places = np.array([[0.25, 0], [0.25, 1], [0.75, 0]])
    points = sheet.at(places) + sheet.origin
    # Near y = 1 the numbers of float32 are 6e-8 or more apart; near 0 they could represent 1e-9.
    points[:, 1] += 1.0
    (sheet,) = build_sheets(BezierSurface(net + np.array([0.0, 1, 0])))
    rounded_points = points.astype(np.float32)
    # The largest error of rounding is half of the distance to the next number.
    written, rounding = rounded_points.astype(float), np.spacing(rounded_points).astype(float) / 2
    assert find_flat_triangles(np.array([written, points])) == [0]
    assert is_flattened_by_rounding(sheet, written, places, rounding)
    # A corner that was moved by more than rounding is not excused.
    for axis in range(3):
        moved_points = written.copy()
        moved_points[1, axis] += 8 * rounding[1, axis]
        assert not is_flattened_by_rounding(sheet, moved_points, places, rounding)
    # Points that are collinear without rounding, and equal points, are not excused.
    flat_patch = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]))
    (sheet,) = build_sheets(flat_patch)
    for places in np.array([[[0.0, 0], [0.5, 0.5], [1, 1]], [[0.0, 0], [0.5, 0.25], [0, 0]]]):
        points = sheet.at(places) + sheet.origin
        assert not is_flattened_by_rounding(sheet, points, places, np.full((3, 3), 1e-7))
