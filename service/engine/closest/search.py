"""Closest points of a surface to points, each with an interval that contains the distance.

The search examines pairs of a point and a cell of a patch (`cells`), for all points and all patches
together, level by level. A pair ends in three cases: the cell is farther than a point of the
surface that is already known; the distance has no minimum over the patch in the cell; or the cell
is *settled*: the distance is nearly convex over it, or is least on a known side. Otherwise the cell
is halved. In settled cells Newton's method finds the minimum, and the theorems of `distance_bounds`
bound the least distance. If this bound is too far from the distance, the cell is halved, too.
`levels` does all this.

The lower end of a point's interval is the least lower bound of all pairs that were not proved to be
farther; the upper end is the distance of the reported point. The work for a point is limited. When
the limit is reached, the bounds of the remaining pairs are included in the interval.

Most points need the bounds of 20 to 70 pairs; a point near the centre of a sphere needs 25,000. So
the points of a request share a budget of pairs (`pair_search`).
"""

from service.bases.arrays import FloatArray
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import Chunks
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.closest.levels import ClosestLevels
from service.engine.closest.nearest import ClosestPoints
from service.engine.nets.query_nets import QueryNets

CHUNK_SIZES = 16, 8192, 8192
"""How many points are searched together (`Chunks`): at most 8192, so that their data stay in the
processor's cache."""


def find_closest(
    nets: QueryNets, tolerance: float, points: FloatArray, limits: WorkLimits
) -> ClosestPoints:
    """Find the closest points to `points` (m, 3), in the coordinates of the nets.

    `tolerance` is the largest width of intervals.
    """
    cells = CellTree(nets, limits)
    spheres = BoundingSpheres(cells)
    chunks = Chunks(cells, len(points), CHUNK_SIZES)
    results = []
    for rows, budget in chunks:
        search = ClosestLevels(spheres, points[rows], budget, tolerance, can_split=chunks.can_split)
        result = search.search()
        if result is None:
            chunks.split()
        else:
            results.append(result)
            chunks.grow(search.most_open)
    return ClosestPoints.join(results)
