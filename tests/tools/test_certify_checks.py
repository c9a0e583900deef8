"""Tests of the checks of `make certify`: each finds its fault."""

import numpy as np
import pytest

from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.bezier import BezierSurface
from tests.oracles.sheets import build_sheets
from tools.certify.judge import count_edges, count_turned_triangles, find_flat_triangles
from tools.certify.models import BODIES, build_complex
from tools.certify.rounding import is_flattened_by_rounding
from tools.certify.seams import Joint, Ready, check_order, check_seams
from tools.certify.surfaces import FAMILIES
from tools.certify.written import Written, read

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def write_model(kind: str, seed: int) -> Written:
    """A model at a few divisions, its patches in order."""
    whole = build_complex(kind, seed)
    model = whole.model(range(len(whole.nets)))
    options = MeshOptions(resolution=(3, 3), normals=False)
    return read("json", render(Ready(model), options, BY_NAME["json"]))


def test_families_make_the_same_surfaces_every_time() -> None:
    assert sum(family.count for family in FAMILIES.values()) >= 1000
    for family in FAMILIES.values():
        one, two = (family.surface(7).control_net for _ in range(2))
        np.testing.assert_array_equal(one, two)
        assert family.surface(8).control_net.tobytes() != one.tobytes()


def test_triangles_without_area_are_counted() -> None:
    third = np.array([[0.1, 0, 0], [0.7, 0, 0], [0.3, 0, 0]])
    thin = third + np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 1e-300]])
    round_ = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert find_flat_triangles(np.array([third, thin, round_, third[[0, 0, 1]]])) == [0, 3]


def test_triangles_that_are_turned_over_are_counted() -> None:
    places = SQUARE[np.array([[0, 1, 2], [0, 2, 3], [0, 3, 2]])]
    assert count_turned_triangles(places) == 1
    # float32 cannot represent on which side of the line such a corner is.
    line = np.array([[[0.0, 0], [1, 1], [0.5, 0.5 - 1e-9]]])
    assert count_turned_triangles(line) == 0


def test_edges_are_counted() -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    assert count_edges(faces) == (4, 0)
    assert count_edges(np.append(faces, [[2, 0, 4]], axis=0)) == (6, 1)


@pytest.mark.parametrize("kind", BODIES)
def test_models_with_equal_edges_are_joined(kind: str) -> None:
    joint = Joint(kind=kind, seed=1)
    whole = build_complex(kind, 1)
    assert whole.alike == set(whole.edges())
    sides = check_seams(joint, whole, write_model(kind, 1))
    assert joint.wrong == []
    assert len(sides) == sum(map(len, whole.loops))
    assert joint.seams + joint.boundary // 3 == len(whole.edges())


def test_a_crack_is_detected() -> None:
    """A corner of one triangle moved by the least amount there is, as a vertex of its own."""
    mesh = write_model("prisms", 1)
    torn = mesh.faces.copy()
    torn[0, 0] = len(mesh.vertices)
    moved = np.nextafter(mesh.vertices[mesh.faces[0, :1]], 9.0)
    vertices = np.concatenate([mesh.vertices, moved])
    joint = Joint(kind="prisms", seed=1)
    broken = Written(vertices, torn, mesh.report, parts=mesh.parts)
    check_seams(joint, build_complex("prisms", 1), broken)
    assert joint.wrong
    check_order(joint, mesh, broken)
    assert joint.wrong[-1] == "patch 0 depends on the order of the patches"


def test_a_vertex_between_two_of_the_neighbour_is_detected() -> None:
    """One triangle beside a seam is cut in two, its neighbour on the other side is not."""
    mesh = write_model("tori", 1)
    whole = build_complex("tori", 1)
    joint = Joint(kind="tori", seed=1)
    sides = check_seams(joint, whole, mesh)
    assert not joint.wrong
    a, b, *_ = sides[0, min(pair for k, pair in sides if k == 0)]
    first, last = mesh.parts["patch 0"]
    (row,) = (k for k in range(first, last) if {a, b} <= set(mesh.faces[k].tolist()))
    (far,) = set(mesh.faces[row].tolist()) - {a, b}
    middle = len(mesh.vertices)
    vertices = np.append(mesh.vertices, mesh.vertices[[a, b]].mean(axis=0)[None], axis=0)
    faces = mesh.faces.copy()
    faces[row] = a, middle, far
    faces = np.insert(faces, row, [middle, b, far], axis=0)
    parts = {
        name: (start + (start > first), end + (start >= first))
        for name, (start, end) in mesh.parts.items()
    }
    check_seams(joint, whole, Written(vertices, faces, mesh.report, parts=parts))
    assert any("differ" in text for text in joint.wrong)


def test_only_rounding_excuses_a_triangle_without_area() -> None:
    """A strip 1e-9 wide and bent along: float32 puts three of its points in line."""
    net = np.array([[[0.5, 0, 0], [0.5, 1e-9, 0]], [[0.75, 0, 0.5], [0.75, 1e-9, 0.5]],
                    [[1, 0, 0], [1, 1e-9, 0]]])  # fmt: skip
    (sheet,) = build_sheets(BezierSurface(net))
    places = np.array([[0.25, 0], [0.25, 1], [0.75, 0]])
    points = sheet.at(places) + sheet.origin
    points[:, 1] += 1.0
    (sheet,) = build_sheets(BezierSurface(net + np.array([0.0, 1, 0])))
    rounded = points.astype(np.float32)
    written, steps = rounded.astype(float), np.spacing(rounded).astype(float) / 2
    assert find_flat_triangles(np.array([written, points])) == [0]
    assert is_flattened_by_rounding(sheet, written, places, steps)
    for axis in range(3):
        moved = written.copy()
        moved[1, axis] += 8 * steps[1, axis]
        assert not is_flattened_by_rounding(sheet, moved, places, steps)
    # Points in line are so without any rounding, and so is one named twice.
    straight = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]))
    (sheet,) = build_sheets(straight)
    for places in np.array([[[0.0, 0], [0.5, 0.5], [1, 1]], [[0.0, 0], [0.5, 0.25], [0, 0]]]):
        points = sheet.at(places) + sheet.origin
        assert not is_flattened_by_rounding(sheet, points, places, np.full((3, 3), 1e-7))
