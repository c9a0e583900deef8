"""Closest points of a surface to points, each with an interval that contains the distance.

The search examines pairs of a point and a cell of a patch (`cells`), for all points and all patches
together, level by level. A pair ends in three cases: the cell is farther than a point of the
surface that is already known; the distance has no minimum over the patch in the cell; or the cell
is *settled*: the distance is nearly convex over it, or is least on a known side. Otherwise the cell
is halved. In settled cells Newton's method finds the minimum, and the theorems of `distance_bounds`
bound the least distance. If this bound is too far from the distance, the cell is halved, too.
`closest_levels` does all this.

The lower end of a point's interval is the least lower bound of all pairs that were not proved to be
farther; the upper end is the distance of the reported point. The work for a point is limited. When
the limit is reached, the bounds of the remaining pairs are included in the interval.

Most points need the bounds of 20 to 70 pairs; a point near the centre of a sphere needs 25,000. So
the points of a request share a number of pairs (`MAX_PAIRS`, `shares`).
"""

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.engine.cells.bounding_spheres import FREE_PAIRS, MAX_PAIRS_IN_TREE, PatchTree
from service.engine.cells.shares import Share
from service.engine.cells.tree import CellTree
from service.engine.closest.levels import MAX_OPEN_PAIRS, ClosestLevels
from service.engine.closest.nearest import ClosestPoints
from service.engine.nets.query_nets import QueryNets

MAX_CHUNK, MIN_CHUNK = 8192, 16
"""How many points are searched together: at most `MAX_CHUNK`, so that their data stay in the
processor's cache. If the pairs or cells of more than `MIN_CHUNK` points take too much memory, these
points are searched again, a quarter of them at a time."""

MAX_PAIRS = 12_000_000
"""The most pairs whose bounds are computed in a request. A pair takes 1 to 2.5 µs, so a response
takes at most half a minute."""


class ClosestSearch:
    """Finds closest points of one surface.

    Parameters
    ----------
    nets : QueryNets
    tolerance : float
        The largest width of intervals, in the coordinates of the nets.
    """

    def __init__(self, nets: QueryNets, tolerance: float) -> None:
        self.tolerance = tolerance
        self.cells = CellTree(nets)
        self.patches = PatchTree(self.cells)

    def find(self, points: FloatArray) -> ClosestPoints:
        """Find the closest points to `points` (m, 3), in the coordinates of the nets."""
        results = list(self._find_by_chunks(points, MAX_PAIRS))
        names = [field.name for field in fields(ClosestPoints)]
        return ClosestPoints(
            *(np.concatenate([getattr(f, name) for f in results]) for name in names)
        )

    def _find_by_chunks(self, points: FloatArray, remaining_pairs: int) -> Iterator[ClosestPoints]:
        """Find the closest points, chunk by chunk; all chunks share `remaining_pairs` pairs."""
        first, size, remaining_tree_pairs = 0, MAX_CHUNK, MAX_PAIRS_IN_TREE
        while first < len(points):
            checkpoint()
            remaining_points = len(points) - first
            chunk_points = points[first : first + size]
            share = Share(
                remaining_pairs * len(chunk_points) // remaining_points, len(chunk_points)
            )
            # In the tree of patches a point may have twice the mean of what remains of its pairs:
            # most points need less.
            max_pairs_of_point = max(FREE_PAIRS, 2 * remaining_tree_pairs // remaining_points)
            chunk = ClosestLevels(
                self.patches,
                chunk_points,
                share,
                self.tolerance,
                max_pairs_of_point,
                can_split=size > MIN_CHUNK,
            )
            result = chunk.search()
            remaining_pairs -= int(share.spent.sum())
            if result is None or (size > MIN_CHUNK and (chunk.is_crowded or self.cells.is_full)):
                # Search again with fewer points, whose pairs and cells take less memory.
                size = max(1, min(size, len(chunk_points)) // 4)
            else:
                yield result
                first = first + size
                remaining_tree_pairs -= int(np.maximum(chunk.in_tree - FREE_PAIRS, 0).sum())
                if 2 * chunk.most_open <= MAX_OPEN_PAIRS:
                    size = min(2 * size, MAX_CHUNK)
            self.cells.drop_if_large()
