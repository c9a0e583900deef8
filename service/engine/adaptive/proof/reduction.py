"""Nets of high degree by cubic ones, and how far these are from them.

The triangular net of a tensor net of degree (p, q) has (p+q+1)(p+q+2)/2 points, each a sum of many.
Above a certain degree it is cheaper to go by a net V of degree at most (3, 3) that is near the net
W over the box about the triangle. With E V for V raised to the degree of W, the hull property of
the difference gives, polynomial or homogeneous,

    |S − S'| ≤ max_i ‖W_i − (E V)_i‖,
    |S − S'| = |(X − X') − (w − w') (S' − C)| / w            X and X' about C, a corner
             ≤ (max_i ‖X_i − (E X')_i‖ + max_i |w_i − (E w')_i| max ‖S' − C‖) / min_i w_i.

V is what least squares give in the Bernstein basis, keeping the ends of every line, hence the
corners. It need not be the best; only the difference has to be right. Its error is of fourth order
in the size of the box.

Triangles that share a box share all of this, and boxes that share an interval of u what is done
along u: therefore the triangles are handled in the order of their boxes.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein, elevation
from service.bases.cache import PLANS
from service.engine.adaptive.proof.blossoms import blossoms

DIRECT = 8
"""Degree p + q up to which the nets of triangles are computed as such, and nothing is reduced."""

LOW = 3
"""Degree to which nets are reduced."""

SHIFT = 2.0**-40
"""What rounding may do to these differences: to points, 4 · 600 u at degree 64, to sums of a few
more, and to parameters within a box, at 2^-53 of which a cubic surface goes 2^-44 at most where no
coordinate is above 4. Where weights differ, in proportion to what they do."""


@dataclass(frozen=True, eq=False, slots=True)
class Reduced:
    """What there is of B different boxes, m triangles being in them.

    Attributes
    ----------
    box : ndarray of int, shape (m,)
    whole : ndarray of float64, shape (p+1, q+1, D, B)
        The nets.
    low : ndarray of float64, shape (min(p, 3)+1, min(q, 3)+1, D, B)
        Nets near them.
    gap : ndarray of float64, shape (B,)
        No point of one surface is further than this from that of the other, at any parameters.
    """

    box: Ints
    whole: FloatArray
    low: FloatArray
    gap: FloatArray


def order_of(patch: Ints, u: FloatArray, v: FloatArray) -> Ints:
    """An order that keeps equal boxes together, and equal intervals of u; sides (2, m)."""
    return np.lexsort((v[1], v[0], u[1], u[0], patch))


def over_boxes(nets: FloatArray, patch: Ints, u: FloatArray, v: FloatArray) -> Reduced:
    """Nets (p+1, q+1, D, m) of patches over boxes, in the order above, no coordinate above 1."""
    new_u = _changes(patch, *u)
    new = new_u | _changes(*v)
    first_u, first = np.flatnonzero(new_u), np.flatnonzero(new)
    strips = _restricted(nets[..., first_u], u[:, first_u], 0)
    boxes = _restricted(strips[..., (np.cumsum(new_u) - 1)[first]], v[:, first], 1)
    return Reduced(np.cumsum(new) - 1, boxes, *_near(boxes))


def _changes(*keys: FloatArray | Ints) -> Bools:
    """Where any of these is another than before, shape (m,); the first always."""
    new = np.zeros(len(keys[0]), dtype=bool)
    new[:1] = True
    for key in keys:
        new[1:] |= key[1:] != key[:-1]
    return new


def _restricted(nets: FloatArray, sides: FloatArray, axis: int) -> FloatArray:
    """Nets over intervals (2, m) of one direction: matrices, themselves blossoms, times lines.

    Each row of a matrix is a blossom of the nets of the Bernstein polynomials: nothing is negative,
    and rows add up to one.
    """
    size = nets.shape[axis]
    different, which = np.unique(sides, axis=1, return_inverse=True)
    units = np.broadcast_to(np.eye(size)[..., np.newaxis], (size, size, different.shape[1]))
    return _applied(blossoms(units, [*different])[..., which], nets, axis)


def _near(boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets near others, and how near they are."""
    homogeneous = boxes.shape[2] == 4
    if homogeneous:
        corner = boxes[0, 0, :3] / boxes[0, 0, 3]
        boxes = boxes.copy()
        boxes[:, :, :3] -= boxes[:, :, 3:] * corner
    low = boxes
    for axis in (0, 1):
        degree = boxes.shape[axis] - 1
        if degree > LOW:
            low = _applied(_reduction(degree)[..., np.newaxis], low, axis)
    raised = low
    for axis in (0, 1):
        degree = boxes.shape[axis] - 1
        if degree > LOW:
            raised = _applied(elevation(LOW, degree)[..., np.newaxis], raised, axis)
    away = boxes - raised
    away *= away
    points = np.sqrt((away[:, :, 0] + away[:, :, 1] + away[:, :, 2]).max(axis=(0, 1)))
    # The corners of a triangle within a box are rounded where they are no corners of the box.
    if not homogeneous:
        return low, points + SHIFT
    weights = np.sqrt(away[:, :, 3].max(axis=(0, 1)))
    least, most = (choose(low[:, :, 3], axis=(0, 1)) for choose in (np.min, np.max))
    positive = least > 0
    least = np.where(positive, least, 1.0)
    low[:, :, 3] = np.where(positive, low[:, :, 3], 1.0)
    seen = low[:, :, :3] / low[:, :, 3:]
    size = np.sqrt((seen[:, :, 0] ** 2 + seen[:, :, 1] ** 2 + seen[:, :, 2] ** 2).max(axis=(0, 1)))
    gap = (points + weights * size) / boxes[:, :, 3].min(axis=(0, 1)) + SHIFT * (most / least)
    low[:, :, :3] += low[:, :, 3:] * corner
    return low, np.where(positive, gap, np.inf)


def _applied(matrix: FloatArray, nets: FloatArray, axis: int) -> FloatArray:
    """Matrices (a, b, m) times the lines of nets, term after term; (a, b, 1) for one for all."""
    lines = nets.swapaxes(0, axis)
    made = np.zeros((len(matrix), *lines.shape[1:]))
    term = np.empty(lines.shape[1:])
    for number, row in enumerate(matrix):
        total = made[number]
        for factor, line in zip(row, lines, strict=True):
            if len(factor) > 1 or factor[0]:
                np.multiply(line, factor, out=term)
                np.add(total, term, out=total)
    return made.swapaxes(0, axis)


def _reduction(degree: int) -> FloatArray:
    """The net of degree 3 nearest to one of degree n with the same ends: shape (4, n+1)."""

    def build() -> FloatArray:
        t = np.arange(4 * degree + 1) / (4 * degree)
        fine, coarse = bernstein(degree, t), bernstein(LOW, t)
        ends = np.zeros((2, degree + 1))
        ends[0, 0] = ends[1, -1] = 1.0
        wanted = fine - coarse[:, [0, -1]] @ ends
        inner = np.linalg.lstsq(coarse[:, 1:-1], wanted, rcond=None)[0]
        return np.concatenate([ends[:1], inner, ends[1:]])

    return PLANS.array(("reduction", degree), build)
