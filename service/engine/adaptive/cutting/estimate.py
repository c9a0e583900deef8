"""Whether a cell is near enough to two triangles, and in which direction to cut it if not.

An estimate, which only has to be good: `certify` decides in the end. It must not miss anything,
however, so it looks at the whole net, not at samples of the surface alone: a cell is a biquadratic
surface through nine of its points and a remainder, whose control points all count.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.halving import nine, points, quadratic
from service.engine.adaptive.cutting.turning import Scale, level, turning
from service.engine.adaptive.goal import Goal
from service.engine.adaptive.vectors import Vectors, cross, dot, length

THIN = 1e-9
"""A triangle has no plane if its area is below this share of its longest side's square."""

NEARLY = 1.0 - 1e-9
"""What is not less by this factor is equal: rounding must not tell symmetric cells apart."""

TWIST = 0.1
"""Share of the difference between the heights of opposite sides that counts as deviation."""

SKEW = 0.25
"""Share of a cell's skewness that its longer side gains when the direction of a cut is chosen."""

LENGTH = 1e-3
"""Of the allowed deviation, how much a direction gains by its length: it breaks ties."""


@dataclass(frozen=True, eq=False, slots=True)
class Verdict:
    """What is known of m cells.

    Attributes
    ----------
    fails : ndarray of bool, shape (m,)
        Whether the cell is to be cut,
    along_v : ndarray of bool, shape (m,)
        then in this direction: v is halved, not u.
    rising : ndarray of bool, shape (m,)
        Which diagonal is better: (0, 0)–(1, 1), not (1, 0)–(0, 1).
    form : ndarray of float64, shape (7, m)
        E, F, G: squared length E du² + 2 F du dv + G dv² of a step; a, b, c: height
        a du² + 2 b du dv + c dv² of the surface over the middle of a chord (du, dv). The cell is
        [0, 1]². Then the allowed deviation.
    """

    fails: Bools
    along_v: Bools
    rising: Bools
    form: FloatArray


def judged(nets: FloatArray, goal: Goal, eye: Vectors | None, scale: Scale) -> Verdict:
    """Verdict on cells of one span.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, D, m)
        p, q ≥ 2.
    eye : ndarray of float64, shape (3, m), or None
        Of the goal's view, in the coordinates of each net.
    scale : Scale
        What is too small is not cut for the sake of its normals.
    """
    at = nine(nets)
    size = np.maximum(length(at[2][2] - at[0][0]), length(at[0][2] - at[2][0]))
    allowed = np.minimum(allowed_at(nets, goal, eye), level(goal.angle, size, scale))
    low, right, high, left, middle = at[1][0], at[2][1], at[1][2], at[0][1], at[1][1]
    corners = at[0][0], at[2][0], at[2][2], at[0][2]
    planes = two_planes(*corners)
    rising, falling, flat = planes.rising, planes.falling, planes.flat
    a, b, c, d = corners
    up = np.maximum(
        highest(*(dot(x - a, rising[0]) for x in (low, right, middle))),
        highest(*(dot(x - a, rising[1]) for x in (middle, high, left))),
    )
    down = np.maximum(
        highest(*(dot(x - b, falling[0]) for x in (low, middle, left))),
        highest(*(dot(x - b, falling[1]) for x in (right, high, middle))),
    )
    bends = low - (a + b) * 0.5, high - (c + d) * 0.5, left - (a + d) * 0.5, right - (b + c) * 0.5
    inner = middle - (left + right) * 0.5, middle - (low + high) * 0.5
    normal = unit(cross(c - a, d - b))
    heights = [dot(bend, normal) for bend in (*bends, *inner)]
    if flat.any() or goal.two_sided:
        stray = [length(bend) for bend in (*bends, *inner)]
        across = length(middle - (a + c) * 0.5), length(middle - (b + d) * 0.5)
        side = np.maximum.reduce(stray[:4])
        wide = [np.maximum(side, x) for x in across]
        up, down = np.where(flat, wide[0], up), np.where(flat, wide[1], down)
        heights = [np.where(flat, x, h) for x, h in zip(stray, heights, strict=True)]
        if goal.two_sided:
            up, down = np.maximum(up, wide[0] * 0.5), np.maximum(down, wide[1] * 0.5)
            heights = [np.maximum(np.abs(h), x * 0.5) for x, h in zip(stray, heights, strict=True)]
    is_rising = np.where(planes.worse == 0, up < down * NEARLY, planes.worse < 0)
    twist = np.maximum(np.abs(heights[0] - heights[1]), np.abs(heights[2] - heights[3]))
    best = np.where(is_rising, up, down) + TWIST * twist
    bend_u = np.maximum.reduce([np.abs(heights[k]) for k in (0, 1, 4)])
    bend_v = np.maximum.reduce([np.abs(heights[k]) for k in (2, 3, 5)])
    along_u, along_v = (b - a + c - d) * 0.5, (d - a + c - b) * 0.5
    fails = best > allowed
    rest = np.flatnonzero(~fails)
    if len(rest):
        normals = np.where(is_rising, rising, falling)[..., rest]
        places = np.stack([np.stack([place[:, rest] for place in row]) for row in at])
        more = remainder(nets[..., rest], places, normals, flat[rest], goal.two_sided)
        over = best[rest] + more[0] > allowed[rest]
        chosen = rest[over]
        fails[chosen] = True
        bend_u[chosen], bend_v[chosen] = more[1][over], more[2][over]
    skew = dot(a - b + c - d, normal)
    v_first = across_v((bend_u, bend_v), (length(along_u), length(along_v)), skew, allowed)
    if goal.angle < np.pi:
        turn = turning(at, goal.angle, scale, nets)
        here = turn.exceeds & ~fails
        fails |= here
        v_first = np.where(here, turn.along_v, v_first)
    form = np.stack(
        [
            dot(along_u, along_u),
            dot(along_u, along_v),
            dot(along_v, along_v),
            dot((left + right) * 0.5 - middle, normal),
            skew * 0.125,
            dot((low + high) * 0.5 - middle, normal),
            allowed,
        ]
    )
    return Verdict(fails, v_first, is_rising, form)


def across_v(
    bends: tuple[FloatArray, FloatArray],
    lengths: tuple[FloatArray, FloatArray],
    skew: FloatArray,
    allowed: FloatArray,
) -> Bools:
    """Whether cells are to be cut across v, not across u: in the direction that bends more.

    Of the height that a cell has because its corners are not in a plane, half is gone whichever way
    it is cut: that speaks for the longer side, and so does, a little, what is allowed.

    Parameters
    ----------
    bends, lengths : tuple of ndarray of float64, shape (m,)
        Along u and along v.
    skew : ndarray of float64, shape (m,)
        (S_00 − S_10 + S_11 − S_01) · n.
    """
    finite = np.where(allowed < np.inf, allowed, 0.0)  # 0: where no deviation is too large
    tie = LENGTH * finite + SKEW * np.abs(skew)
    tie /= np.maximum(lengths[0] + lengths[1], np.finfo(float).tiny)
    chosen: Bools = bends[0] + tie * lengths[0] < (bends[1] + tie * lengths[1]) * NEARLY
    return chosen


@dataclass(frozen=True, eq=False, slots=True)
class Planes:
    """Unit normals of the two triangles under and over either diagonal of cells.

    Attributes
    ----------
    rising, falling : ndarray of float64, shape (2, 3, m)
        Of a triangle without area, the normal of the other: its part falls to that.
    flat : ndarray of bool, shape (m,)
        Cells of which no triangle has a plane.
    worse : ndarray of int, shape (m,)
        How many more triangles without area the rising diagonal has.
    """

    rising: FloatArray
    falling: FloatArray
    flat: Bools
    worse: Ints


def two_planes(a: Vectors, b: Vectors, c: Vectors, d: Vectors) -> Planes:
    """Planes of cells with the corners (0, 0), (1, 0), (1, 1), (0, 1)."""
    rising, no_rising = _pair((a, b, c), (a, c, d))
    falling, no_falling = _pair((a, b, d), (b, c, d))
    flat = (no_rising == 2) & (no_falling == 2)
    return Planes(rising, falling, flat, no_rising - no_falling)


def _pair(
    first: tuple[Vectors, Vectors, Vectors], second: tuple[Vectors, Vectors, Vectors]
) -> tuple[FloatArray, Ints]:
    (one, no_one), (two, no_two) = _normal(*first), _normal(*second)
    if no_one.any() or no_two.any():
        one, two = np.where(no_one, two, one), np.where(no_two, one, two)
    return np.stack([one, two]), no_one.astype(np.intp) + no_two


def _normal(a: Vectors, b: Vectors, c: Vectors) -> tuple[Vectors, Bools]:
    """Unit normals of triangles, and which have none."""
    ab, ac, bc = b - a, c - a, c - b
    normal = cross(ab, ac)
    size = length(normal)
    longest = np.maximum(np.maximum(dot(ab, ab), dot(ac, ac)), dot(bc, bc))
    none = size <= THIN * longest
    return normal / np.where(none, 1.0, size), none


def unit(vectors: Vectors) -> Vectors:
    """Vectors of length one; what has no length keeps none."""
    return vectors / np.maximum(length(vectors), np.finfo(float).tiny)


def highest(m0: FloatArray, m1: FloatArray, m2: FloatArray) -> FloatArray:
    """Largest |4 (m0 λ0 λ1 + m1 λ1 λ2 + m2 λ2 λ0)| on a triangle, λ its barycentric coordinates.

    The heights of a quadratic that is 0 at the vertices are m0, m1, m2 above the middles of the
    edges, and on an edge largest there. Inside, with s = m0 + m1 + m2, its one critical point has
    λ proportional to m1 (s − 2 m1), m2 (s − 2 m2), m0 (s − 2 m0), with the value
    4 m0 m1 m2 / Σ m_k (s − 2 m_k).
    """
    s = m0 + m1 + m2
    a, b, c = m0 * (s - 2.0 * m0), m1 * (s - 2.0 * m1), m2 * (s - 2.0 * m2)
    total = a + b + c
    inside = (a * total > 0.0) & (b * total > 0.0) & (c * total > 0.0)
    edges = np.maximum(np.maximum(np.abs(m0), np.abs(m1)), np.abs(m2))
    deepest = np.abs(4.0 * m0 * m1 * m2 / np.where(inside, total, 1.0))
    return np.where(inside, np.maximum(edges, deepest), edges)


def remainder(
    nets: FloatArray,
    at: FloatArray,
    normals: FloatArray,
    flat: Bools,
    two_sided: bool,
) -> FloatArray:
    """What is left of nets (p+1, q+1, D, m) without their biquadratic part.

    Parameters
    ----------
    at : ndarray of float64, shape (3, 3, 3, m)
        Nine points of each.
    normals : ndarray of float64, shape (2, 3, m)
        Of both triangles,
    flat : ndarray of bool, shape (m,)
        unless there are none.

    Returns
    -------
    ndarray of float64, shape (3, m)
        The greatest height of a control point that is left; and how high a chord of the net is
        below the surface along u, and along v, judged by second differences.
    """
    net = points(nets)
    along_u, along_v = quadratic(len(net) - 1), quadratic(net.shape[1] - 1)
    left = net.copy()
    for i, shares in enumerate(along_u):
        row = shares[0] * at[0] + shares[1] * at[1] + shares[2] * at[2]
        for j, (x, y, z) in enumerate(along_v):
            left[i, j] -= x * row[0] + y * row[1] + z * row[2]
    heights = np.abs(_along(left, normals[0]))
    np.maximum(heights, np.abs(_along(left, normals[1])), out=heights)
    if flat.any() or two_sided:
        stray = np.sqrt(left[:, :, 0] ** 2 + left[:, :, 1] ** 2 + left[:, :, 2] ** 2)
        heights = np.where(flat, stray, np.maximum(heights, stray * (0.5 if two_sided else 0.0)))
    sides = []
    for axis in (0, 1):
        degree = net.shape[axis] - 1
        bend = np.diff(net, n=2, axis=axis)
        size = np.maximum(np.abs(_along(bend, normals[0])), np.abs(_along(bend, normals[1])))
        if flat.any() or two_sided:
            stray = np.sqrt(bend[:, :, 0] ** 2 + bend[:, :, 1] ** 2 + bend[:, :, 2] ** 2)
            size = np.where(flat, stray, np.maximum(size, stray * (0.5 if two_sided else 0.0)))
        sides.append(size.max(axis=(0, 1)) * (degree * (degree - 1) / 8))
    return np.stack([heights.max(axis=(0, 1)), *sides])


def _along(net: FloatArray, normal: Vectors) -> FloatArray:
    heights: FloatArray = (
        net[:, :, 0] * normal[0] + net[:, :, 1] * normal[1] + net[:, :, 2] * normal[2]
    )
    return heights


def allowed_at(nets: FloatArray, goal: Goal, eye: Vectors | None) -> FloatArray:
    """Deviation allowed at the least distance of the box about each net from the eye."""
    if eye is None:
        return np.full(nets.shape[3], goal.tolerance)
    net = points(nets)
    low, high = net.min(axis=(0, 1)), net.max(axis=(0, 1))
    return goal.allowed(length(np.maximum(np.maximum(low - eye, eye - high), 0.0)))
