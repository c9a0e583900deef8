"""Bounds for cells that a ray is almost tangent to: it may touch the cell, or lie within it.

If the direction d of a ray o + t d is almost tangent to a cell, the ray may meet the cell twice, or
all along the ray, so the theorems of `bounds` do not apply. Let n be the unit normal at the centre
of the cell, w = d × n / |d × n| and z = d × w. Then P = w · (S − o) and H = z · (S − o) vanish
where the cell meets the ray, and there t = T = d · (S − o). Let x be the parameter, a or b, with
the larger partial of P, and y the other one. On the curve P = 0, x = x₀ + x₁ y ± ε and H = h₀ + h₁
y + h₂ y² ± δ.

A cell is *thin* for a thickness τ if this curve, the *strip*, is within τ / 2 of the ray; all hits
then lie between its two ends.

Proofs in docs/proofs.md: "No hit of a grazing ray" and "Strips of a grazing ray".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree
from service.engine.rays.bounds import SAFE, Rays
from service.engine.vectors import UNIT, cross, dot, length

MAX_SLOPE = 0.25
"""The largest |d · n| at the centre of a cell that counts as almost tangent to the ray."""

MAX_CONTRACTION = 1 / 3
"""The largest ν of thin cells; with M the matrix of the partials of (T, P) at the centre, those of
M⁻¹ (T, P) differ from the unit matrix by at most ν in the cell."""


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """The strips of N pairs of a ray and a thin cell.

    Attributes
    ----------
    ray, cell : ndarray of int, shape (N,)
    across : ndarray of float64, shape (3, N)
        The vectors w.
    is_along_b : ndarray of bool, shape (N,)
        Whether y is b; if not, y is a.
    line : ndarray of float64, shape (2, N)
        x₀ and x₁.
    spread : ndarray of float64, shape (N,)
        The factor by which an error of P changes t, doubled: 4 |m'| / |m_y|.
    """

    ray: Ints
    cell: Ints
    across: FloatArray
    is_along_b: Bools
    line: FloatArray
    spread: FloatArray


@np.errstate(all="ignore")
def find_grazed_strips(
    cells: CellTree, rays: Rays, ray: Ints, cell: Ints
) -> tuple[Bools, Bools, Strips]:
    """Find the pairs of a ray and a cell, of N, without hits, and those that are thin.

    Parameters
    ----------
    cells : CellTree
    rays : Rays
    ray, cell : ndarray of int, shape (N,)

    Returns
    -------
    is_empty, is_thin : ndarray of bool, shape (N,)
        Which pairs have no hit, and which pairs are thin.
    strips : Strips
        The strips of the thin pairs.
    """
    m = model_rows
    model = cells.models.take(cell, axis=1)
    o, d = rays.origin.take(ray, axis=1), rays.direction.take(ray, axis=1)
    normal = model[m.NORMAL : m.NORMAL + 3]
    slope_to_ray = np.abs(dot(d, normal))
    w = cross(d, normal)
    w = w / length(w)
    z = cross(d, w)
    to_center = model[:3] - o
    vectors = [model[k : k + 3] for k in m.VECTORS[:5]]
    ta, tb, taa, tab, tbb = (dot(d, vector) for vector in vectors)
    pa, pb, paa, pab, pbb = (dot(w, vector) for vector in vectors)
    ha, hb, haa, hab, hbb = (dot(z, vector) for vector in vectors)
    rounding = model[m.ROUND] + rays.slack[ray]
    rest = model[m.REST] + rounding
    # REST_z; 2⁻⁴⁰ is larger than the rounding errors of z and n.
    height_error = model[m.REST_LIFT] + (slope_to_ray + 2.0**-40) * model[m.REST] + rounding
    # No hit: `error` is ε, `delta` is δ.
    is_along_b = np.abs(pa) >= np.abs(pb)
    px, py = np.where(is_along_b, pa, pb), np.where(is_along_b, pb, pa)
    hx, hy = np.where(is_along_b, ha, hb), np.where(is_along_b, hb, ha)
    hxx, hyy = np.where(is_along_b, haa, hbb), np.where(is_along_b, hbb, haa)
    x0, x1 = -dot(w, to_center) / px, -py / px
    error = (0.5 * np.abs(paa) + np.abs(pab) + 0.5 * np.abs(pbb) + rest) / np.abs(px) * SAFE
    max_x = np.abs(x0) + np.abs(x1)
    is_empty = np.abs(x0) > (1 + np.abs(x1) + error) * SAFE
    h0 = dot(z, to_center) + hx * x0 + 0.5 * hxx * x0 * x0
    h1 = hx * x1 + hy + hxx * x0 * x1 + hab * x0
    h2 = 0.5 * hxx * x1 * x1 + hab * x1 + 0.5 * hyy
    delta = error * (np.abs(hx) + np.abs(hxx) * (max_x + 0.5 * error) + np.abs(hab)) + height_error
    delta += 16 * UNIT * (1 + max_x) * (np.abs(hx) + np.abs(hab) + np.abs(hxx) * (1 + max_x))
    max_variation = (np.abs(h1) + np.abs(h2) + delta) * SAFE
    is_empty |= np.abs(h0) > max_variation
    is_thin = np.abs(h0) + max_variation <= rays.thickness[ray] / 2
    is_thin &= np.abs(h1) <= np.minimum(np.abs(h0), np.abs(h2) + delta) + np.abs(h2) + delta
    # Strips: `determinant` is |det M|, and `max_change` becomes ν |det M|. The rows of M⁻¹ are
    # (P_b, −T_b) / det M and (−P_a, T_a) / det M.
    determinant = np.abs(ta * pb - tb * pa)
    max_change = np.zeros(len(determinant))
    for t, p in ((tb, pb), (ta, pa)):
        second_order = np.abs(p * taa - t * paa) + 2 * np.abs(p * tab - t * pab)
        second_order += np.abs(p * tbb - t * pbb)
        sum_of_partials = np.abs(p) + np.abs(t)
        max_change = np.maximum(
            max_change,
            second_order * SAFE + sum_of_partials * (3 * model[m.REST] + model[m.ROUND]),
        )
    is_thin &= (
        (max_change <= MAX_CONTRACTION * determinant) & ~is_empty & (slope_to_ray <= MAX_SLOPE)
    )
    rows = np.flatnonzero(is_thin)
    # m' = (−T_b, T_a) / det M, of which |·| is the larger component, and |m_y| = |P_x / det M|.
    spread = 4 * np.maximum(np.abs(ta[rows]), np.abs(tb[rows])) / np.abs(px[rows])
    line = np.stack([x0[rows], x1[rows]])
    strips = Strips(ray[rows], cell[rows], w[:, rows], is_along_b[rows], line, spread)
    return is_empty, is_thin, strips
