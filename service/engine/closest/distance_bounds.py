"""Bounds of the distance of a cell to a point, proved from the model of the cell.

The model of a cell (`service.engine.cells.models`) has its centre c, the partials A, B and Q_ij
there, the unit normal n, and the bounds whose names are in capitals. For a point x let y = x − c, d
= |y| and f = ½ |x − S|² on the cell, in its own parameters s = (a, b) in [−1, 1]². Then

    f_a = −(x − S) · S_a,  at the centre −y · A,
    f_aa ≥ l_a = A · A − y · Q_aa − E_aa,   |f_ab| ≤ k = |A · B − y · Q_ab| + E_ab,
    E_ij = SPREAD_ij + |y · n| LIFT_ij + √(d² − (y · n)²) BEND_ij

A cell has no minimum of its patch if f_a or f_b has one sign. It is *settled* if a theorem gives
its minimum: the distance is nearly convex, or least on a known side.

Proofs in docs/proofs.md: "No minimum in a cell", "Lower bound in a cell" and "Minimum on a side".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree
from service.engine.vectors import UNIT, Items, dot

SAFE = 1 + 64 * UNIT
"""A factor that is larger than all rounding of a few products."""


@dataclass(frozen=True, eq=False, slots=True)
class Minima(Items):
    """Bounds of the minima of N pairs of a point and a settled cell.

    Attributes
    ----------
    point, cell : ndarray of int, shape (N,)
    low : ndarray of float64, shape (N,)
        Squared lower bound of the distance from the point to the cell.
    estimate : ndarray of float64, shape (N,)
        Approximate squared distance at `start`.
    start : ndarray of float64, shape (2, N)
        Approximate parameters of the minimum, by the model of the cell.
    sides : ndarray of float64, shape (2, N)
        For a and for b: −1 or 1 if the minimum lies on this side of the cell, else 0.
    convexity : ndarray of float64, shape (2, N)
        μ_a and μ_b. If the minimum lies on a side a = ±1: 0 and l_b; on a side b = ±1: l_a and 0.
    loss : ndarray of float64, shape (N,)
        Must be subtracted from squared lower bounds, because μ may be a little below 0.
    """

    point: Ints
    cell: Ints
    low: FloatArray
    estimate: FloatArray
    start: FloatArray
    sides: FloatArray
    convexity: FloatArray
    loss: FloatArray


@np.errstate(all="ignore")
def bound_distances(
    cells: CellTree,
    x: FloatArray,
    point: Ints,
    cell: Ints,
    *,
    low: FloatArray,
    limit: FloatArray,
    flattest: float,
) -> tuple[FloatArray, Bools, Minima]:
    """Bound the distances of N pairs of a point and a cell.

    Parameters
    ----------
    cells : CellTree
    x : ndarray of float64, shape (3, m)
        All points.
    point, cell : ndarray of int, shape (N,)
        The pairs.
    low, limit : ndarray of float64, shape (N,)
        Squared lower bounds of the distances that are known, and the largest of interest.
    flattest : float
        A cell may be settled if μ_a and μ_b, where negative, add up to at least −`flattest` d.

    Returns
    -------
    low : ndarray of float64, shape (N,)
        Squared lower bounds of the distances.
    is_open : ndarray of bool, shape (N,)
        Which cells must be halved: those that are within the limit, may have a minimum of their
        patch, and are not settled.
    minima : Minima
        The bounds of the minima of settled pairs within the limit.
    """
    m = model_rows
    model, net = cells.models.take(cell, axis=1), cells.net.take(cell)
    # A side of a rectangle at 0 or 1 is a side of the patch; some of these are points.
    rectangle, point_sides = cells.rectangle.take(cell, axis=1), cells.point_sides.take(net, axis=1)
    y = x.take(point, axis=1) - model[:3]
    squared = dot(y, y)
    d = np.sqrt(squared) * SAFE
    ya, yb, yaa, yab, ybb, height = (dot(y, model[first : first + 3]) for first in m.VECTORS)
    gradient = -np.stack([ya, yb])
    forms = model[m.FORM_AA : m.FORM_BB + 1] - [yaa, yab, ybb]
    # `height` is y · n; the other length is that of the rest of y. `spread` becomes E_aa, E_ab and
    # E_bb.
    tangential_distance = np.sqrt(np.maximum(squared - height * height, 0.0) + 32 * UNIT * squared)
    spread = model[m.LIFT_AA : m.LIFT_BB + 1] * (np.abs(height) * SAFE)
    spread += model[m.BEND_AA : m.BEND_BB + 1] * tangential_distance
    spread += model[m.SPREAD_AA : m.SPREAD_BB + 1]
    spread *= 1 + 16 * UNIT
    # The rounding of `forms`: |A · B| ≤ ½ (A · A + B · B).
    form_aa, form_bb = model[m.FORM_AA], model[m.FORM_BB]
    spread += 16 * UNIT * np.stack([form_aa, 0.5 * (form_aa + form_bb), form_bb])
    # Rows 0 and 2 of `forms` and `spread` are aa and bb, row 1 is ab: l_a and l_b, and k.
    least_second = forms[::2] - spread[::2]
    max_mixed = np.abs(forms[1]) * SAFE + spread[1]
    gradient_error = model[m.TANGENT_ERROR_A : m.TANGENT_ERROR_B + 1] * d
    gradient_error += model[m.CENTER_ERROR_A : m.CENTER_ERROR_B + 1]
    # No minimum in a cell.
    max_change = (np.abs(forms[::2]) + spread[::2] + max_mixed) * SAFE + gradient_error
    # Whether the distance decreases over the whole cell towards −1 (down), or towards 1 (up).
    is_down, is_up = gradient > max_change, gradient < -max_change
    # Rows 0 and 2 of `rectangle` are the lower ends u₀ and v₀; rows 1 and 3 are the upper ends.
    is_empty = ((is_down & (rectangle[::2] > 0)) | (is_up & (rectangle[1::2] < 1))).any(axis=0)
    # The lower bound in a cell.
    are_both_convex = (least_second > 0).all(axis=0)
    omega = np.where(
        are_both_convex, 1 - SAFE * max_mixed / np.sqrt(least_second).prod(axis=0), 1.0
    )
    convexity = omega * least_second - np.where(are_both_convex, 0.0, max_mixed)
    slope = np.abs(gradient)
    # Less the rounding errors of |y|² and of the bound below, and the error of c: 2 ε in y.
    squared -= 16 * UNIT * (squared + slope.sum(axis=0)) + 4 * d * model[m.ERROR]
    # Twice the bound of f.
    bound = squared + 2 * _least(slope + gradient_error, convexity, 1.0).sum(axis=0)
    low = np.maximum(bound, low)
    is_settled = -np.minimum(convexity, 0.0).sum(axis=0) <= flattest * d
    # The minimum on a side.
    has_one_sign = is_down | is_up
    is_settled |= (has_one_sign & (least_second[::-1] > 0)).any(axis=0) | has_one_sign.all(axis=0)
    # A cell that is not at such a side of the patch is empty.
    is_settled |= ((is_down & point_sides[::2]) | (is_up & point_sides[1::2])).any(axis=0)
    is_settled &= ~is_empty
    is_near = low <= limit
    is_open = is_near & ~(is_empty | is_settled)
    rows = np.flatnonzero(is_near & is_settled)
    side = is_up.astype(np.float64) - is_down
    gradient, forms, side, least_second, convexity = (
        values.take(rows, axis=1) for values in (gradient, forms, side, least_second, convexity)
    )
    is_on_side = side != 0
    # The loss is 2 |μ_i| in f, and twice this in the squared distance 2 f.
    loss = np.where(is_on_side.any(axis=0), 0.0, -4 * np.minimum(convexity, 0.0).sum(axis=0))
    # If b is on a side, only a varies, and the reverse: so l replaces μ.
    convexity = np.where(is_on_side[::-1], least_second, convexity)
    convexity = np.where(is_on_side, 0.0, np.maximum(convexity, 0.0))
    start = _model_minimum(gradient, forms, side)
    a, b = start
    # f changes by g · s + ½ s · (H s), and the squared distance by twice this.
    slopes = np.stack([forms[0] * a + forms[1] * b, forms[1] * a + forms[2] * b])
    estimate = squared[rows] + ((2 * gradient + slopes) * start).sum(axis=0)
    pairs = point[rows], cell[rows]
    return low, is_open, Minima(*pairs, bound[rows], estimate, start, side, convexity, loss)


def _model_minimum(gradient: FloatArray, forms: FloatArray, sides: FloatArray) -> FloatArray:
    """Approximate parameters (2, N) of the minima of quadratic models in [−1, 1]².

    If `sides` is −1 or 1 for a or b, the minimum is on this side.
    """
    (fa, fb), (faa, fab, fbb) = gradient, forms
    determinant = faa * fbb - fab * fab
    start = np.stack([fab * fb - fbb * fa, fab * fa - faa * fb]) / determinant
    a, b = sides
    start_along_axis = np.stack([-(fa + fab * b) / faa, -(fb + fab * a) / fbb])
    start = np.where(sides != 0, sides, np.where(sides[::-1] != 0, start_along_axis, start))
    # Replace a minimum outside the square by the minimum on the nearest side.
    a, b = np.clip(start, -1.0, 1.0)
    is_outside = np.abs(start) > 1
    start_along_axis = np.clip(np.stack([-(fa + fab * b) / faa, -(fb + fab * a) / fbb]), -1.0, 1.0)
    start = np.where(is_outside[::-1] & ~is_outside & (sides == 0), start_along_axis, start)
    return np.where(np.isfinite(start), np.clip(start, -1.0, 1.0), 0.0)


def _least(slope: FloatArray, mu: FloatArray, max_t: FloatArray | float) -> FloatArray:
    """Lower bound of g t + ½ μ t² for |t| ≤ max_t and |g| ≤ slope."""
    inside = slope < mu * max_t
    at_end = (0.5 * max_t * mu - slope) * max_t
    return np.where(inside, -0.5 * slope * slope / np.where(inside, mu, 1.0), at_end)


def least_change(gradient: FloatArray, mu: FloatArray, parameters: FloatArray) -> FloatArray:
    """Lower bound of Σ (g_i δ_i + ½ μ_i δ_i²) from one point of [−1, 1]² to all others.

    Parameters
    ----------
    gradient, mu, parameters : ndarray of float64, shape (2, N)
        g, μ ≥ 0, and the parameters (a, b) of the point.

    Returns
    -------
    ndarray of float64, shape (N,)
        At most 0. An error e of g lowers the bound by at most 2 Σ e_i; rounding acts like an error
        of 4 u |g|.
    """
    max_t = np.where(gradient > 0, 1.0 + parameters, 1.0 - parameters)
    return np.asarray(_least(np.abs(gradient), mu, max_t).sum(axis=0))
