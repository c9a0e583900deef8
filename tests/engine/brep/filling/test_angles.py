"""Angles of normals along edges of triangles and along borders, on a quarter of a cylinder."""

import numpy as np
import pytest

from service.engine.brep.filling.angles import find_turning_edges
from tests.engine.brep.filled_faces import CYLINDER, PLANE, SQUARE, fill


@pytest.mark.parametrize("angle", [0.1, 0.7, 1.5, 1.6])
def test_edges_that_turn_more_than_the_angle_are_found(angle: float) -> None:
    filled = fill([SQUARE], [SQUARE], [SQUARE])
    corners = filled.corners
    faces = np.full(3, CYLINDER)
    quarter = 1 << 30
    filled.insert(
        faces, np.array([[quarter // 4, 7], [quarter // 2, 99], [3 * quarter // 4, 1000]])
    )
    triangles = filled.read()
    result = find_turning_edges(corners, triangles, angle)
    assert not result[:, corners.faces[triangles[0]] == PLANE].any()
    own = corners.faces[triangles[0]] == CYLINDER
    # Normals of the cylinder about the axis z are along its points.
    points = corners.positions[corners.points[triangles]][..., :2]
    turn = np.abs(np.diff(np.arctan2(points[..., 1], points[..., 0]), axis=0, append=0))
    begins = np.arctan2(points[..., 1], points[..., 0])
    turn = np.abs(begins - begins[[1, 2, 0]])
    # Normals are taken a little inside of triangles.
    expected = ~corners.find_fixed(triangles) & (turn > angle)
    clear = np.abs(turn - angle) > 0.001
    assert (result == expected)[:, own][clear[:, own]].all()
    assert expected[:, own].any() == (angle < 1.5)
