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
from service.engine.bounds.goal import Goal
from service.engine.bounds.vectors import Vectors, dot, dots, length

THIN = 1e-9
"""A triangle has no plane if its area is below this share of its longest side's square."""

NEARLY = 1.0 - 1e-9
"""What is not less by this factor is equal: rounding must not tell symmetric cells apart."""

TWIST = 0.1
"""Share of the difference between the heights of opposite sides that counts as deviation."""

SKEW = 0.25
"""Share of a cell's skewness that its longer side gains when the direction of a cut is chosen."""

CORNERS = [0, 2, 2, 0], [0, 0, 2, 2]
"""Places of the corners a, b, c, d among nine, counter-clockwise from (0, 0),"""

SIDES = [1, 2, 1, 0], [0, 1, 2, 1]
"""and of the middles of the sides after them."""

OF = [[0, 1, 4], [2, 3, 4], [0, 3, 5], [1, 2, 5]]
"""Sides of the triangles abc, acd, abd, bcd among ab, bc, cd, da, ac, bd."""

FROM = [[0], [0], [1], [1]]
"""Corners from which their heights are measured: a, a, b, b;"""

HALFWAY = [[0, 1, 2], [2, 3, 4], [0, 2, 4], [1, 3, 2]]
"""middles of their sides, in order, among those of ab, bc, ac or bd, cd, da."""

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


def judged(nets: FloatArray, goal: Goal, eye: Vectors | None, scale: Scale | None) -> Verdict:
    """Verdict on cells of one span.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, D, m)
        p, q ≥ 2.
    eye : ndarray of float64, shape (3, m), or None
        Of the goal's view, in the coordinates of each net.
    scale : Scale or None
        What is too small is not cut for the sake of its normals; None if these do not matter.
    """
    at = nine(nets)
    corner = at[CORNERS]
    a, b, c, d = corner
    planes, normal, diagonals = two_planes(corner)
    flat = planes.flat
    size = np.sqrt(np.maximum(diagonals[0], diagonals[1]))
    allowed = allowed_at(nets, goal, eye)
    if scale is not None:
        allowed = np.minimum(allowed, level(goal.angle, size, scale))
    shape = _heights(at, corner, planes, normal, goal.two_sided)
    (up, down), signed, told, heights = shape.over, shape.signed, shape.told, np.abs(shape.told)
    is_rising = up < down * NEARLY
    if planes.worse.any():
        is_rising = np.where(planes.worse == 0, is_rising, planes.worse < 0)
    twists = np.abs(told[:2] - told[2:4]).max(axis=0)
    best = np.where(is_rising, up, down) + TWIST * twists
    bend_u, bend_v = heights[[0, 2, 4]].max(axis=0), heights[[1, 3, 5]].max(axis=0)
    along = np.array([b - a + c - d, d - a + c - b]) * 0.5
    fails = best > allowed
    rest = (~fails).nonzero()[0]
    if len(rest):
        # Where all are near enough nothing need be copied.
        some = rest if len(rest) < len(fails) else slice(None)
        normals = np.where(is_rising, planes.normals[:2], planes.normals[2:])[..., some]
        net, bare = points(nets[..., some]), flat[some]
        more = remainder(net, at[..., some], normals, bare, goal.two_sided)
        over = (best[some] + more > allowed[some]).nonzero()[0]
        if len(over):
            chosen = rest[over]
            fails[chosen] = True
            bend_u[chosen], bend_v[chosen] = sagging(
                net[..., over], normals[..., over], bare[over], goal.two_sided
            )
    skew = dot(a - b + c - d, normal)
    squares = dots(along[[0, 0, 1]], along[[0, 1, 1]])
    lengths = np.sqrt(squares[::2])
    v_first = across_v((bend_u, bend_v), (lengths[0], lengths[1]), skew, allowed)
    if scale is not None:
        turn = turning(at, goal.angle, scale, nets)
        here = turn.exceeds & ~fails
        fails |= here
        v_first = np.where(here, turn.along_v, v_first)
    form = np.empty((7, len(fails)))
    form[:3], form[3], form[4], form[5] = squares, -signed[4], skew * 0.125, -signed[5]
    form[6] = allowed
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
    normals : ndarray of float64, shape (4, 3, m)
        Two of the rising diagonal, two of the falling one. Of a triangle without area, the normal
        of the other: its part falls to that.
    flat : ndarray of bool, shape (m,)
        Cells of which no triangle has a plane.
    worse : ndarray of int, shape (m,)
        How many more triangles without area the rising diagonal has.
    """

    normals: FloatArray
    flat: Bools
    worse: Ints


def two_planes(corner: FloatArray) -> tuple[Planes, Vectors, FloatArray]:
    """Planes of cells with corners (4, 3, m) at (0, 0), (1, 0), (1, 1), (0, 1).

    And unit normals of the cells, across both diagonals, or zero; and the squares (2, m) of these.
    """
    # Sides ab, bc, cd, da, and the diagonals ac, bd.
    vectors = np.concatenate([corner[[1, 2, 3, 0]] - corner, corner[2:] - corner[:2]])
    squares = dots(vectors, vectors)
    crossed = _crosses(vectors[[0, 3, 3, 1, 4]], vectors[[4, 4, 0, 5, 5]])
    size = np.sqrt(dots(crossed, crossed))
    none = size[:4] <= THIN * squares[OF].max(axis=1)
    some = none.any()
    size[4] = np.maximum(size[4], np.finfo(float).tiny)
    if some:
        size[:4] = np.where(none, 1.0, size[:4])
    crossed /= size[:, np.newaxis]
    normals, flat = crossed[:4], np.zeros(none.shape[1], dtype=bool)
    worse = np.zeros(len(flat), dtype=np.intp)
    if some:
        normals = np.where(none[:, np.newaxis], normals[[1, 0, 3, 2]], normals)
        flat = none.all(axis=0)
        worse = none[:2].sum(axis=0) - none[2:].sum(axis=0)
    return Planes(normals, flat, worse), crossed[4], squares[4:]


@dataclass(frozen=True, eq=False, slots=True)
class _Heights:
    """How high m cells are.

    Attributes
    ----------
    over : ndarray of float64, shape (2, m)
        Over the triangles of the rising diagonal, and of the falling one.
    signed : ndarray of float64, shape (6, m)
        Middles of ab, bc, cd, da over the middles of the ends; the cell's middle over that of
        da and bc, and over that of ab and cd.
    told : ndarray of float64, shape (6, m)
        The same, but what matters of them: lengths where there is no plane.
    """

    over: FloatArray
    signed: FloatArray
    told: FloatArray


def _heights(
    at: FloatArray, corner: FloatArray, planes: Planes, normal: Vectors, two_sided: bool
) -> _Heights:
    """Heights of nine points, the unit normals of the cells being known."""
    side, middle = at[SIDES], at[1, 1]
    # Half-way along the edges of the four triangles, each from one of its corners.
    away = np.array([side[0], side[1], middle, side[2], side[3]]) - corner[:2, np.newaxis]
    above = dots(away[FROM, HALFWAY], planes.normals[:, np.newaxis])
    highs = highest(above[:, 0], above[:, 1], above[:, 2])
    over = np.maximum(highs[::2], highs[1::2])
    bends = np.empty((6, *middle.shape))
    np.subtract(side, (corner + corner[[1, 2, 3, 0]]) * 0.5, out=bends[:4])
    np.subtract(middle, (side[[3, 0]] + side[[1, 2]]) * 0.5, out=bends[4:])
    signed = told = dots(bends, normal)
    if two_sided or planes.flat.any():
        stray = np.sqrt(dots(bends, bends))
        across = middle - (corner[:2] + corner[2:]) * 0.5
        wide = np.maximum(stray[:4].max(axis=0), np.sqrt(dots(across, across)))
        over, told = np.where(planes.flat, wide, over), np.where(planes.flat, stray, told)
        if two_sided:
            over = np.maximum(over, wide * 0.5)
            told = np.maximum(np.abs(told), stray * 0.5)
    return _Heights(over, signed, told)


def _crosses(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of vectors (k, 3, m)."""
    product = a[:, [1, 2, 0]] * b[:, [2, 0, 1]]
    product -= a[:, [2, 0, 1]] * b[:, [1, 2, 0]]
    return product


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
    net: FloatArray, at: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool
) -> FloatArray:
    """The greatest height (m,) of a control point that is left without the biquadratic part.

    Parameters
    ----------
    net : ndarray of float64, shape (p+1, q+1, 3, m)
    at : ndarray of float64, shape (3, 3, 3, m)
        Nine points of each.
    normals : ndarray of float64, shape (2, 3, m)
        Of both triangles,
    flat : ndarray of bool, shape (m,)
        unless there are none.
    """
    normals = normals[:, np.newaxis, np.newaxis]
    heights: FloatArray
    heights = np.abs(_left(dots(net, normals), dots(at, normals))).max(axis=(0, 1, 2))
    if flat.any() or two_sided:
        left = _left(net.swapaxes(0, 2).swapaxes(1, 2), at.swapaxes(0, 2).swapaxes(1, 2))
        stray = np.sqrt(np.add.reduce(left * left, axis=0).max(axis=(0, 1)))
        heights = np.where(flat, stray, np.maximum(heights, stray * (0.5 if two_sided else 0.0)))
    return heights


def sagging(net: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool) -> FloatArray:
    """How high a chord of nets is below the surface along u, and along v: (2, m).

    Judged by second differences; the arguments are those of `remainder`.
    """
    found = np.empty((2, net.shape[3]))
    for axis in (0, 1):
        degree = net.shape[axis] - 1
        bend = np.diff(net, n=2, axis=axis)
        size = np.abs(dots(bend, normals[:, np.newaxis, np.newaxis])).max(axis=(0, 1, 2))
        if flat.any() or two_sided:
            stray = np.sqrt(dots(bend, bend).max(axis=(0, 1)))
            size = np.where(flat, stray, np.maximum(size, stray * (0.5 if two_sided else 0.0)))
        found[axis] = size * (degree * (degree - 1) / 8)
    return found


def _left(values: FloatArray, at: FloatArray) -> FloatArray:
    """Nets (k, p+1, q+1, m) less those of biquadratic functions with values (k, 3, 3, m)."""
    along_u, along_v = (quadratic(n - 1)[..., np.newaxis] for n in values.shape[1:3])
    row = along_u[:, 0, np.newaxis] * at[:, np.newaxis, 0]
    row += along_u[:, 1, np.newaxis] * at[:, np.newaxis, 1]
    row += along_u[:, 2, np.newaxis] * at[:, np.newaxis, 2]
    left = values - along_v[:, 0] * row[:, :, np.newaxis, 0]
    left -= along_v[:, 1] * row[:, :, np.newaxis, 1]
    left -= along_v[:, 2] * row[:, :, np.newaxis, 2]
    return left


def allowed_at(nets: FloatArray, goal: Goal, eye: Vectors | None) -> FloatArray:
    """Deviation allowed at the least distance of the box about each net from the eye."""
    if eye is None:
        return np.full(nets.shape[3], goal.tolerance)
    net = points(nets)
    low, high = net.min(axis=(0, 1)), net.max(axis=(0, 1))
    return goal.allowed(length(np.maximum(np.maximum(low - eye, eye - high), 0.0)))
