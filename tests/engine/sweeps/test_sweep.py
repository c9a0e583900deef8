"""Meshes of tubes and ribbons: examples, corners, difficult curves, and predicted sizes."""

import math

import numpy as np
import pytest
import trimesh
from scipy.interpolate import BSpline

from service.bases.arrays import FloatArray
from service.engine.build import build
from service.engine.curves.arc_length import arc_lengths
from service.engine.curves.evaluation import CurveSamples
from service.engine.mesh.mesh import Mesh
from service.engine.options import Faces, MeshOptions
from service.engine.sweeps.sweep import predict_sweep
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.examples.splines import curl, streamer, trefoil
from service.surface.sweeps import RibbonSurface, TubeSurface


def build_spline(curve: BsplineCurve) -> BSpline:
    """The periodic B-spline as a SciPy object."""
    points = np.concatenate([curve.control_points, curve.control_points[: curve.degree]])
    return BSpline(curve.knot_vector, points, curve.degree)


def measure_greatest_curvature(curve: BsplineCurve) -> float:
    """The largest curvature |C′ × C″| / |C′|³ at 20,000 parameters."""
    spline = build_spline(curve)
    t = np.linspace(0, len(curve.control_points), 20_000)
    first, second = spline(t, 1), spline(t, 2)
    lengths = np.linalg.norm(np.cross(first, second), axis=1)
    return float((lengths / np.linalg.norm(first, axis=1) ** 3).max())


def load_in_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    """The mesh in trimesh, with one vertex for each position."""
    rows = mesh.triangles if mesh.welds is None else mesh.welds[mesh.triangles]
    return trimesh.Trimesh(mesh.positions, rows, process=False)


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_a_tube_along_a_trefoil_has_the_right_volume_and_normals(faces: Faces) -> None:
    """The volume is π r² times the length, within 1%, if radius × curvature ≤ 0.2."""
    curve = trefoil()
    radius = 0.2 / measure_greatest_curvature(curve)
    tube = TubeSurface(curve, np.array([radius]), sides=48)
    # Of a resolution, sweeps use only the first number: the divisions of each span of the curve.
    mesh = build(tube.lower(), MeshOptions(resolution=(8, 1), faces=faces))
    spans = len(curve.control_points)  # a periodic curve
    assert (mesh.report.watertight, mesh.report.boundary_edges) == (True, 0)
    assert mesh.report.vertices == spans * 8 * 48
    if faces == "quads":
        assert (len(mesh.quads), len(mesh.triangles)) == (spans * 8 * 48, 0)
        return
    solid = load_in_trimesh(mesh)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.euler_number == 0
    pieces = curve.lower()
    length = arc_lengths(pieces, CurveSamples.uniform(pieces.count, 8))[-1]
    assert solid.volume == pytest.approx(math.pi * radius**2 * length, rel=0.01)
    assert mesh.normals is not None
    normals = solid.face_normals[:, None]
    assert (normals * mesh.normals[mesh.triangles]).sum(axis=2).min() > 0.99
    # Each vertex is a point of the curve plus the radius times the normal.
    centres = mesh.positions - radius * mesh.normals
    curve_points = build_spline(curve)(np.linspace(0, spans, spans * 8 + 1))
    gaps = np.linalg.norm(centres[:, None] - curve_points[None], axis=2).min(axis=1)
    assert gaps.max() < 1e-9


def test_hair_tapers_to_its_point() -> None:
    mesh = build(curl().lower(), MeshOptions(resolution=(64, 1)))
    assert mesh.report.watertight
    assert load_in_trimesh(mesh).is_watertight
    curve = curl().curve
    tip = curve.control_points[-1]
    assert (mesh.positions == tip).all(axis=1).any()
    # For each of its 8 sides the tube has two triangles in each of 63 divisions, one in the last
    # division, where the radius falls to 0, and one in the cap at the root. The tip has no cap.
    assert mesh.report.triangles == 63 * 8 * 2 + 8 + 8


def test_normals_of_a_tube_of_varying_radius_are_right() -> None:
    """About a straight line they are exactly the normals of a surface of revolution."""
    line = BezierCurve(np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 4]]))
    radii = np.array([0.5, 1.5, 0.25])
    tube = TubeSurface(line, radii, sides=5, caps=False)
    mesh = build(tube.lower(), MeshOptions(resolution=(10, 1)))
    t = np.arange(11) / 10
    z = 2 * t * (1 - t) + 4 * t * t
    # The derivatives of z and of the radius.
    speed = 2 * (1 - t) + 6 * t
    rate = 2 * ((1 - t) * (radii[1] - radii[0]) + t * (radii[2] - radii[1]))
    (grid,) = mesh.grids  # (1, 11, 6): vertices of the one patch, along the line and around it
    assert mesh.normals is not None
    assert mesh.positions[grid[0, :, 0], 2] == pytest.approx(z, abs=1e-12)
    expected = -rate / np.hypot(rate, speed)
    for column in range(5):
        assert mesh.normals[grid[0, :, column], 2] == pytest.approx(expected, abs=1e-12)


def test_a_ribbon_follows_the_curve_and_its_profile() -> None:
    ribbon = streamer()
    mesh = build(ribbon.lower(), MeshOptions(resolution=(12, 1), faces="quads"))
    (grid,) = mesh.grids
    left, right = mesh.positions[grid[0, :, 0]], mesh.positions[grid[0, :, 1]]
    curve = ribbon.curve
    assert isinstance(curve, BsplineCurve)
    t = np.arange(49) / 12
    points = BSpline(curve.knot_vector, curve.control_points, 3)(t)
    assert (left + right) / 2 == pytest.approx(points, abs=1e-12)
    s = t / 4  # the curve has four spans
    width = sum(
        math.comb(4, i) * s**i * (1 - s) ** (4 - i) * w for i, w in enumerate(ribbon.width.tolist())
    )
    assert np.linalg.norm(right - left, axis=1) == pytest.approx(width, abs=1e-12)
    assert mesh.normals is not None
    assert (mesh.normals[:, 2] > 0).all()
    # All faces are quads, except for a triangle at each tip.
    assert (mesh.report.quads, mesh.report.triangles) == (46, 2)


def test_a_tube_along_a_closed_curve_has_caps_if_its_end_radii_differ() -> None:
    """Without caps its Euler characteristic is 0, as of a torus; with caps 2, as of a sphere."""
    loop = BezierCurve(np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 0]]))
    joined_tube = build(TubeSurface(loop, np.array([0.1])).lower(), MeshOptions())
    assert load_in_trimesh(joined_tube).euler_number == 0
    capped_tube = build(TubeSurface(loop, np.array([0.1, 0.2])).lower(), MeshOptions())
    assert capped_tube.report.watertight
    assert load_in_trimesh(capped_tube).euler_number == 2


CURVES: dict[str, FloatArray] = {
    "arch": np.array([[0.0, 0, 0], [1, 1, 0], [0, 1, 1], [1, 0, 3]]),
    "cusp": np.array([[0.0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0]]),
    "loop": np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]]),
    "line": np.array([[0.0, 0], [1, 2]]),
}


@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("corners", [False, True])
@pytest.mark.parametrize("name", CURVES)
def test_no_mesh_is_larger_than_predicted(name: str, corners: bool, faces: Faces) -> None:
    points = CURVES[name]
    curve = BsplineCurve(points, 1) if corners else BezierCurve(points)
    for surface in (
        TubeSurface(curve, np.array([0.1]), sides=5),
        TubeSurface(curve, np.array([0.0, 0.1, 0.0]), sides=3),
        RibbonSurface(curve, np.array([0.0, 0.2])),
    ):
        for options in (
            MeshOptions((6, 1), faces=faces),
            MeshOptions((1, 9), faces=faces, weld=False),
        ):
            model = surface.lower()
            vertices, triangles, quads, grids = predict_sweep(model, options)
            mesh = build(model, options)
            assert len(mesh.positions) <= vertices
            assert len(mesh.quads) <= quads
            assert len(mesh.triangles) + len(mesh.quads) <= triangles + quads
            assert sum(len(grid) for grid in mesh.grids) <= grids
            low, high = model.bounds
            assert (mesh.positions >= low - 1e-12).all()
            assert (mesh.positions <= high + 1e-12).all()


DIFFICULT_CURVES: dict[str, Curve] = {
    "heavy end": BezierCurve(np.array([[-2.0, 2], [0, -1]]), np.array([1e8, 1])),
    "tiny": BezierCurve(np.array([[1e-300, 0], [2e-300, 1e-300], [0, 1e-300]])),
    "far": BezierCurve(np.array([[1e15, 0, 0], [1e15 + 1, 1, 0], [1e15, 2, 1]])),
    "grid of rounding": BsplineCurve(
        np.array([[0.0, 1, 2], [1, 0, 2], [2, 2, 0], [0, 0, 1], [1, 2, 2]]) + 1e15, 2, "periodic"
    ),
    "points in a row": BsplineCurve(np.array([[0.0, 0], [1, 0], [1, 0], [1, 0], [0, 0]]), 1),
    "there and back": BezierCurve(np.array([[0.0, 0], [1, 0], [0, 0]])),
}


@pytest.mark.parametrize("crease", [0.0, 0.02, math.pi])
@pytest.mark.parametrize("name", DIFFICULT_CURVES)
def test_tubes_along_difficult_curves_are_closed_and_finite(name: str, crease: float) -> None:
    """They also have unit normals and stay within the predicted size."""
    curve = DIFFICULT_CURVES[name]
    size = float(np.ptp(curve.control_points, axis=0).max())
    tube = TubeSurface(curve, np.array([0.1, 0.2, 0.1]) * size, sides=3)
    options = MeshOptions((4, 1), crease_angle=crease)
    mesh = build(tube.lower(), options)
    assert np.isfinite(mesh.positions).all()
    assert mesh.normals is not None
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1, abs=1e-12)
    assert mesh.report.watertight
    assert len(mesh.positions) <= predict_sweep(tube.lower(), options)[0]
