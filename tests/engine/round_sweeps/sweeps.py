"""Tubes and ribbons, their meshes by tolerance, and their comparison with the oracle."""

from typing import Any

import numpy as np

from oracles.distance import Soup
from oracles.sweeps import sample_ribbon, sample_tube
from service.engine.bounds.goal import Goal
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.round_sweeps.mesher import SweepMesher
from service.engine.stored_positions import Storage
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.sweeps import RibbonSurface, TubeSurface
from tests.strategies import Array

HALF = np.sqrt(0.5)
CIRCLE = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0], [-1, -1, 0], [0, -1, 0],
          [1, -1, 0], [1, 0, 0]]  # fmt: skip
CUBIC = [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]
STAIRS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 0.2, 1]]


def bezier(points: Any, weights: Any = None) -> BezierCurve:
    return BezierCurve(np.array(points, dtype=float), weights)


def tube(curve: Any, radius: Any, **fields: Any) -> TubeSurface:
    return TubeSurface(curve, np.array(radius, dtype=float), **fields)


def ribbon(curve: Any, width: Any, **fields: Any) -> RibbonSurface:
    return RibbonSurface(curve, np.array(width, dtype=float), **fields)


def bspline(points: Any, degree: int = 3, **fields: Any) -> BsplineCurve:
    return BsplineCurve(np.array(points, dtype=float), degree, **fields)


KNOTS = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2]
BENT = [[0, 0, 0], [1, 0, 0], [2, 0, 0.3], [2, 2, 0], [1, 3, 1], [0, 3, 1], [0, 1, 1]]

TUBES: dict[str, TubeSurface] = {
    "cubic": tube(bezier(CUBIC), 0.3),
    "wider than its bend": tube(bezier(CUBIC), 2.5),
    "tapered": tube(bezier(CUBIC), [0.3, 0.1, 0]),
    "cylinder": tube(bezier(CUBIC[:2]), 0.3),
    "cone": tube(bezier(CUBIC[:2]), [0.3, 0]),
    "vase": tube(bezier([[0, 0, 0], [0, 0, 1], [0, 0, 3]]), [0.3, 0.1, 1, 0.2]),
    "stairs": tube(bspline(STAIRS, 1), 0.1),
    "tapered stairs": tube(bspline(STAIRS, 1), [0.1, 0.05]),
    "closed stairs": tube(bspline(STAIRS, 1, knots="periodic"), 0.1),
    "sharp": tube(bspline([[0, 0, 0], [1, 0, 0], [0, 0.3, 0]], 1), 0.1),
    "there and back": tube(bspline([[0, 0, 0], [1, 0, 0], [0.2, 0, 0]], 1), 0.1),
    "curves that meet": tube(bspline(BENT, knots=np.array(KNOTS)), 0.2),
    "open": tube(bezier(CUBIC), 0.3, caps=False),
    "arc": tube(bezier([[1, 0, 0], [1, 1, 0], [0, 1, 0]], [1, HALF, 1]), 0.2),
    "torus": tube(
        bspline(
            CIRCLE,
            2,
            knots=np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]),
            weights=[1, HALF] * 4 + [1],
        ),
        0.4,
    ),
    "knot": tube(
        bspline([[0, 0, 0], [3, 1, 1], [1, 3, -1], [-1, 0, 1], [1, -2, 0]], knots="periodic"), 0.2
    ),
    "repeated ends": tube(bezier([CUBIC[0], *CUBIC, CUBIC[3], CUBIC[3]]), 0.3),
}
RIBBONS: dict[str, RibbonSurface] = {
    "ribbon": ribbon(bezier(CUBIC), 0.5),
    "tapered ribbon": ribbon(bezier(CUBIC), [0.5, 0.1], camera=np.array([2, 0, 5.0])),
    "standing": ribbon(bezier(CUBIC), 0.5, facing=np.array([0, 1, 0.0])),
    "rational": ribbon(bezier(CUBIC, [1, 3, 0.5, 1]), 0.5, camera=np.array([-1, 2.0, 7])),
    "loop": ribbon(bspline([[0, 0, 0], [3, 1, 1], [1, 3, -1], [-1, 0, 1]], knots="periodic"), 0.4),
}


def build_mesh(surface: TubeSurface | RibbonSurface, tolerance: float, **goal: Any) -> Mesh:
    mesher = SweepMesher(surface.lower(), MeshOptions(uvs=True), Storage())
    return mesher.build_mesh(Goal(tolerance, **goal), 10**6)


def sample(surface: TubeSurface | RibbonSurface, along: int = 60) -> Array:
    """Points of a surface by the oracle, (N, 3)."""
    if isinstance(surface, RibbonSurface):
        return sample_ribbon(surface, along)
    return sample_tube(surface, along, 64)


def list_corners(mesh: Mesh) -> Array:
    """The corners (T, 3, 3) of all triangles."""
    corners: Array = mesh.positions[mesh.triangles].astype(np.float64)
    return corners


def measure_to_mesh(points: Array, mesh: Mesh) -> float:
    """The largest distance of points (N, 3) from the triangles of a mesh."""
    return Soup(list_corners(mesh)).farthest(points)[1]
