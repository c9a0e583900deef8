"""Estimates whether a cell is near enough to two triangles or to a fan, and how to cut it.

The estimate need not be exact, because the certificate decides. But it must not miss a bend, so it
uses the whole net, not only samples of the surface: a cell is a biquadratic surface through nine of
its points, plus a remainder whose control points all count (`heights`).
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.adaptive.cutting.cells import FaceCells, Leaves, evaluate_nine_points
from service.engine.adaptive.cutting.heights import (
    NEARLY,
    find_planes,
    measure_fans,
    measure_heights,
    measure_remainder,
    measure_sag,
)
from service.engine.adaptive.cutting.normal_variation import (
    Scale,
    compare_normals,
    find_height_limit,
)
from service.engine.bounds.goal import Goal
from service.engine.vectors import Vectors, dot, length, project

REMAINDER_SHARE, FAN_SHARE = 0.5, 0.95
"""A cell passes as two triangles if its height plus `REMAINDER_SHARE` times its remainder is at
most the allowed deviation, and as a fan if this sum is at most `FAN_SHARE` times the allowed
deviation. Most of these cells pass the certificate, because points of the surface are nearer than
control points, and because the certificate also uses the neighbours of a triangle. With a smaller
`REMAINDER_SHARE` or a larger `FAN_SHARE` meshes have fewer triangles, but more of them fail the
certificate."""

CURVE_SHARE = 0.7
"""Share of the tolerance up to which a piece of the border may deviate from its chord; the rest is
for the surface beside it. If the side of a cell on the border deviates more, the border has
vertices there, and halving the cell costs no more vertices than a fan."""

SKEW = 0.25
"""Share of a cell's skewness (`skew` of `choose_directions`) that counts for the longer side when a
direction is chosen."""

LENGTH = 1e-3
"""Share of the allowed deviation that counts for the longer side too; it breaks ties."""


def estimate_cells(
    cells: FaceCells,
    nets: FloatArray,
    goal: Goal,
    *,
    eye: Vectors | None,
    scale: Scale | None,
    at_border: Bools,
) -> tuple[Bools, Leaves]:
    """Which cells must be cut, and all cells as leaves; each cell is in one span.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, D, m)
        p, q ≥ 2.
    eye : ndarray of float64, shape (3, m), or None
        The eye of the goal's view, in the coordinates of each net.
    scale : Scale or None
        Sizes of the cells, because small cells are not cut for their normals. None if the goal has
        no angle.
    at_border : ndarray of bool, shape (4, m)
        Whether the sides ab, bc, cd, da of the cells are on the border of the face.
    """
    grid = evaluate_nine_points(nets)
    nine_points = grid.reshape(9, *grid.shape[2:])
    planes, normal, steps, squares = find_planes(nine_points)
    flat = planes.flat
    allowed = find_allowed(nets, goal, eye)
    if scale is not None:
        # Rows 4 and 5 of `squares` belong to the two diagonals of each cell.
        diagonal = np.sqrt(np.maximum(squares[4], squares[5]))
        allowed = np.minimum(allowed, find_height_limit(goal.angle, diagonal, scale))
    over, signed, bends = measure_heights(nine_points, planes, normal, goal.two_sided)
    is_rising = over[0] < over[1] * NEARLY
    if planes.worse.any():
        is_rising = np.where(planes.worse == 0, is_rising, planes.worse < 0)
    best = np.where(is_rising, over[0], over[1])
    # The largest of three lines along u (ab, cd, through the middle), and of three along v.
    bends = np.maximum.reduce(np.abs(bends).reshape(3, 2, -1), axis=0)
    fits, sides = best <= allowed, np.abs(signed[:4])
    may_fan = ~flat & (sides <= np.where(at_border, CURVE_SHARE, 1.0) * allowed).all(axis=0)
    fails, is_fan = np.ones(len(cells), dtype=bool), np.zeros(len(cells), dtype=bool)
    tried = (fits | may_fan).nonzero()[0]
    if len(tried):
        normals = np.where(is_rising, planes.normals[:2], planes.normals[2:]).take(tried, axis=-1)
        net, no_plane = project(nets.take(tried, axis=-1)), flat[tried]
        remainder = measure_remainder(
            net, grid.take(tried, axis=-1), normals, no_plane, goal.two_sided
        )
        remainder *= REMAINDER_SHARE
        passes = best[tried] + remainder <= allowed[tried]
        other = (~passes & may_fan[tried]).nonzero()[0]  # rows of `tried`
        if len(other):
            rows = tried[other]
            fan_heights = measure_fans(nine_points.take(rows, axis=-1), goal.two_sided)
            is_fan[rows] = fan_heights + remainder[other] <= FAN_SHARE * allowed[rows]
        fails[tried] = ~(passes | is_fan[tried])
        # Cells that fail only because of their remainder are cut as their whole nets bend.
        curled = (fails[tried] & fits[tried]).nonzero()[0]
        if len(curled):
            net, normals = net.take(curled, axis=-1), normals.take(curled, axis=-1)
            bends[:, tried[curled]] = measure_sag(net, normals, no_plane[curled], goal.two_sided)
    # `signed` has heights of the cell over chords, a form has heights of chords over the cell.
    form = build_forms(steps, normal, -signed[4:], allowed)
    # Rows 0 and 2 of `Leaves.form` are the squared lengths along u and v. Row 4 is b, and 8 b is
    # (S_00 − S_10 + S_11 − S_01) · n.
    along_v = choose_directions(bends, np.sqrt(form[:3:2]), form[4] * 8.0, allowed)
    if scale is not None:
        turning, turns_along_v = compare_normals(grid, goal.angle, scale, nets)
        turning &= ~fails
        fails |= turning
        along_v = np.where(turning, turns_along_v, along_v)
        is_fan &= ~fails
    return fails, Leaves(cells.rectangle, cells.face, along_v, is_rising, is_fan, form)


def build_forms(
    steps: FloatArray, normal: Vectors, bends: FloatArray, allowed: FloatArray
) -> FloatArray:
    """`Leaves.form` of cells, given their steps and normals (`find_planes`).

    `bends` (2, m) are the heights of chords along u and along v over the cell, along the normals.
    """
    # The mean of ab and dc, and that of bc and ad.
    along = (steps[:2] - steps[2:4]) * 0.5
    form = np.empty((7, len(allowed)))
    form[:2], form[2] = dot(along[0], along), dot(along[1], along[1])
    form[3], form[4], form[5] = bends[0], dot(steps[0] + steps[2], normal) * -0.125, bends[1]
    form[6] = allowed
    return form


def choose_directions(
    bends: FloatArray, lengths: FloatArray, skew: FloatArray, allowed: FloatArray
) -> Bools:
    """Whether to halve v and not u: the direction in which the cell bends more.

    If the corners of a cell are not in a plane, a cut in either direction halves their height over
    a plane. So a share of this height counts for the longer side, and a small share of the allowed
    deviation too.

    Parameters
    ----------
    bends, lengths : ndarray of float64, shape (2, m)
        Heights over chords, and lengths of cells, along u and along v.
    skew : ndarray of float64, shape (m,)
        (S_00 − S_10 + S_11 − S_01) · n.
    """
    finite = np.where(allowed < np.inf, allowed, 0.0)  # no share of an infinite deviation
    tie = LENGTH * finite + SKEW * np.abs(skew)
    tie /= np.maximum(lengths[0] + lengths[1], np.finfo(float).tiny)
    chosen: Bools = bends[0] + tie * lengths[0] < (bends[1] + tie * lengths[1]) * NEARLY
    return chosen


def find_allowed(nets: FloatArray, goal: Goal, eye: Vectors | None) -> FloatArray:
    """The deviations (m,) allowed at the least distances of boxes about nets from the eye."""
    if eye is None:
        return np.full(nets.shape[3], goal.tolerance)
    net = project(nets)
    low, high = net.min(axis=(0, 1)), net.max(axis=(0, 1))
    return goal.find_allowed(length(np.maximum(np.maximum(low - eye, eye - high), 0.0)))
