"""Parts of triangles, so that boxes fit them.

The box of a long triangle that is not parallel to an axis is almost empty, and boxes of many such
triangles overlap. So triangles whose boxes are much larger than themselves are cut, and the tree
has a box for each part (early split clipping). The first cut is the height on the longest edge. It
leaves two triangles that are widest at the cut; these are halved lengthwise, and their halves, too.

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
"""Cut are parts whose boxes have half surfaces larger than their own areas by this factor …"""

LARGE = 4.0
"""… and larger than the mean area of the triangles by this factor."""

MOST, MOST_MORE = 8, 1 << 20
"""The most parts, in relation to the triangles; and how many more parts than triangles."""

ROUNDS = 16
"""How often a triangle is cut at most."""


def divide_triangles(corners: FloatArray) -> tuple[Ints, FloatArray]:
    """Boxes of parts of triangles.

    Parameters
    ----------
    corners : ndarray of float64, shape (3, 3, t)
        Axis 0 counts the vertices.

    Returns
    -------
    owner : ndarray of int, shape (n,)
        The triangle of each part, n ≥ t.
    boxes : ndarray of float64, shape (6, n)
        The least and the largest coordinates of the parts. A cut moves corners by at most 3 u of
        the size of the coordinates.
    """
    areas = length(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2
    least = LARGE * float(areas.mean())
    owner, boxes = np.arange(len(areas)), _find_boxes(corners)
    room = min((MOST - 1) * len(areas), MOST_MORE)
    chosen = _choose(boxes, areas, least, room)
    parts = _cut_heights(corners.take(chosen, axis=2))
    ready = [(np.delete(owner, chosen), np.delete(boxes, chosen, axis=1))]
    owner, room = np.concatenate([chosen, chosen]), room - len(chosen)
    for _ in range(1, ROUNDS):
        checkpoint()
        boxes = _find_boxes(parts)
        areas = length(cross(parts[2] - parts[0], parts[3] - parts[1])) / 2
        chosen = _choose(boxes, areas, least, room)
        ready.append((np.delete(owner, chosen), np.delete(boxes, chosen, axis=1)))
        parts, owner = _halve(parts.take(chosen, axis=2)), np.tile(owner[chosen], 2)
        room -= len(chosen)
        if not len(chosen):
            break
    ready.append((owner, _find_boxes(parts)))
    owners, all_boxes = zip(*ready, strict=True)
    return np.concatenate(owners), np.concatenate(all_boxes, axis=1)


def _choose(boxes: FloatArray, areas: FloatArray, least: float, room: int) -> Ints:
    """The parts that are cut: those with the largest boxes, at most `room`."""
    sides = boxes[3:] - boxes[:3]
    surfaces = dot(sides, sides[NEXT])
    chosen = (surfaces > np.maximum(EMPTY * areas, least)).nonzero()[0]
    if len(chosen) > room:
        chosen = chosen[surfaces[chosen].argsort(kind="stable")[::-1][:room]]
    return chosen


def _find_boxes(corners: FloatArray) -> FloatArray:
    """The boxes (6, m) of parts with corners (k, 3, m)."""
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])


def _cut_heights(corners: FloatArray) -> FloatArray:
    """Two parts (4, 3, 2 m) of each of m triangles, cut at the height on the longest edge.

    A part is a quadrilateral whose edges 0 1 and 3 2 lie along the longest edge. Here it is a
    triangle with the corners 0 and 3 in common.
    """
    rows, edges = np.arange(corners.shape[2]), corners[NEXT] - corners
    squares = dot(edges, edges)
    begin = squares.argmax(axis=0)
    a, b, c = (corners[at, :, rows].T for at in (begin, NEXT[begin], NEXT[NEXT[begin]]))
    longest = squares[begin, rows]
    share = dot(c - a, b - a) / np.where(longest > 0, longest, 1.0)
    foot = a + np.clip(share, 0.0, 1.0) * (b - a)
    return np.concatenate([np.stack([a, foot, c, a]), np.stack([b, foot, c, b])], axis=2)


def _halve(parts: FloatArray) -> FloatArray:
    """Two halves (4, 3, 2 m) of each of m parts, cut through the middles of two edges."""
    a, b, c, d = parts
    first, second = a + (b - a) / 2, d + (c - d) / 2
    return np.concatenate(
        [np.stack([a, first, second, d]), np.stack([first, b, c, second])], axis=2
    )
