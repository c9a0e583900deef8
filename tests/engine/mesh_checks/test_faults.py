"""Faults of meshes: counted by hand, and by a plain loop."""

from collections import Counter
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from service.bases.arrays import Ints
from service.engine.mesh_checks.faults import MeshFaults, find_faults, find_flat
from service.surface.given_mesh import GivenMesh

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
SHEET = np.array([[0, 1, 2], [1, 3, 2]])


def count(triangles: Ints) -> MeshFaults:
    """The faults of triangles of the four points."""
    return find_faults(GivenMesh(CORNERS.copy(), triangles))


@pytest.mark.parametrize(
    ("triangles", "faults"),
    [
        (TETRAHEDRON, (0, 0, 0, 0)),
        (TETRAHEDRON[1:], (3, 0, 0, 0)),  # a dropped triangle
        (np.vstack([TETRAHEDRON, TETRAHEDRON[:1]]), (0, 3, 0, 0)),  # one twice
        (np.vstack([TETRAHEDRON[:1, ::-1], TETRAHEDRON[1:]]), (0, 0, 3, 0)),  # a flipped one
        (SHEET, (4, 0, 0, 0)),
        (np.array([[0, 1, 2], [1, 2, 3]]), (4, 0, 1, 0)),
        (np.vstack([TETRAHEDRON, [[0, 0, 1]]]), (0, 0, 0, 1)),  # it has no edges
        (np.array([[1, 1, 1]]), (0, 0, 0, 1)),
    ],
)
def test_faults_of_small_meshes(triangles: Ints, faults: tuple[int, int, int, int]) -> None:
    assert astuple(count(triangles)) == faults


def test_soup_is_joined_at_equal_positions() -> None:
    soup = GivenMesh(CORNERS[TETRAHEDRON].reshape(-1, 3), np.arange(12).reshape(4, 3))
    assert astuple(find_faults(soup)) == (0, 0, 0, 0)


def test_zero_and_minus_zero_are_one_position() -> None:
    positions = CORNERS[TETRAHEDRON].reshape(-1, 3)
    positions[:3] = np.where(positions[:3] == 0, -0.0, positions[:3])
    soup = GivenMesh(positions, np.arange(12).reshape(4, 3))
    assert find_faults(soup).open_edges == 0


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_collinear_corners_have_no_area(scale: float) -> None:
    line = np.outer([0.0, 0.3, 1.0], [0.1, 0.7, -0.2])
    needle = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]])
    assert find_flat(np.array([line + 1, line, needle]) * scale).tolist() == [True, True, False]


@given(arrays(np.int64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.integers(0, 3)))
def test_faults_are_those_of_a_plain_count(triangles: Ints) -> None:
    uses: Counter[frozenset[int]] = Counter()
    sums: Counter[frozenset[int]] = Counter()
    degenerate = 0
    for corners in triangles.tolist():
        if len(set(corners)) < 3:
            degenerate += 1
            continue
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            uses[frozenset((a, b))] += 1
            sums[frozenset((a, b))] += 1 if a < b else -1
    flipped = sum(number == 2 and sums[edge] != 0 for edge, number in uses.items())
    several = sum(number > 2 for number in uses.values())
    alone = sum(number == 1 for number in uses.values())
    assert astuple(count(triangles)) == (alone, several, flipped, degenerate)
