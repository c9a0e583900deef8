"""The distance of a point from triangles: whether a camera stands on what it looks at."""

import numpy as np

from service.bases.arrays import FloatArray, IndexArray
from service.engine.vectors import cross, dot, length


def find_distance(point: FloatArray, positions: FloatArray, triangles: IndexArray) -> float:
    """The least distance of a point (3,) from triangles (T, 3) of positions (V, 3).

    Infinite without triangles.
    """
    if not len(triangles):
        return float("inf")
    corners = [(positions[each] - point).T for each in triangles.T]
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    normal = cross(edges[0][1] - edges[0][0], edges[1][1] - edges[1][0])
    height = np.abs(dot(normal, corners[0])) / np.maximum(length(normal), np.finfo(float).tiny)
    # The point is above the triangle if it is on the same side of all edges.
    sides = [dot(cross(a, b), normal) for a, b in edges]
    is_above = (np.stack(sides) > 0).all(axis=0)
    distances = np.where(is_above, height, np.inf)
    for a, b in edges:
        along = b - a
        square = np.maximum(dot(along, along), np.finfo(float).tiny)
        share = np.clip(-dot(a, along) / square, 0.0, 1.0)
        distances = np.minimum(distances, length(a + share * along))
    return float(distances.min())
