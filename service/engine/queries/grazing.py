r"""Cells along which a ray grazes the surface, touches it, or lies within it.

Where the direction d of a ray is nearly tangent to a cell, it may meet the cell twice, or all along
it, and `ray_bounds` settles nothing. With the unit normal n at the centre let w = d × n / |d × n|
and z = d × w: w is across the ray and tangent, z is across the ray and almost n. Then P = w · (S −
o) and H = z · (S − o) vanish where the cell meets the ray, at t = T = d · (S − o). The partials of
P at the centre are P_a = w · A and P_b = w · B; let x be the one of a and b with the larger
partial, y the other.

**Theorem 1 (no hit).** Where P = 0, x = x₀ + x₁ y + e with x₀ = −P(0, 0) / P_x, x₁ = −P_y / P_x and
|e| ≤ ε = (½ |P_aa| + |P_ab| + ½ |P_bb| + REST) / |P_x|. So the cell has no hit if |x₀| > 1 + |x₁| +
ε. With this x the model of H becomes

    H = h₀ + h₁ y + h₂ y² ± δ,   h₀ = H(0, 0) + H_x x₀ + ½ H_xx x₀²,
    h₁ = H_x x₁ + H_y + H_xx x₀ x₁ + H_xy x₀,   h₂ = ½ H_xx x₁² + H_xy x₁ + ½ H_yy,
    δ = ε (|H_x| + |H_xx| (|x₀| + |x₁| + ½ ε) + |H_xy|) + REST_z

and the cell has no hit if |h₀| > |h₁| + |h₂| + δ. REST_z = REST_LIFT + |d · n| REST, as z is in the
plane of d and n and across d. ∎

**Theorem 2 (a strip).** Let (T, P) be preconditioned by its partials M at the centre, and its
partials be I + N with |N| ≤ ν ≤ ⅓ (as in `ray_bounds`). Two points of the cell with P = 0 and
y' > y then have d · S' − d · S of one sign, that of m_y, m = M⁻¹ (1, 0): so all hits of the cell
lie between the points at y = −1 and y = 1 of the curve P = 0, if these are in the cell. *Proof.*
(I + N') δ = M⁻¹ (ΔT, 0) gives |δ − m ΔT| ≤ ν / (1 − ν) |m ΔT| ≤ ½ |m_y ΔT|: m is across (P_a, P_b),
so m_y is its larger component. ∎ A point of the cell with |P| ≤ τ instead of 0 moves this by at
most 2 |m'| / |m_y| τ, with m' = M⁻¹ (0, 1); `spread` is 4 times this quotient.

If |x₁| = |m_x / m_y| ≥ ½, x is monotone along the curve, too, and the strip may end at a side x =
±1 instead.

A cell is *thin* for a thickness τ if ν ≤ ⅓ and |h₀| + |h₁| + |h₂| + δ ≤ τ / 2: all of the curve P =
0 in it is then so near to the ray; but not if |h₁| > |h₀| + |h₂| + δ, or |h₁| > 2 (|h₂| + δ): then
H changes its sign, or may change it in the next cell; smaller cells will be settled, or have no
hit.

**Rounding** is covered as in `ray_bounds`.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries import cell_models as columns
from service.engine.queries.cell_models import UNIT
from service.engine.queries.column_vectors import cross, dot
from service.engine.queries.ray_bounds import SAFE

_VECTORS = (
    columns.TANGENT_A,
    columns.TANGENT_B,
    columns.SECOND_AA,
    columns.SECOND_AB,
    columns.SECOND_BB,
)

STEEPEST = 0.25
"""|d · n| at the centre of a cell that a ray grazes, at most."""

STRIP = 1 / 3
"""ν of thin cells, at most."""


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """The strips of N pairs of a ray and a thin cell.

    Attributes
    ----------
    across : ndarray of float64, shape (3, N)
        w.
    is_along_b : ndarray of bool, shape (N,)
        Whether y is b.
    line : ndarray of float64, shape (2, N)
        x₀ and x₁.
    spread : ndarray of float64, shape (N,)
    """

    across: FloatArray
    is_along_b: Bools
    line: FloatArray
    spread: FloatArray

    def take(self, rows: Ints | Bools) -> "Strips":
        """The strips with these rows."""
        return Strips(*(getattr(self, name)[..., rows] for name in Strips.__slots__))


@np.errstate(all="ignore")
def find_grazed_strips(
    model: FloatArray, o: FloatArray, d: FloatArray, slack: FloatArray, thickness: FloatArray
) -> tuple[Bools, Bools, Strips]:
    """Which pairs have no hit, which are thin, and the strips of the thin pairs.

    Parameters
    ----------
    model : ndarray of float64, shape (COLUMNS, N)
    o, d : ndarray of float64, shape (3, N)
    slack, thickness : ndarray of float64, shape (N,)
    """
    m = columns
    normal = model[m.NORMAL : m.NORMAL + 3]
    steep = np.abs(dot(d, normal))
    w = cross(d, normal)
    w = w / np.sqrt(dot(w, w))
    z = cross(d, w)
    g = model[:3] - o
    vectors = [model[k : k + 3] for k in _VECTORS]
    ta, tb, taa, tab, tbb = (dot(d, vector) for vector in vectors)
    pa, pb, paa, pab, pbb = (dot(w, vector) for vector in vectors)
    ha, hb, haa, hab, hbb = (dot(z, vector) for vector in vectors)
    rounding = model[m.ROUND] + slack
    rest = model[m.REST] + rounding
    above = model[m.REST_LIFT] + (steep + 2.0**-40) * model[m.REST] + rounding
    # Theorem 1.
    is_along_b = np.abs(pa) >= np.abs(pb)
    px, py = np.where(is_along_b, pa, pb), np.where(is_along_b, pb, pa)
    hx, hy = np.where(is_along_b, ha, hb), np.where(is_along_b, hb, ha)
    hxx, hyy = np.where(is_along_b, haa, hbb), np.where(is_along_b, hbb, haa)
    x0, x1 = -dot(w, g) / px, -py / px
    error = (0.5 * np.abs(paa) + np.abs(pab) + 0.5 * np.abs(pbb) + rest) / np.abs(px) * SAFE
    reach = np.abs(x0) + np.abs(x1)
    empty = np.abs(x0) > (1 + np.abs(x1) + error) * SAFE
    h0 = dot(z, g) + hx * x0 + 0.5 * hxx * x0 * x0
    h1 = hx * x1 + hy + hxx * x0 * x1 + hab * x0
    h2 = 0.5 * hxx * x1 * x1 + hab * x1 + 0.5 * hyy
    delta = error * (np.abs(hx) + np.abs(hxx) * (reach + 0.5 * error) + np.abs(hab)) + above
    delta += 16 * UNIT * (1 + reach) * (np.abs(hx) + np.abs(hab) + np.abs(hxx) * (1 + reach))
    wide = (np.abs(h1) + np.abs(h2) + delta) * SAFE
    empty |= np.abs(h0) > wide
    is_thin = np.abs(h0) + wide <= thickness / 2
    is_thin &= np.abs(h1) <= np.minimum(np.abs(h0), np.abs(h2) + delta) + np.abs(h2) + delta
    # Theorem 2.
    size = np.abs(ta * pb - tb * pa)
    most = np.zeros(len(size))
    for t, p in ((tb, pb), (ta, pa)):
        terms = np.abs(p * taa - t * paa) + 2 * np.abs(p * tab - t * pab)
        terms += np.abs(p * tbb - t * pbb)
        both = np.abs(p) + np.abs(t)
        most = np.maximum(most, terms * SAFE + both * (3 * model[m.REST] + model[m.ROUND]))
    is_thin &= (most <= STRIP * size) & ~empty & (steep <= STEEPEST)
    rows = np.flatnonzero(is_thin)
    spread = 4 * np.maximum(np.abs(ta[rows]), np.abs(tb[rows])) / np.abs(px[rows])
    strips = Strips(w[:, rows], is_along_b[rows], np.stack([x0[rows], x1[rows]]), spread)
    return empty, is_thin, strips
