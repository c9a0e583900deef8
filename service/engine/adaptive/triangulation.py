"""The result of refinement: vertices, triangles and bounds; and how formats store positions.

**Flat triangles** are omitted: triangles of which two corners have equal positions in the file. A
side that is nearly a point, for example, has vertices that differ in float64 but not in float32. If
the stored positions of two vertices joined by an edge are equal, they become one vertex, and the
triangles at that edge are removed. The mesh stays closed where it was closed: the two other edges
of each removed triangle become one edge.

**Why the bound holds.** A triangle whose corners a and b are equal is the segment from a to c. It
is omitted only if this segment is an edge of a triangle of the same face that stays. A part of
the surface that is within a distance of the segment is within this distance of that triangle too,
which takes over the bound if it is larger.
"""

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints, RealArray
from service.engine.extent import choose_origin
from service.engine.grid import MAX_ROUNDING, round_to_grid
from service.engine.scenes.placing import EPS, bound_single_error
from service.engine.scratch import Real


@dataclass(frozen=True, slots=True)
class Storage:
    """Precision and origin of the positions in a file.

    Attributes
    ----------
    is_float32 : bool
        Whether positions are float32 instead of float64.
    has_local_origin : bool
        Whether the format can store positions relative to an origin, which keeps models far from
        zero exact in float32.
    step : float
        Positions and origin are multiples of `step` (`service.engine.grid`); 0 without a grid.
    """

    is_float32: bool = False
    has_local_origin: bool = False
    step: float = 0.0

    @property
    def dtype(self) -> Real:
        """The type of the numbers."""
        return np.float32 if self.is_float32 else np.float64

    def choose_origin(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The origin of positions between these bounds."""
        origin = (
            choose_origin(low, high) if self.is_float32 and self.has_local_origin else np.zeros(3)
        )
        return round_to_grid(origin, self.step) if self.step else origin

    def bound_storage_rounding(
        self, origin: FloatArray, low: FloatArray, high: FloatArray
    ) -> float:
        """Bound of the distance by which storing moves a vertex between these bounds."""
        moved = MAX_ROUNDING * self.step
        return moved + bound_single_error(low, high, origin) if self.is_float32 else moved

    def store_positions(self, positions: FloatArray, origin: FloatArray) -> RealArray:
        """Stored positions (N, 3), relative to the origin, from positions in model coordinates."""
        if self.step:
            positions = round_to_grid(positions, self.step)
        if self.is_float32:
            return (positions - origin).astype(np.float32)
        # Adding 0.0 turns -0.0 into 0.0, which is easier to read in text formats.
        return positions + 0.0

    def restore_positions(self, positions: FloatArray, origin: FloatArray) -> FloatArray:
        """Store positions (N, 3) in model coordinates, and read them back in model coordinates.

        The results are float64. Adding the origin may round them; `bound_origin_error` bounds this.
        """
        if not (self.is_float32 or self.step):
            return positions
        read: FloatArray = self.store_positions(positions, origin).astype(np.float64) + origin
        return read


def bound_origin_error(origin: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Bound of the rounding of adding the origin: half a unit in the last place of coordinates."""
    if not origin.any():
        return 0.0
    return EPS * hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())


@dataclass(frozen=True, eq=False, slots=True)
class Triangulation:
    """A certified mesh of all faces, before it has normals.

    A sample is a vertex of one face: faces that meet have separate samples at shared vertices,
    because normals and channels may differ there.

    Attributes
    ----------
    face, u, v : ndarray of int, shape (N,)
        Face and place of every sample (see `Faces`), face after face.
    vertex : ndarray of int, shape (N,)
        The vertex of every sample.
    positions : ndarray of float64, shape (V, 3)
        Vertices in model coordinates, not yet rounded; those on the sides of faces
        come first.
    triangles : ndarray of int, shape (T, 3)
        Samples, counter-clockwise in (u, v); face after face. Their three vertices differ.
    bounds : ndarray of float64, shape (T,)
        No point of the part of the surface over the triangle is further than this from the stored
        mesh.
    mesh_bounds : ndarray of float64, shape (T,), or None
        No point of the stored triangle is further than this from the surface.
    """

    face: Ints
    u: Ints
    v: Ints
    vertex: Ints
    positions: FloatArray
    triangles: Ints
    bounds: FloatArray
    mesh_bounds: FloatArray | None


EDGES = ((0, 1), (1, 2), (2, 0))
"""The corners at both ends of each edge of a triangle."""


def drop_flat_triangles(triangulation: Triangulation, stored: RealArray) -> Triangulation:
    """The triangulation without triangles of which two corners are stored as equal positions.

    `stored` (V, 3) are its vertices as the file stores them. `triangulation` itself is returned
    if it has no flat triangle, or if beside one of them no triangle stays.
    """
    corners = triangulation.vertex[triangulation.triangles]
    following = corners[:, [1, 2, 0]]
    equal = np.logical_and.reduce([x.take(corners) == x.take(following) for x in stored.T])
    if not equal.any():
        return triangulation
    pairs = np.concatenate([corners[equal[:, k]][:, [i, j]] for k, (i, j) in enumerate(EDGES)])
    vertex = _merge_vertices(len(stored), pairs)
    corners = vertex[corners]
    flat = (corners == corners[:, [1, 2, 0]]).any(axis=1)
    beside = _find_triangles_beside(
        triangulation.face[triangulation.triangles[:, 0]], corners, flat
    )
    if (beside < 0).any():
        return triangulation
    raised = _raise_bounds(triangulation.bounds, flat, beside)
    mesh_bounds = triangulation.mesh_bounds
    if mesh_bounds is not None:
        mesh_bounds = _raise_bounds(mesh_bounds, flat, beside)[~flat]
    return replace(
        triangulation,
        vertex=vertex[triangulation.vertex],
        triangles=triangulation.triangles[~flat],
        bounds=raised[~flat],
        mesh_bounds=mesh_bounds,
    )


def _merge_vertices(count: int, pairs: Ints) -> Ints:
    """For each vertex the least vertex in its connected component of the pairs (n, 2)."""
    vertex = np.arange(count)
    while True:
        least = vertex[pairs].min(axis=1)
        before = vertex.copy()
        for column in pairs.T:
            np.minimum.at(vertex, column, least)
        vertex = vertex[vertex]
        if (vertex == before).all():
            return vertex


def _find_triangles_beside(face: Ints, corners: Ints, flat: Bools) -> Ints:
    """For each flat triangle a triangle of its face that stays and has its segment; or −1.

    `face`, `corners` and `flat` have the face, the three merged vertices and the mark of each
    triangle; the segment of a flat triangle joins its two different vertices.
    """
    staying = np.flatnonzero(~flat)
    edges = np.sort(corners[staying][:, EDGES].reshape(-1, 2), axis=1)
    size = int(corners.max()) + 1
    keys = (face[staying].repeat(3) * size + edges[:, 0]) * size + edges[:, 1]
    order = np.argsort(keys, kind="stable")
    # Two of the three sorted corners are equal, so the first and the last end the segment.
    ends = np.sort(corners[flat], axis=1)
    segments = (face[flat] * size + ends[:, 0]) * size + ends[:, 2]
    if not len(keys):
        return np.full(len(segments), -1)
    row = order[np.minimum(np.searchsorted(keys, segments, sorter=order), len(keys) - 1)]
    return np.where(keys[row] == segments, staying[row // 3], -1)


def _raise_bounds(bounds: FloatArray, flat: Bools, beside: Ints) -> FloatArray:
    """Bounds of all triangles; a triangle beside a flat triangle takes over its bound if larger."""
    raised = bounds.copy()
    np.maximum.at(raised, beside, bounds[flat])
    return raised
