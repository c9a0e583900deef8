r"""What the model of a cell proves about its distance to a point.

For a point x let y = x − c, d = |y| and f = ½ |x − S|² on a cell, in its own parameters s = (a, b)
in [−1, 1]². With the bounds of `cell_models`

    f_a = −(x − S) · S_a,  at the centre −y · A,
    f_aa = S_a · S_a − (x − S) · S_aa,  over the cell A · A − y · Q_aa ± E_aa,
    E_ij = |S_i · S_j − A_i · A_j| + |S − c| (|Q_ij| + τ_ij) + |y · (S_ij − Q_ij)|
         ≤ SPREAD_ij + |y · n| LIFT_ij + √(d² − (y · n)²) BEND_ij

so that f_aa ≥ l_a, f_bb ≥ l_b and |f_ab| ≤ k over the cell.

**Theorem 1 (no minimum).** If f_a > 0 over the closed cell and its side a = −1 is no side of the
patch, no minimum of f over the patch lies in the cell. *Proof.* From any of its points the distance
falls along −a, and one can go there within the patch. The same with −f_a and a = 1, and with b. The
derivative is of one sign where |f_a| at the centre exceeds |f_aa| + |f_ab| ≤ |A · A − y · Q_aa| +
E_aa + k. ∎

**Theorem 2 (lower bound).** Let l_a, l_b > 0 and ω = 1 − k / √(l_a l_b); then
f ≥ f(s₀) + Σ (g_i δ_i + ½ μ_i δ_i²) for s₀ and s₀ + δ in the cell, with the gradient g at s₀ and
μ_i = ω l_i; otherwise with μ_i = l_i − k. Each term is a parabola in one variable, whose minimum
over an interval is a closed form. *Proof.* By Taylor with the Hessian at a point between, and
2 k |δ_a δ_b| ≤ k (t δ_a² + δ_b² / t) for every t > 0: for t = √(l_a / l_b), and for t = 1. ∎

**Theorem 3 (a side).** If f_a > 0 over the cell, its minimum lies on the side a = −1, and there
f ≥ f(s₀) + g_b δ_b + ½ l_b δ_b² for s₀ on this side. If this side is one point, its distance is the
minimum. If f_b is of one sign too, the corner's is. *Proof.* Theorem 1 within the cell; Taylor
along the side. ∎

A cell is *settled* where one of these tells its minimum: μ_a, μ_b ≥ 0, or so little below, as where
a patch is a line, that with |δ_i| ≤ 2 the loss of 2 |μ_i| is far below the tolerance; or one sign
of f_a with l_b > 0, with a side that is a point, or with one sign of f_b.

**Rounding.** y, d and the dot products are wrong by at most 8 u times the products of lengths, and
by what the errors of c and the partials add: f_a at the centre by SLOPE_a d + LEAST_a, where
SLOPE_a ≥ 8 u |A| holds the first. Each bound is moved by these to the safe side.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries import cell_models as columns
from service.engine.queries.cell_models import UNIT

SAFE = 1 + 64 * UNIT


@dataclass(frozen=True, eq=False, slots=True)
class CellBounds:
    """For N pairs of a point and a cell.

    Attributes
    ----------
    low : ndarray of float64, shape (N,)
        No point of the cell is nearer, as a squared distance.
    empty : ndarray of bool, shape (N,)
        The cell has no minimum of its patch.
    settled : ndarray of bool, shape (N,)
    sides : ndarray of int8, shape (2, N)
        −1 or 1 where the minimum lies on this side of a or b, or 0.
    convexity : ndarray of float64, shape (2, N)
        μ_a and μ_b of a settled cell; 0 where the distance along a side does not change.
    start : ndarray of float64, shape (2, N)
        Where the model of a settled cell is least, about.
    loss : ndarray of float64, shape (N,)
        What is to be taken from squares of lower bounds, as μ may be a little below 0.
    """

    low: FloatArray
    empty: Bools
    settled: Bools
    sides: FloatArray
    convexity: FloatArray
    start: FloatArray
    loss: FloatArray

    def take(self, rows: Ints | Bools) -> "CellBounds":
        """Those of some pairs."""
        return CellBounds(*(getattr(self, name)[..., rows] for name in CellBounds.__slots__))

    @staticmethod
    def joined(bounds: Sequence["CellBounds"]) -> "CellBounds":
        """All of them, one after another."""
        return CellBounds(
            *(
                np.concatenate([getattr(each, name) for each in bounds], axis=-1)
                for name in CellBounds.__slots__
            )
        )


def sphere_bounds(model: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squares of a lower bound of the distance to a cell, and of the distance to a point of it.

    Parameters
    ----------
    model : ndarray of float64, shape (at least 5, N)
    x : ndarray of float64, shape (3, N)
    """
    y = x - model[:3]
    y *= y
    distance = y[0]
    distance += y[1]
    distance += y[2]
    np.sqrt(distance, out=distance)
    low = distance * (1 - 8 * UNIT)
    low -= model[columns.RADIUS]
    np.maximum(low, 0.0, out=low)
    low *= low
    distance *= 1 + 8 * UNIT
    distance += model[columns.ERROR]
    distance *= distance
    return low, distance


@np.errstate(all="ignore")
def cell_bounds(
    model: FloatArray, place: FloatArray, point: Bools, x: FloatArray, flattest: float
) -> CellBounds:
    """Bounds of the distance for pairs of a point and a cell.

    Parameters
    ----------
    model : ndarray of float64, shape (COLUMNS, N)
    place : ndarray of float64, shape (4, N)
        The rectangle of the cell: a side at 0 or 1 is a side of the patch.
    point : ndarray of bool, shape (4, N)
        Which sides are one point.
    x : ndarray of float64, shape (3, N)
    flattest : float
        Negative convexity up to which a cell is settled, in distances of the point.
    """
    m = columns
    y = x - model[:3]
    squared = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    d = np.sqrt(squared) * SAFE
    fa, fb = -_dot(y, model, m.TANGENT_A), -_dot(y, model, m.TANGENT_B)
    faa = model[m.FORM_AA] - _dot(y, model, m.SECOND_AA)
    fab = model[m.FORM_AB] - _dot(y, model, m.SECOND_AB)
    fbb = model[m.FORM_BB] - _dot(y, model, m.SECOND_BB)
    above = _dot(y, model, m.NORMAL)
    beside = np.sqrt(np.maximum(squared - above * above, 0.0) + 32 * UNIT * squared)
    above = np.abs(above) * SAFE
    eaa, eab, ebb = (
        model[m.SPREAD_AA + k] + above * model[m.LIFT_AA + k] + beside * model[m.BEND_AA + k]
        for k in range(3)
    )
    eaa += 16 * UNIT * (model[m.FORM_AA] + eaa)
    ebb += 16 * UNIT * (model[m.FORM_BB] + ebb)
    k = (np.abs(fab) + eab) * SAFE + 8 * UNIT * (model[m.FORM_AA] + model[m.FORM_BB])
    la, lb = faa - eaa, fbb - ebb
    wrong_a = model[m.SLOPE_A] * d + model[m.LEAST_A]
    wrong_b = model[m.SLOPE_B] * d + model[m.LEAST_B]
    most_a = (np.abs(faa) + eaa + k) * SAFE + wrong_a
    most_b = (np.abs(fbb) + ebb + k) * SAFE + wrong_b
    up_a, down_a, up_b, down_b = fa > most_a, -fa > most_a, fb > most_b, -fb > most_b
    empty = up_a & (place[0] > 0)
    empty |= down_a & (place[1] < 1)
    empty |= up_b & (place[2] > 0)
    empty |= down_b & (place[3] < 1)
    one_a, one_b = up_a | down_a, up_b | down_b
    root = np.sqrt(la) * np.sqrt(lb)
    both = (la > 0) & (lb > 0)
    share = np.where(both, 1 - SAFE * k / root, 1.0)
    less = np.where(both, 0.0, k)
    mu_a, mu_b = share * la - less, share * lb - less
    flat = np.maximum(-mu_a, 0.0) + np.maximum(-mu_b, 0.0)
    inside = flat <= flattest * d
    low = 2 * (_least(np.abs(fa) + wrong_a, mu_a, 1.0) + _least(np.abs(fb) + wrong_b, mu_b, 1.0))
    low += squared * (1 - 16 * UNIT) - 4 * d * model[m.ERROR]
    low -= 16 * UNIT * (np.abs(fa) + np.abs(fb))
    # Theorem 3.
    on_point_a = (up_a & point[0]) | (down_a & point[1])
    on_point_b = (up_b & point[2]) | (down_b & point[3])
    settled = inside | (one_a & (lb > 0)) | (one_b & (la > 0)) | (one_a & one_b)
    settled |= on_point_a | on_point_b
    convexity = np.stack(
        [
            np.where(one_a, 0.0, np.maximum(np.where(one_b, la, mu_a), 0.0)),
            np.where(one_b, 0.0, np.maximum(np.where(one_a, lb, mu_b), 0.0)),
        ]
    )
    loss = np.where(one_a | one_b, 0.0, 4 * flat)
    sides = np.stack([down_a.astype(np.float64) - up_a, down_b.astype(np.float64) - up_b])
    determinant = faa * fbb - fab * fab
    start = np.stack([(fab * fb - fbb * fa) / determinant, (fab * fa - faa * fb) / determinant])
    alone = np.stack([-fa / faa, -fb / fbb])
    start = np.where(sides != 0, sides, np.where(sides[::-1] != 0, alone, start))
    start = np.where(np.isfinite(start), np.clip(start, -1.0, 1.0), 0.0)
    return CellBounds(low, empty, settled, sides, convexity, start, loss)


def _dot(y: FloatArray, model: FloatArray, first: int) -> FloatArray:
    product = y[0] * model[first]
    product += y[1] * model[first + 1]
    product += y[2] * model[first + 2]
    return np.asarray(product)


def _least(slope: FloatArray, mu: FloatArray, reach: float) -> FloatArray:
    """Lower bound of g t + ½ μ t² for |t| ≤ reach and |g| ≤ slope."""
    inside = slope < mu * reach
    at_end = (0.5 * reach * mu - slope) * reach
    return np.where(inside, -0.5 * slope * slope / np.where(inside, mu, 1.0), at_end)


def least_change(gradient: FloatArray, mu: FloatArray, place: FloatArray) -> FloatArray:
    """Lower bound of Σ (g_i δ_i + ½ μ_i δ_i²) from a place in [−1, 1]² to all others.

    Parameters
    ----------
    gradient, mu, place : ndarray of float64, shape (2, N)
        g, μ ≥ 0, and the place.

    Returns
    -------
    ndarray of float64, shape (N,)
        At most 0. Where g is wrong by e, it is lower by at most 2 Σ e_i; rounding is as if g were
        wrong by 4 u |g|.
    """
    low, high = -1.0 - place, 1.0 - place
    with np.errstate(all="ignore"):
        step = np.where(mu > 0, -gradient / mu, np.where(gradient > 0, -2.0, 2.0))
    step = np.clip(np.where(np.isfinite(step), step, 0.0), low, high)
    change = gradient * step + 0.5 * mu * step * step
    return np.asarray(np.minimum(change, 0.0).sum(axis=0))
