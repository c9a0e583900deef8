"""The result of refinement: vertices, triangles and bounds.

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

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints, RealArray
from service.engine.clustering import DisjointSets


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
    # For each vertex the least of those with which the pairs unite it.
    ends, number = np.unique(pairs, return_inverse=True)
    sets = DisjointSets(len(ends))
    for first, second in number.reshape(-1, 2).tolist():
        sets.unite(first, second)
    vertex = np.arange(len(stored))
    vertex[ends] = ends[sets.list_roots()]
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
