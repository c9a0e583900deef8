"""Meshes that clients give are checked when they are created."""

import numpy as np
import pytest

from service.surface.checks import MAX_COORDINATE
from service.surface.given_mesh import GivenMesh

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACE = np.array([[0, 1, 2]])


def test_corners_are_the_positions_of_triangles() -> None:
    mesh = GivenMesh(CORNERS, FACE[:, [2, 0, 1]])
    assert mesh.corners.tolist() == [[[0, 1, 0], [0, 0, 0], [1, 0, 0]]]


@pytest.mark.parametrize(
    ("positions", "triangles"),
    [
        (CORNERS[:, :2], FACE),
        (CORNERS, FACE[:, :2]),
        (CORNERS, FACE[:0]),
        (CORNERS, FACE + 1),
        (CORNERS, FACE - 1),
        (np.full((3, 3), np.nan), FACE),
        (np.full((3, 3), np.inf), FACE),
        (CORNERS * MAX_COORDINATE * 2, FACE),
    ],
)
def test_other_arrays_are_refused(positions: np.ndarray, triangles: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"must|needs"):
        GivenMesh(positions.copy(), triangles.copy())


def test_normals_are_finite_and_one_for_each_position() -> None:
    assert GivenMesh(CORNERS, FACE, np.zeros((3, 3))).normals is not None
    for normals in (np.zeros((2, 3)), np.full((3, 3), np.nan)):
        with pytest.raises(ValueError, match="normals"):
            GivenMesh(CORNERS, FACE, normals)
