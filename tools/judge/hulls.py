"""Decides with exact fractions whether pieces of a surface are near triangles.

`tools.judge.proof` asks where the errors of float64 are too large for a decision. Some bounds are
hardly larger than the largest distance: a flat surface is exactly as far from its mesh as the
vertices are rounded.

Theorem. Let the points P_i be the control points of a piece, so their hull contains it. If each P_i
is within d of one triangle, so is the hull: the points within d of a convex set are convex. If a
plane cuts the hull in two, each part is the hull of the P_i on its side and of the points where the
plane cuts a segment from P_i to P_j. So it is enough that the points of each part are within d of
one triangle; here this plane goes through the common edge of two triangles.
"""

from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from tools.judge.exact import Exact


def cut_net(net: Exact, u: int, v: int) -> Exact:
    """The homogeneous net of a piece of a patch with the net (p+1, q+1, 4).

    `u` and `v` number the piece in each direction: 1 is the whole patch, and 2k and 2k + 1 are the
    first and the second half of piece k.
    """
    for number in (u, v):
        for digit in f"{number:b}"[1:]:
            net = _halve_net(net, second=digit == "1")
        net = net.swapaxes(0, 1)
    return net


def _halve_net(rows: Exact, *, second: bool) -> Exact:
    """The first or the second half of a net along u, by de Casteljau."""
    ends: list[Exact] = []
    while len(rows):
        ends.append(rows[-1 if second else 0])
        rows = (rows[:-1] + rows[1:]) / 2
    return np.stack(ends[::-1] if second else ends)


def is_hull_near(points: Exact, host: Exact, twin: Exact | None, bound: Fraction) -> bool:
    """Whether the hull of points (n, 3) is proved to be within `bound` of one or two triangles.

    `host` (3, 3) is a triangle near the points, and `twin` (3, 3) is the triangle beyond the edge
    from the first corner of `host` to the second, or None if this edge is a border.
    """
    if _are_near(points, host, bound):
        return True
    if twin is None:
        return False
    inside, outside = _cut_hull(points, host)
    return _are_near(inside, host, bound) and _are_near(outside, twin, bound)


def measure_squared_distance(point: Exact, triangle: Exact) -> Fraction:
    """The square of the distance of a point (3,) from a triangle (3, 3), which may have no area."""
    a, b, c = triangle
    normal = _cross(b - a, c - a)
    area = normal @ normal
    sides = [(start, end - start) for start, end in ((a, b), (b, c), (c, a))]
    if area and all(_cross(normal, along) @ (point - start) >= 0 for start, along in sides):
        return Fraction(((point - a) @ normal) ** 2 / area)
    return min(_measure_to_segment(point - start, along) for start, along in sides)


def _measure_to_segment(point: Exact, along: Exact) -> Fraction:
    """The square of the distance of a point (3,) from the segment from 0 to `along` (3,)."""
    square = along @ along
    share = min(max(point @ along / square, Fraction(0)), Fraction(1)) if square else Fraction(0)
    rest = point - share * along
    return Fraction(rest @ rest)


def _are_near(points: Iterable[Exact], triangle: Exact, bound: Fraction) -> bool:
    return all(measure_squared_distance(point, triangle) <= bound**2 for point in points)


def _cut_hull(points: Exact, host: Exact) -> tuple[list[Exact], list[Exact]]:
    """Cuts the hull of points by the plane through the first two corners of `host`, across it.

    Returns the points whose hull is the part on the side of `host`, and those of the other part.
    """
    along = host[1] - host[0]
    # Heights above the plane, up to a factor: that of the third corner of `host` is negative.
    heights = (points - host[0]) @ _cross(along, _cross(along, host[2] - host[0]))
    inside, outside = np.flatnonzero(heights <= 0), np.flatnonzero(heights > 0)
    cuts = [
        (heights[j] * points[i] - heights[i] * points[j]) / (heights[j] - heights[i])
        for i in inside
        for j in outside
    ]
    return [*points[inside], *cuts], [*points[outside], *cuts]


def _cross(a: Exact, b: Exact) -> Exact:
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
