"""The report on a mesh, and the version of the numbers."""

from dataclasses import dataclass
from typing import TypeAlias

from service.engine.mesh.closure import Closure

Ranges: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""Least and greatest values of two quantities."""

ENGINE = 3
"""Version of the numbers. It is raised only if the same request would give other numbers."""


@dataclass(frozen=True, slots=True)
class MeshReport:
    """The report on a mesh; formats include as much of it as they can.

    `vertices` counts positions, also where several vertices share one. `bounds_min` and
    `bounds_max` are the bounds of the stored vertices, in model coordinates. `boundary_edges`
    counts the edges that only one face uses; `watertight` means that every edge is used by exactly
    two. `poles_repaired` counts the samples at which du × dv vanishes and the normal is a limit.
    `closure` is the continuity of the seams of a surface that closes; None if the patches are not
    pieces of one surface. `engine` is the version of the numbers (`ENGINE`).

    `deviation_bound`, in model units: it is proved that no point of the surface is further than
    this from the stored faces; None without faces of a parametric surface. `mesh_deviation_bound`,
    if requested: no point of the faces is further than this from the surface. `normal_angle`, in
    radians, if requested: the largest measured angle between the normals at two vertices that an
    edge joins. `curvature`, if requested: least and greatest Gaussian, then mean curvature of the
    vertices. `merged_knots`: the number of B-spline knots that differed from the knot before by
    rounding alone, and count as equal. `moved`, in model units: control points that were equal up
    to rounding were made equal, and no point of the surface moved further than this; it is part of
    the bounds.
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
