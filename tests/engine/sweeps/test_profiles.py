"""Tubes and ribbons along paths: they are closed and have the right width and normals."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from oracles.topology import count_topology, volume, winding_agreement
from service.bases.arrays import FloatArray
from service.engine.options import Faces, MeshOptions
from service.engine.sweeps.paths import Paths, bound_frame_count, build_path
from service.engine.sweeps.profiles import build_ribbons, build_tubes
from service.engine.sweeps.rows import SweptGrids
from service.engine.sweeps.sweep import build_swept_mesh
from service.surface.curve import BezierCurve
from service.surface.curve_model import CurvePieces

ARCH = [[0, 0, 0], [1, 1, 0], [0, 1, 1], [1, 0, 3]]
CUSP = [[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0]]
THERE_AND_BACK = [[0, 0, 0], [1, 0, 0], [0, 0, 0]]
LOOP = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]]
LINE = [[0, 0, 0], [1, 2, 3]]
CREASE_ANGLE = 0.02
"""The crease angle of all paths, in radians."""
CURVES = {"arch": ARCH, "cusp": CUSP, "back": THERE_AND_BACK, "loop": LOOP, "line": LINE}


def build_curve(points: Sequence[Sequence[float]]) -> CurvePieces:
    """The pieces of a Bézier curve with these control points."""
    return BezierCurve(np.array(points, dtype=float)).lower()


def is_closed(swept: SweptGrids) -> bool:
    """Whether exactly two faces use each edge, in opposite directions."""
    rows = (swept.triangles, swept.quads)
    return count_topology(
        face for faces in rows for face in swept.same_position[faces].tolist()
    ).watertight


def build_trefoil(count: int) -> tuple[FloatArray, FloatArray]:
    """Points and unit tangents of a trefoil knot, (count+1, 3); the last point is the first."""
    t = np.linspace(0, 2 * math.pi, count + 1)
    t[-1] = 0.0
    points = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1
    )
    slopes = np.stack(
        [np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t)], axis=1
    )
    return points, slopes / np.linalg.norm(slopes, axis=1)[:, None]


@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("sides", [3, 7])
@pytest.mark.parametrize("divisions", [1, 2, 5])
@pytest.mark.parametrize("name", CURVES)
def test_tubes_are_closed_and_have_unit_normals(
    name: str, divisions: int, sides: int, faces: Faces
) -> None:
    pieces = build_curve(CURVES[name])
    path = build_path(pieces, divisions, CREASE_ANGLE)
    swept = build_tubes(path, 0.1, sides, faces=faces)
    assert is_closed(swept)
    assert np.isfinite(swept.positions).all()
    assert np.linalg.norm(swept.normals, axis=1) == pytest.approx(1, abs=1e-12)
    assert path.points.shape[1] <= bound_frame_count(pieces, divisions, CREASE_ANGLE)


def test_a_conical_tube_has_the_normals_and_the_volume_of_a_cone() -> None:
    """The radius is 1 at the bottom and 0 at the top; the height is 2."""
    path = build_path(build_curve([[0, 0, 0], [0, 0, 2]]), 2, CREASE_ANGLE)
    # At all 3 frames the radius changes by −1/2 for each unit of length.
    swept = build_tubes(path, 1.0 - path.parameters, 64, slopes=np.full((1, 3), -0.5))
    # The normals of the cap at the bottom are (0, 0, −1).
    side_normals = swept.normals[np.abs(swept.normals[:, 2] + 1) > 1e-9]
    assert side_normals[:, 2] == pytest.approx(1 / math.sqrt(5), abs=1e-12)
    assert volume(swept.positions, swept.triangles) == pytest.approx(2 * math.pi / 3, rel=0.002)
    assert is_closed(swept)


def test_rings_at_the_seam_of_a_closed_curve_are_equal() -> None:
    """The last ring equals the first; the angle between neighbouring rings is small everywhere."""
    points, tangents = build_trefoil(96)
    swept = build_tubes(
        Paths.from_smooth_curves(points[None], tangents[None], closed=True), 0.3, 12
    )
    # A ring has 12 sides and 13 samples, the first and the last at one place.
    rings = swept.normals.reshape(97, 13, 3)
    assert rings[-1] == pytest.approx(rings[0], abs=1e-12)
    angles = np.arccos(np.clip(np.einsum("krd,krd->kr", rings[1:], rings[:-1]), -1, 1))
    assert angles.max() < 0.3
    assert is_closed(swept)
    # The sum of the cosines between the normal of a face and those of its 3 vertices, at most 3.
    assert winding_agreement(swept.positions, swept.normals, swept.triangles).min() > 2.85


def test_frames_minimise_rotation_about_the_curve() -> None:
    """Relative to the Frenet frame of a helix, the frame rotates back by the torsion."""
    t = np.linspace(0, 2 * math.pi, 400)
    points = np.stack([np.cos(t), np.sin(t), t / 2], axis=1)
    tangents = np.stack([-np.sin(t), np.cos(t), np.full_like(t, 0.5)], axis=1) / math.sqrt(1.25)
    swept = build_tubes(Paths.from_smooth_curves(points[None], tangents[None]), 0.1, 4, caps=False)
    normals = swept.normals.reshape(400, 5, 3)[:, 0]
    inwards = np.stack([-np.cos(t), -np.sin(t), np.zeros_like(t)], axis=1)
    binormals = np.cross(tangents, inwards)
    angle = np.unwrap(
        np.arctan2((normals * binormals).sum(axis=1), (normals * inwards).sum(axis=1))
    )
    torsion, speed = 0.5 / 1.25, math.sqrt(1.25)
    assert angle - angle[0] == pytest.approx(-torsion * speed * t, abs=1e-6)


def test_tubes_of_several_curves_are_equal_to_single_tubes() -> None:
    points, tangents = build_trefoil(24)
    rotated = points[:, [1, 2, 0]], tangents[:, [1, 2, 0]]
    two_paths = Paths.from_smooth_curves(
        np.stack([points, rotated[0]]), np.stack([tangents, rotated[1]])
    )
    both_tubes = build_tubes(two_paths, 0.2, 5)
    for k, (p, t) in enumerate([(points, tangents), rotated]):
        single_tube = build_tubes(Paths.from_smooth_curves(p[None], t[None]), 0.2, 5)
        first = k * len(single_tube.positions)
        vertices = slice(first, first + len(single_tube.positions))
        assert np.array_equal(both_tubes.positions[vertices], single_tube.positions)
        assert np.array_equal(both_tubes.normals[vertices], single_tube.normals)
        faces = slice(k * len(single_tube.triangles), (k + 1) * len(single_tube.triangles))
        assert np.array_equal(both_tubes.triangles[faces], single_tube.triangles + np.uint32(first))


def test_the_normals_of_a_ribbon_are_as_near_to_facing_as_possible() -> None:
    """`facing` is a direction; the normal is its part perpendicular to the tangent."""
    points, tangents = build_trefoil(64)
    path = Paths.from_smooth_curves(points[None], tangents[None], closed=True)
    facing = np.array([1.0, 2.0, 7.0])
    swept = build_ribbons(path, 0.2, facing=facing, faces="quads")
    assert len(swept.quads) == 64
    borders = swept.positions.reshape(65, 2, 3)  # for each frame a point on both borders
    assert np.linalg.norm(borders[:, 1] - borders[:, 0], axis=1) == pytest.approx(0.2, abs=1e-12)
    assert borders.mean(axis=1) == pytest.approx(points, abs=1e-12)
    expected = facing - (tangents @ facing)[:, None] * tangents
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert swept.normals.reshape(65, 2, 3)[:, 0] == pytest.approx(expected, abs=1e-9)


def test_a_ribbon_along_the_direction_facing_has_the_given_width() -> None:
    """All normals are perpendicular to `facing`, so none is nearer to it than the others."""
    swept = build_ribbons(
        build_path(build_curve(LINE), 3, CREASE_ANGLE), 0.1, facing=np.array([1.0, 2.0, 3.0])
    )
    borders = swept.positions.reshape(4, 2, 3)
    assert np.linalg.norm(borders[:, 1] - borders[:, 0], axis=1) == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("uvs", [False, True])
@pytest.mark.parametrize("weld", [False, True])
def test_the_report_of_a_tube_says_whether_it_is_closed(weld: bool, uvs: bool) -> None:
    swept = build_tubes(build_path(build_curve(ARCH), 6, CREASE_ANGLE), 0.1, 8)
    mesh = build_swept_mesh("tube", swept, MeshOptions(weld=weld, uvs=uvs))
    assert mesh.report.watertight is weld
    assert (mesh.report.boundary_edges == 0) is weld
    # 6 divisions of 8 sides, and two caps of 8 triangles about a centre.
    assert mesh.report.triangles == len(mesh.triangles) == 6 * 8 * 2 + 2 * 8
    if weld:
        assert mesh.report.vertices == 7 * 8 + 2
    assert (mesh.uvs is not None) is uvs
