"""The faults of a mesh itself: open, non-manifold and flipped edges, and degenerate faces.

Vertices at equal positions count as one point, because files repeat positions: STL for each
triangle, others where normals differ. An edge is a pair of points. A face that has one point twice
has no edges here.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.engine.connectivity.equal_points import find_equal_points
from service.engine.vectors import NEXT, UNIT, cross, dot, length
from service.surface.given_mesh import GivenMesh

FLAT = 16 * UNIT
"""A face is degenerate if its height over its longest side is at most this share of its largest
coordinate: rounding alone can make three points of a line so high a triangle."""


@dataclass(frozen=True, slots=True)
class MeshFaults:
    """How many faults a mesh has.

    Attributes
    ----------
    open_edges : int
        Edges of exactly one face.
    non_manifold_edges : int
        Edges of three or more faces.
    flipped_edges : int
        Edges of exactly two faces that both run along it in the same direction.
    degenerate_faces : int
        Triangles without area.
    """

    open_edges: int
    non_manifold_edges: int
    flipped_edges: int
    degenerate_faces: int


def find_faults(mesh: GivenMesh) -> MeshFaults:
    """Count the faults of a mesh."""
    points = find_equal_points(mesh.positions + 0.0)[mesh.triangles]  # −0 becomes 0
    is_collapsed = (points == points[:, NEXT]).any(axis=1)
    is_flat = is_collapsed | find_flat(mesh.corners)
    uses, directions = _count_uses(points[~is_collapsed])
    return MeshFaults(
        open_edges=int((uses == 1).sum()),
        non_manifold_edges=int((uses > 2).sum()),
        flipped_edges=int(((uses == 2) & (directions != 0)).sum()),
        degenerate_faces=int(is_flat.sum()),
    )


def find_flat(corners: FloatArray) -> Bools:
    """Which triangles (t, 3, 3) have no area, up to the rounding of their coordinates."""
    sides = corners[:, NEXT] - corners
    twice_area = length(cross(sides[:, 0], sides[:, 1], -1), -1)
    longest = np.sqrt(dot(sides, sides, -1).max(axis=1))
    return np.asarray(twice_area <= FLAT * np.abs(corners).max(axis=(1, 2)) * longest)


def _count_uses(points: Ints) -> tuple[Ints, Ints]:
    """How many faces use each edge, and how many more of them along it than against it, (E,) each.

    `points` (t, 3) are the numbers of the corners.
    """
    begin, end = points.ravel(), points[:, NEXT].ravel()
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    direction = np.where(begin < end, 1, -1)
    key = low * (high.max(initial=0) + 1) + high
    order = key.argsort(kind="stable")
    begins = find_begins(key[order])
    if not len(begins):
        return begins, begins
    return count_runs(begins, len(key)), np.add.reduceat(direction[order], begins)
