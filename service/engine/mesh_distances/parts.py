"""Parts of triangles, so that boxes fit them.

The box of a long triangle that is not parallel to an axis is almost empty, and boxes of many such
triangles overlap. So triangles whose boxes are much larger than themselves are halved across their
longest edges, and the tree has a box for each part (early split clipping).

References
----------
Ernst and Greiner, Early split clipping for bounding volume hierarchies, IEEE Symposium on
Interactive Ray Tracing (2007).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.vectors import NEXT, cross, dot, length

EMPTY = 8.0
"""Halved are parts whose boxes have half surfaces larger than their own areas by this factor …"""

LARGE = 4.0
"""… and larger than the mean area of the triangles by this factor."""

MOST, MOST_MORE = 8, 1 << 20
"""The most parts, in relation to the triangles; and how many more parts than triangles."""

ROUNDS = 16
"""How often a triangle is halved at most."""


def divide_triangles(corners: FloatArray) -> tuple[Ints, FloatArray]:
    """Boxes of parts of triangles.

    Parameters
    ----------
    corners : ndarray of float64, shape (3, 3, t)
        Axis 0 counts the vertices.

    Returns
    -------
    owner : ndarray of int, shape (n,)
        The triangle of each part, n ≥ t; the first t parts belong to the triangles in order.
    boxes : ndarray of float64, shape (6, n)
        The least and the largest coordinates of the parts. Their corners are rounded to 2 u.
    """
    count = corners.shape[2]
    owner, parts, boxes = np.arange(count), corners, _find_boxes(corners)
    areas = length(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2
    mean, most = float(areas.mean()), min(MOST * count, count + MOST_MORE)
    for _ in range(ROUNDS):
        checkpoint()
        surfaces = _measure_surfaces(boxes)
        rows = (surfaces > np.maximum(EMPTY * areas, LARGE * mean)).nonzero()[0]
        if len(rows) > most - len(owner):
            largest = surfaces[rows].argsort(kind="stable")[::-1]
            rows = rows[largest[: most - len(owner)]]
        if not len(rows):
            break
        first, second = _halve(parts.take(rows, axis=2))
        # The first half takes the place of the part, the second comes behind all.
        parts = np.concatenate([parts, second], axis=2)
        parts[..., rows] = first
        boxes = np.concatenate([boxes, _find_boxes(second)], axis=1)
        boxes[:, rows] = _find_boxes(first)
        areas[rows] /= 2
        areas = np.concatenate([areas, areas[rows]])
        owner = np.concatenate([owner, owner[rows]])
    return owner, boxes


def _find_boxes(corners: FloatArray) -> FloatArray:
    """The boxes (6, m) of triangles (3, 3, m)."""
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])


def _measure_surfaces(boxes: FloatArray) -> FloatArray:
    """Half the surfaces (m,) of boxes (6, m)."""
    sides = boxes[3:] - boxes[:3]
    return dot(sides, sides[NEXT])


def _halve(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Halves of triangles (3, 3, m), cut through the middle of the longest edge of each."""
    rows = np.arange(corners.shape[2])
    edges = corners[NEXT] - corners
    begin = dot(edges, edges).argmax(axis=0)
    end, other = NEXT[begin], NEXT[NEXT[begin]]
    a, b, c = (corners[at, :, rows].T for at in (begin, end, other))
    middle = a + (b - a) / 2
    return np.stack([a, middle, c]), np.stack([middle, b, c])
