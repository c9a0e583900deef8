"""The result of the engine: a mesh, and the report on it; and the version of the engine."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.engine.connectivity.closure import Closure
from service.engine.mesh.brep_report import BrepReport
from service.engine.mesh.places import SurfacePlaces
from service.engine.vectors import length
from service.surface.checks import Up
from service.surface.lowered import Color

Ranges: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""(least, greatest) of Gaussian curvature, and of mean curvature."""

ENGINE = 4
"""The version of the engine: raised only if a request would give other numbers than before."""


@dataclass(frozen=True, slots=True)
class Orientation:
    """Which patches were turned so that neighbours agree and volumes are positive.

    Attributes
    ----------
    turned : tuple of int
        The numbers of the patches that were turned.
    not_orientable : tuple of int
        Those of the patches of surfaces without a consistent orientation, which were not turned.
    """

    turned: tuple[int, ...]
    not_orientable: tuple[int, ...]


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
    brep : BrepReport or None
        The facts that only a brep has; None for other surfaces.
    metres_per_unit : float or None
        The unit of all lengths, in metres; None if it is not known.
    orientation : Orientation or None
        If requested, what was turned.
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
    brep: BrepReport | None = None
    orientation: Orientation | None = None
    metres_per_unit: float | None = None
    engine: int = ENGINE

    @property
    def gap_bound(self) -> float | None:
        """The bound of the gaps between edges and faces of breps; None for other surfaces."""
        return None if self.brep is None else self.brep.gap_bound


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


@dataclass(frozen=True, slots=True)
class MeshPart:
    """A named run of faces: rows [first, last) of `Mesh.triangles` and of `Mesh.quads`.

    `color` is the base colour of these faces, or None. `deviation_bound` is as in `MeshReport`, for
    the surface of this part.
    """

    name: str
    triangles: tuple[int, int]
    quads: tuple[int, int]
    color: Color | None = None
    deviation_bound: float | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Overlay:
    """Lines drawn beside the faces: a control net, the patch boundaries.

    Attributes
    ----------
    positions : ndarray, shape (K, 3)
        In the dtype of the positions of the mesh, and relative to its origin.
    segments : ndarray of uint32, shape (L, 2)
        Pairs of rows of `positions`.
    cells : ndarray of uint32, shape (C, 4), or None
        The quads of a control net, (i,j) (i,j+1) (i+1,j+1) (i+1,j), which are drawn as closed
        lines; None for other overlays, and for nets of triangles.
    """

    name: str
    positions: RealArray
    segments: IndexArray
    cells: IndexArray | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Vertices and faces.

    A vertex is a position with its normal, its colour, its (u, v) and so on. Where two patches
    meet at a crease, or at the apex of a cone, several vertices share one position (see `welds`).

    Attributes
    ----------
    positions : ndarray, shape (V, 3)
        float64 in model coordinates; or float32 relative to `origin`.
    normals : ndarray, shape (V, 3), or None
        Unit normals du × dv / |du × dv|, never zero and never NaN.
    uvs : ndarray, shape (V, 2), or None
        Texture coordinates; parameters (u, v) if the surface has none.
    triangles : ndarray of uint32, shape (T, 3)
        Counter-clockwise seen from the tip of the normal.
    quads : ndarray of uint32, shape (Q, 4)
        (i,j) (i+1,j) (i+1,j+1) (i,j+1). Empty unless quads are requested; then `triangles` has the
        triangles at poles, between unequal divisions, and on triangular patches.
    parts : tuple of MeshPart
        Consecutive runs of faces that together contain all faces.
    grids : tuple of ndarray of uint32, each of shape (P, Ru+1, Rv+1)
        The vertex at every sample of every patch, batch by batch, for formats that store grids.
        Empty if a side has other divisions than its patch, or if a patch is a triangle.
    welds : ndarray of uint32, shape (V,), or None
        The first vertex with the same position; None if all positions differ.
    origin : ndarray of float64, shape (3,)
        Model coordinates of the point (0, 0, 0) of `positions`.
    colors : ndarray, shape (V, 3) or (V, 4), or None
        sRGB, or sRGB and alpha, from 0 to 1.
    attributes : tuple of (name, ndarray of shape (V, d))
        The other channels of the surface.
    step : float
        A power of two: all positions, also those of overlays, and the origin are multiples of it. 0
        if positions are not rounded to a grid.
    places : SurfacePlaces or None
        Where the vertices are on the surface, if the options ask for it.
    """

    name: str
    positions: RealArray
    normals: RealArray | None
    uvs: RealArray | None
    triangles: IndexArray
    quads: IndexArray
    parts: tuple[MeshPart, ...]
    grids: tuple[IndexArray, ...]
    welds: IndexArray | None
    overlays: tuple[Overlay, ...]
    origin: FloatArray
    up: Up
    report: MeshReport
    colors: RealArray | None = None
    attributes: tuple[tuple[str, RealArray], ...] = ()
    step: float = 0.0
    places: SurfacePlaces | None = None


CURVATURE_NAMES = ("gaussian_curvature", "mean_curvature")
"""The names of the attributes with Gaussian and mean curvature, in this order."""


def find_ranges(attributes: Iterable[tuple[str, RealArray]]) -> Ranges | None:
    """The ranges of the curvatures of a mesh; None without curvatures or vertices."""
    curvatures = [rows for name, rows in attributes if name in CURVATURE_NAMES and len(rows)]
    if len(curvatures) < len(CURVATURE_NAMES):
        return None
    gaussian, mean = ((float(rows.min()), float(rows.max())) for rows in curvatures)
    return gaussian, mean


def merge_ranges(ranges_of_meshes: Iterable[Ranges | None]) -> Ranges | None:
    """The ranges over all meshes together; None if no mesh has ranges."""
    present = [ranges for ranges in ranges_of_meshes if ranges is not None]
    if not present:
        return None
    gaussian, mean = (
        (min(low for low, _ in pairs), max(high for _, high in pairs))
        for pairs in zip(*present, strict=True)
    )
    return gaussian, mean


def round_ranges(ranges: Ranges | None) -> Ranges | None:
    """The ranges with their ends rounded to float32."""
    if ranges is None:
        return None
    gaussian, mean = ((float(np.float32(low)), float(np.float32(high))) for low, high in ranges)
    return gaussian, mean
