"""Whether a cell is near enough to two triangles, and in which direction to cut it if not.

An estimate, which only has to be good: `certify` decides in the end. It must not miss anything,
however, so it looks at the whole net, not at samples of the surface alone: a cell is a biquadratic
surface through nine of its points and a remainder, whose control points all count.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.halving import (
    build_quadratic_matrix,
    evaluate_nine_points,
    project,
)
from service.engine.adaptive.cutting.normal_variation import (
    Scale,
    compare_normals,
    find_height_limit,
)
from service.engine.bounds.goal import Goal
from service.engine.bounds.heights import maximize_quadratics
from service.engine.bounds.vectors import Vectors, dot, dots, length

THIN = 1e-9
"""A triangle has no plane if its area is below this share of its longest side's square."""

NEARLY = 1.0 - 1e-9
"""What is not less by this factor is equal: rounding must not tell symmetric cells apart."""

BOLD, REST = 1.02, 0.5
"""A cell may be so much higher than is allowed, and so much of its remainder counts: points of the
surface are nearer than control points, and the certificate, which knows what is beside a triangle,
lets most such cells pass. Bolder estimates save triangles, but more of them fail."""

SKEW = 0.25
"""Share of a cell's skewness that its longer side gains when the direction of a cut is chosen."""

# Nine points of a cell are counted 3 i + j for S(i/2, j/2): the corners are a, b, c, d =
# 0, 6, 8, 2, counter-clockwise, the middles of the sides after them 3, 7, 5, 1, the cell's is 4.
STEPS = np.array([[6, 8, 2, 0, 8, 2], [0, 6, 8, 2, 0, 6]])
"""Ends and beginnings of ab, bc, cd, da, ac, bd."""

FACTORS = 3 * np.array([[0, 3, 3, 1, 4], [4, 4, 0, 5, 5]])[..., np.newaxis]
"""Of the normals of abc, acd, abd, bcd, and of the cell: the products of which two steps,"""

CYCLES = FACTORS + np.array([1, 2, 0]), FACTORS + np.array([2, 0, 1])
"""coordinate by coordinate."""

OF = np.array([[0, 1, 4], [2, 3, 4], [0, 3, 5], [1, 2, 5]])
"""Which steps are the sides of abc, acd, abd, bcd,"""

HALFWAY = np.array([[3, 4, 3, 7], [7, 5, 4, 5], [4, 1, 1, 4]])
"""the middles of these sides, first ones, second ones, third ones,"""

FROM = np.array([0, 0, 6, 6])
"""and a corner from which their heights are measured."""

BENDS = np.array([[3, 7, 5, 1, 4, 4], [0, 6, 8, 2, 1, 3], [6, 8, 2, 0, 7, 5]])
"""Middles of ab, bc, cd, da, and twice of the cell; and the ends of the lines they are in."""

LENGTH = 1e-3
"""Of the allowed deviation, how much a direction gains by its length: it breaks ties."""


NEITHER = np.zeros(1, dtype=np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class CellEstimates:
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


def estimate_cells(
    nets: FloatArray, goal: Goal, eye: Vectors | None, scale: Scale | None
) -> CellEstimates:
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
    at = evaluate_nine_points(nets)
    nine_points = at.reshape(9, *at.shape[2:])
    planes, normal, steps, squares = find_planes(nine_points)
    flat = planes.flat
    allowed = find_allowed(nets, goal, eye)
    if scale is not None:
        size = np.sqrt(np.maximum(squares[4], squares[5]))
        allowed = np.minimum(allowed, find_height_limit(goal.angle, size, scale))
    over, signed, told = measure_heights(nine_points, planes, normal, goal.two_sided)
    is_rising = over[0] < over[1] * NEARLY
    if planes.worse.any():
        is_rising = np.where(planes.worse == 0, is_rising, planes.worse < 0)
    best = np.where(is_rising, over[0], over[1])
    bends = np.maximum.reduce(np.abs(told).reshape(3, 2, -1), axis=0)
    fails = best > BOLD * allowed
    rest = (~fails).nonzero()[0]
    if len(rest):
        # Where all are near enough nothing need be copied.
        some = rest if len(rest) < len(fails) else slice(None)
        normals = np.where(is_rising, planes.normals[:2], planes.normals[2:])[..., some]
        net, bare = project(nets[..., some]), flat[some]
        more = measure_remainder(net, at[..., some], normals, bare, goal.two_sided)
        above = (best[some] + REST * more > BOLD * allowed[some]).nonzero()[0]
        if len(above):
            chosen = rest[above]
            fails[chosen] = True
            bends[:, chosen] = measure_sag(
                net[..., above], normals[..., above], bare[above], goal.two_sided
            )
    form = build_forms(steps, normal, -signed[4:], allowed)
    v_first = choose_directions(bends, np.sqrt(form[:3:2]), form[4] * 8.0, allowed)
    if scale is not None:
        turn = compare_normals(at, goal.angle, scale, nets)
        here = turn.exceeds & ~fails
        fails |= here
        v_first = np.where(here, turn.along_v, v_first)
    return CellEstimates(fails, v_first, is_rising, form)


def build_forms(
    steps: FloatArray, normal: Vectors, bends: FloatArray, allowed: FloatArray
) -> FloatArray:
    """`CellEstimates.form` of cells with such `STEPS`, normals, and bends (2, m) along u and v."""
    along = (steps[:2] - steps[2:4]) * 0.5
    form = np.empty((7, len(allowed)))
    form[:2], form[2] = dots(along[0], along), dot(along[1], along[1])
    form[3], form[4], form[5] = bends[0], dot(steps[0] + steps[2], normal) * -0.125, bends[1]
    form[6] = allowed
    return form


def choose_directions(
    bends: FloatArray, lengths: FloatArray, skew: FloatArray, allowed: FloatArray
) -> Bools:
    """Whether cells are to be cut across v, not across u: in the direction that bends more.

    Of the height that a cell has because its corners are not in a plane, half is gone whichever way
    it is cut: that speaks for the longer side, and so does, a little, what is allowed.

    Parameters
    ----------
    bends, lengths : ndarray of float64, shape (2, m)
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
    worse : ndarray of int, shape (m,) or (1,)
        How many more triangles without area the rising diagonal has.
    """

    normals: FloatArray
    flat: Bools
    worse: Ints


def find_planes(at: FloatArray) -> tuple[Planes, Vectors, FloatArray, FloatArray]:
    """Planes of cells of which nine points (9, 3, m) are known.

    And unit normals of the cells, across both diagonals, or zero; `STEPS` (6, 3, m) and the squares
    of their lengths (6, m).
    """
    steps = at.take(STEPS[0], axis=0)
    steps -= at.take(STEPS[1], axis=0)
    squares = dots(steps, steps)
    lines = steps.reshape(-1, steps.shape[2])
    crossed = lines.take(CYCLES[0][0], axis=0) * lines.take(CYCLES[1][1], axis=0)
    crossed -= lines.take(CYCLES[1][0], axis=0) * lines.take(CYCLES[0][1], axis=0)
    size = np.sqrt(dots(crossed, crossed))
    none = size[:4] <= THIN * np.maximum.reduce(squares.take(OF, axis=0), axis=1)
    size[4] = np.maximum(size[4], np.finfo(float).tiny)
    if not none.any():
        crossed /= size[:, np.newaxis]
        return Planes(crossed[:4], none[0], NEITHER), crossed[4], steps, squares
    size[:4] = np.where(none, 1.0, size[:4])
    crossed /= size[:, np.newaxis]
    normals = np.where(none[:, np.newaxis], crossed[[1, 0, 3, 2]], crossed[:4])
    worse = none[:2].sum(axis=0) - none[2:].sum(axis=0)
    return Planes(normals, none.all(axis=0), worse), crossed[4], steps, squares


def measure_heights(
    at: FloatArray, planes: Planes, normal: Vectors, two_sided: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """How high nine points (9, 3, m) of cells are, whose unit normals are known.

    Returns
    -------
    over : ndarray of float64, shape (2, m)
        Over the triangles of the rising diagonal, and of the falling one.
    signed : ndarray of float64, shape (6, m)
        Of `BENDS`, over the middles of their lines.
    told : ndarray of float64, shape (6, m)
        As before, but what matters of them: lengths where there is no plane.
    """
    away = at.take(HALFWAY, axis=0)
    away -= at.take(FROM, axis=0)
    highs = maximize_heights(dots(away, planes.normals))
    over = np.maximum(highs[::2], highs[1::2])
    bends = at.take(BENDS[1], axis=0)
    bends += at.take(BENDS[2], axis=0)
    bends *= -0.5
    bends += at.take(BENDS[0], axis=0)
    signed = told = dots(bends, normal)
    if two_sided or planes.flat.any():
        stray = np.sqrt(dots(bends, bends))
        across = at[4] - (at[[0, 6]] + at[[8, 2]]) * 0.5
        wide = np.maximum(stray[:4].max(axis=0), np.sqrt(dots(across, across)))
        over, told = np.where(planes.flat, wide, over), np.where(planes.flat, stray, told)
        if two_sided:
            over = np.maximum(over, wide * 0.5)
            told = np.maximum(np.abs(told), stray * 0.5)
    return over, signed, told


def maximize_heights(m: FloatArray) -> FloatArray:
    """Largest |4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0)| on a triangle; m is (3, …)."""
    both = np.empty((3, 2, *m.shape[1:]))
    both[:, 0], both[:, 1] = m, -m
    up, down = maximize_quadratics(both)
    highs: FloatArray = np.maximum(up, down)
    return highs


def measure_remainder(
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
    heights = np.maximum.reduce(
        np.abs(_subtract_biquadratic(dots(net, normals), dots(at, normals))), axis=(0, 1, 2)
    )
    if flat.any() or two_sided:
        left = _subtract_biquadratic(
            net.swapaxes(0, 2).swapaxes(1, 2), at.swapaxes(0, 2).swapaxes(1, 2)
        )
        stray = np.sqrt(np.add.reduce(left * left, axis=0).max(axis=(0, 1)))
        heights = np.where(flat, stray, np.maximum(heights, stray * (0.5 if two_sided else 0.0)))
    return heights


def measure_sag(net: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool) -> FloatArray:
    """How high a chord of nets is below the surface along u, and along v: (2, m).

    Judged by second differences; the arguments are those of `measure_remainder`.
    """
    found = np.empty((2, net.shape[3]))
    for axis in (0, 1):
        degree = net.shape[axis] - 1
        step = net.swapaxes(0, axis)
        step = step[1:] - step[:-1]
        bend = step[1:] - step[:-1]
        size = np.abs(dots(bend, normals[:, np.newaxis, np.newaxis])).max(axis=(0, 1, 2))
        if flat.any() or two_sided:
            stray = np.sqrt(dots(bend, bend).max(axis=(0, 1)))
            size = np.where(flat, stray, np.maximum(size, stray * (0.5 if two_sided else 0.0)))
        found[axis] = size * (degree * (degree - 1) / 8)
    return found


def _subtract_biquadratic(values: FloatArray, at: FloatArray) -> FloatArray:
    """Nets (k, p+1, q+1, m) less those of biquadratic functions with values (k, 3, 3, m)."""
    along_u, along_v = (build_quadratic_matrix(n - 1)[..., np.newaxis] for n in values.shape[1:3])
    row = along_u[:, 0, np.newaxis] * at[:, np.newaxis, 0]
    row += along_u[:, 1, np.newaxis] * at[:, np.newaxis, 1]
    row += along_u[:, 2, np.newaxis] * at[:, np.newaxis, 2]
    left = values - along_v[:, 0] * row[:, :, np.newaxis, 0]
    left -= along_v[:, 1] * row[:, :, np.newaxis, 1]
    left -= along_v[:, 2] * row[:, :, np.newaxis, 2]
    return left


def find_allowed(nets: FloatArray, goal: Goal, eye: Vectors | None) -> FloatArray:
    """Deviation allowed at the least distance of the box about each net from the eye."""
    if eye is None:
        return np.full(nets.shape[3], goal.tolerance)
    net = project(nets)
    low, high = net.min(axis=(0, 1)), net.max(axis=(0, 1))
    return goal.find_allowed(length(np.maximum(np.maximum(low - eye, eye - high), 0.0)))
