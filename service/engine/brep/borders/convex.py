"""Convex polygons clipped to a square, many at once."""

import numpy as np

from service.bases.arrays import FloatArray, Ints


def clip_to_square(polygons: FloatArray, size: float) -> FloatArray:
    """Convex polygons (m, k, 2), clipped to [0, size]²: shape (m, K, 2).

    Corners may repeat; a polygon outside of the square has all its corners at one point.
    """
    for axis in range(2):
        for sign, limit in ((1.0, 0.0), (-1.0, size)):
            polygons = _clip(polygons, axis, sign, limit)
    return polygons


def _clip(polygons: FloatArray, axis: int, sign: float, limit: float) -> FloatArray:
    """Sutherland and Hodgman's step: what is inside sign · x ≥ sign · limit, with a corner more."""
    inside = sign * polygons[..., axis]
    depth = inside - sign * limit
    if (depth >= 0).all():
        return polygons
    after = np.arange(1, polygons.shape[1] + 1) % polygons.shape[1]
    following, next_depth = polygons.take(after, axis=1), depth.take(after, axis=1)
    is_inside, crosses = depth >= 0, (depth >= 0) != (next_depth >= 0)
    share = depth / np.where(crosses, depth - next_depth, 1.0)
    cut = polygons + share[..., np.newaxis] * (following - polygons)
    cut[..., axis] = limit
    count, corners = polygons.shape[:2]
    slots = np.stack([polygons, cut], axis=2).reshape(count, 2 * corners, 2)
    used = np.stack([is_inside, crosses], axis=2).reshape(count, 2 * corners)
    # The used slots first, in their order; then the last of them again.
    order = np.argsort(~used, axis=1, kind="stable")[:, : corners + 1]
    last = np.maximum(used.sum(axis=1) - 1, 0)
    at = np.minimum(np.arange(corners + 1), last[:, np.newaxis])
    clipped = slots[np.arange(count)[:, np.newaxis], np.take_along_axis(order, at, axis=1)]
    clipped[~used.any(axis=1)] = 0.0
    return clipped


def list_fans(polygons: Ints) -> tuple[Ints, Ints]:
    """Convex polygons of places (m, k, 2) as triangles at their first corners.

    Triangles without an area are left out.

    Returns
    -------
    polygon : ndarray of int, shape (q,)
        The polygon of each triangle, in ascending order.
    triangles : ndarray of int, shape (3, 2, q)
    """
    count, corners = polygons.shape[:2]
    number = np.arange(1, corners - 1)
    first = np.broadcast_to(polygons[:, :1], (count, corners - 2, 2))
    fans = np.stack([first, polygons[:, number], polygons[:, number + 1]], axis=2)
    fans = fans.reshape(-1, 3, 2)
    to_b, to_c = fans[:, 1] - fans[:, 0], fans[:, 2] - fans[:, 0]
    rows = (to_b[:, 0] * to_c[:, 1] != to_b[:, 1] * to_c[:, 0]).nonzero()[0]
    return rows // (corners - 2), np.ascontiguousarray(fans[rows].transpose(1, 2, 0))
