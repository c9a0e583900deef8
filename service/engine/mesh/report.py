"""The report on a mesh, and the version of the engine."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import IndexArray, RealArray
from service.engine.connectivity.closure import Closure
from service.engine.vectors import length

Ranges: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""(least, greatest) of Gaussian curvature, and of mean curvature."""

ENGINE = 4
"""The version of the engine: raised only if a request would give other numbers than before."""


@dataclass(frozen=True, slots=True)
class MeshReport:
    """The report on a mesh; each format writes the attributes that it can store.

    Attributes
    ----------
    vertices : int
        The number of distinct positions; several vertices may share one position.
    triangles, quads, patches : int
        How many faces the mesh has, and how many patches the surface.
    bounds_min, bounds_max : (x, y, z)
        The bounds of the stored vertices, in model coordinates.
    watertight : bool
        Whether exactly two faces use each edge.
    boundary_edges : int
        The number of edges that only one face uses.
    poles_repaired : int
        The number of samples at which du × dv vanishes and the normal is a limit.
    closure : Closure or None
        The continuity of the seams of a surface that closes; None if the patches are not pieces of
        one surface.
    deviation_bound : float or None
        Model units. It is proved that no point of the surface is further than this from the stored
        faces. None if the mesh has no faces of a parametric surface.
    mesh_deviation_bound : float or None
        Model units, if requested. No point of the faces is further than this from the surface.
    normal_angle : float or None
        Radians, if requested. The largest measured angle between the normals at the two ends of an
        edge.
    curvature : Ranges or None
        If requested, the least and the greatest Gaussian and mean curvature of the vertices.
    merged_knots : int
        The number of B-spline knots that differed from the knot before by rounding alone, and count
        as equal to it.
    moved : float
        Model units. Control points that were equal up to rounding were made equal; no point of the
        surface moved further than this. Both deviation bounds include this movement.
    engine : int
        The version of the engine (`ENGINE`).
    """

    vertices: int
    triangles: int
    quads: int
    patches: int
    bounds_min: tuple[float, float, float]
    bounds_max: tuple[float, float, float]
    watertight: bool
    boundary_edges: int
    poles_repaired: int
    closure: Closure | None = None
    deviation_bound: float | None = None
    mesh_deviation_bound: float | None = None
    normal_angle: float | None = None
    curvature: Ranges | None = None
    merged_knots: int = 0
    moved: float = 0.0
    engine: int = ENGINE


def find_largest_angle(faces: IndexArray, normals: RealArray) -> float | None:
    """Largest angle, in radians, between the unit normals at the two ends of an edge of the faces.

    The result is None if there are no faces. The angle is computed from the tangent of its half,
    because the cosine is imprecise for small angles.
    """
    if not len(faces):
        return None
    largest = 0.0
    for corner in range(faces.shape[1]):
        first, second = normals[faces[:, corner - 1]], normals[faces[:, corner]]
        difference, total = (length(rows, -1) for rows in (first - second, first + second))
        largest = max(largest, float(np.arctan2(difference, total).max()))
    return 2 * largest
