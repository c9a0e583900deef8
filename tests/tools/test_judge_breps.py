"""The proof for breps accepts a true mesh of a cylinder, and finds three faults in it."""

from itertools import pairwise
from math import cos, pi
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from tools.judge.__main__ import Case, Verdict, judge_cases, list_cases
from tools.judge.breps import BrepProof, Face, list_boxes, prove_brep
from tools.judge.exact import Array, list_nets

SECTORS, RADIUS, HEIGHT = 18, 5.0, 12.0
BOUND = RADIUS * (1 - cos(pi / SECTORS)) * 1.03
"""A little more than the largest distance of the cylinder from a prism of 18 sides."""


@pytest.fixture(scope="module")
def cylinder() -> dict[str, Any]:
    return read_solid("cylinder")


def write_sides() -> list[Array]:
    """The triangles of the prism, without its ends."""
    a, b = (list_corners(z) for z in (0.0, HEIGHT))
    quads = zip(a[:-1], a[1:], b[1:], b[:-1], strict=True)
    return [np.stack(t) for p, q, r, s in quads for t in ((p, q, r), (p, r, s))]


def list_corners(z: float, radius: float = RADIUS) -> Array:
    angle = 2 * pi * np.arange(SECTORS + 1) / SECTORS
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z + 0 * angle])


def write_end(z: float) -> list[Array]:
    middle, ring = np.array([0.0, 0, z]), list_corners(z)
    return [np.stack([middle, p, q]) for p, q in pairwise(ring)]


def prove_triangles(cylinder: dict[str, Any], triangles: list[Array]) -> BrepProof:
    tolerance = 0.01 * float(np.linalg.norm([10, 10, 12]))
    return prove_brep(cylinder, np.stack(triangles), np.zeros(3), BOUND, tolerance)


def test_a_prism_is_proved_to_be_near_its_cylinder(cylinder: dict[str, Any]) -> None:
    proof = prove_triangles(cylinder, write_sides() + write_end(0.0) + write_end(HEIGHT))
    assert (proof.undecided, proof.beyond) == (0, None)


def test_a_displaced_vertex_is_found(cylinder: dict[str, Any]) -> None:
    corners = np.stack(write_sides() + write_end(0.0) + write_end(HEIGHT))
    is_moved = (corners == corners[0, 0]).all(axis=2)
    corners[is_moved] -= [1.5 * BOUND, 0, 0]
    proof = prove_triangles(cylinder, list(corners))
    assert (proof.beyond or 0) > BOUND


@pytest.mark.parametrize("number", [3, 2 * SECTORS + 5])
def test_a_dropped_triangle_is_found(cylinder: dict[str, Any], number: int) -> None:
    """A triangle of the side, and one of an end."""
    triangles = write_sides() + write_end(0.0) + write_end(HEIGHT)
    del triangles[number]
    proof = prove_triangles(cylinder, triangles)
    assert (proof.beyond or 0) > BOUND
    assert proof.face == (0 if number == 3 else 2)


def test_a_face_that_is_trimmed_on_the_wrong_side_is_found(cylinder: dict[str, Any]) -> None:
    """The upper end is what lies around the disc."""
    near, far = list_corners(HEIGHT), list_corners(HEIGHT, 2 * RADIUS)
    quads = zip(near[:-1], near[1:], far[1:], far[:-1], strict=True)
    ring = [np.stack(t) for p, q, r, s in quads for t in ((p, q, r), (p, r, s))]
    proof = prove_triangles(cylinder, write_sides() + write_end(0.0) + ring)
    assert (proof.beyond or 0) > BOUND
    assert proof.face == 1


@pytest.mark.parametrize("name", ["frustum", "sphere_hole"])
def test_meshes_of_solids_are_proved(name: str) -> None:
    """The test takes two solids; `make judge` takes all, at a finer tolerance too."""
    case = Case(f"solid {name}", None, {"relative_tolerance": 1e-2}, "glb")
    (verdict,) = judge_cases([case])
    assert isinstance(verdict, Verdict), verdict
    assert (verdict.proof.undecided, verdict.proof.beyond) == (0, None)
    assert verdict.triangles < 400


def test_all_valid_solids_are_judged_at_two_tolerances() -> None:
    cases = [case for case in list_cases(names=("solids",)) if case.seed is None]
    assert len(cases) == 2 * 26


def test_boxes_of_cells_are_those_of_their_nets() -> None:
    """The boxes of all patches have corners at which the surface has the corners of the nets."""
    (entry,) = (face for face in read_solid("sphere")["faces"])
    surface = entry["surface"]
    (net,) = list_nets(surface, np.zeros(3))
    face = Face(net, list_boxes(surface), None)
    labels = np.array([[3, 3, 5], [1, 3, 6], [1, 4, 1]])
    low, high = face.find_boxes(labels)
    whole_low, whole_high = face.boxes[[3, 3, 5]].swapaxes(0, 1)
    size = whole_high - whole_low
    np.testing.assert_allclose(
        (low - whole_low) / size, np.array([[0.0, 0], [0.5, 0], [0.5, 0]]), atol=1e-15
    )
    shares = (high - whole_low) / size
    np.testing.assert_allclose(shares, np.array([[1.0, 1], [1, 0.25], [0.75, 1]]), atol=1e-15)
    assert len(net) == len(face.boxes) == 6
