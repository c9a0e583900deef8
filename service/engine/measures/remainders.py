"""Bounds of the errors of Gauss–Legendre rules over cells, by ellipses in the complex plane.

**One parameter.** A function f that is analytic within the ellipse E_ρ about [−1, 1] and at most M
there in absolute value has Chebyshev coefficients |a_k| ≤ 2 M ρ^−k. The rule of m ≥ 2 nodes is
exact for T_k if k < 2 m or k is odd. For other k ≥ 4 the rule gives at most 2 in absolute value, as
its weights are positive and add up to 2, and |∫ T_k| = 2 / (k² − 1) ≤ 2/15. Over [0, 1], which is
half as long, the error is therefore

    ε ≤ ½ Σ_{k = 2m, 2m+2, …} 2 M ρ^−k (2 + 2/15) = (32/15) M ρ^−2m / (1 − ρ^−2)

As the rule is exact for constants, M may be a bound of |f − f₀| for any constant f₀.

**Two parameters.** With the integrals I_u, I_v and the rules Q_u, Q_v in one parameter,

    I_u I_v − Q_u Q_v = (I_u − Q_u) I_v + Q_u (I_v − Q_v).

I_v and Q_u are means over [0, 1]. So the error of the rule of m × m nodes is at most the sum of two
such errors: of f with u complex and v in [0, 1], and of f with v complex and u in [0, 1].

**Bounds of f.** With u complex a net is Σ_k c_k(v) T_k(2u − 1). Each c_k is a Bézier net in v, and
at most as long as the longest of its control vectors, C_k. So the net is within

    δ(ρ) = Σ_{k ≥ 1} C_k (ρ^k + ρ^−k)/2 + max |c_0 − a|

of its mean control vector a. Let c be the middle of the cell and X = w (S − c), as in `cells`.
From the nets of X, w and their partials follow constants A, B and bounds s, α, β:

    |S − c| ≤ s,   |S_u − A| ≤ α,   |S_v − B| ≤ β,

with s = (|a_X| + δ_X) / (a_w − δ_w), A = a_Xu / a_w and

    α = (δ_Xu + s (|a_wu| + δ_wu) + |A| δ_w) / (a_w − δ_w)

if δ_w < a_w; B and β likewise. Then N = S_u × S_v is within D = |A| β + α |B| + α β of A × B; the
lengths of complex vectors are Hermitian.

- Area, f = √(N · N). With N₀ = A × B and e = 2 |N₀| D + D² < |N₀|², N · N stays within e of |N₀|²,
  where the root is analytic, and |f − |N₀|| ≤ e / |N₀|.
- Flux, f = (S − o) · N about an origin o, and its moment (S − o) f. With t = |c − o|,
  |f − f₀| ≤ (t + s) (|N₀| + D) − t |N₀|, and of the moment (t + s)² (|N₀| + D) − t² |N₀|.
- Length of a curve: as area, with A for N₀ and α for D.

If no ellipse gives a small bound, other bounds are used: the integral and the result of its rule
are both means of values of f over the cell, which is within the smallest ellipse. So they differ by
at most twice the bound of |f − f₀| there; for areas and lengths this is 2 D, as | |N| − |N₀| | ≤ D.
They also differ by at most twice the largest |f|, and for areas and lengths, where f ≥ 0, by at
most the largest f. That is at most |N₀| + D, and at most the product of the upper bounds of |S_u|
and |S_v| over the cell (`CellNets.stretches`).

**Chebyshev coefficients.** B_i^n(t) = Σ_k c_ik T_k(2t − 1). Since |c_ik| ≤ 2/π ∫ B_i / √(1 − x²),
and the B_i add up to 1, Σ_i |c_ik| ≤ 2 for every k. In floating point the error of an angle is at
most 2 π n u, the relative error of B_i at that angle at most 6 n u, and the relative error of a sum
of n + 1 products at most (n + 2) u: for every k the errors of all c_ik add up to at most 30 (n + 1)
u.

**Ellipses.** On the ellipse E_ρ in the complex plane, with foci −1 and 1 and half axes that add up
to ρ, |T_k| ≤ (ρ^k + ρ^−k)/2.

References
----------
Trefethen, Approximation Theory and Approximation Practice (2013), chapter 3, and theorems 8.1 and
19.3.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.bases.bernstein import bernstein
from service.bases.cache import PLANS
from service.engine.measures.cells import UPWARDS, CellNets, Net, along, lengths
from service.engine.measures.quadrature import Integrand
from service.engine.vectors import cross

RADII = np.array([1.1, 1.2, 1.35, 1.5, 1.7, 2, 2.4, 2.8, 3.4, 4, 5, 6, 7, 8, 10, 13, 18, 25, 40])
"""The ρ of the ellipses. Each gives a bound of the remainder of a rule; the least bound counts."""


@np.errstate(all="ignore")
def bound_remainders(nets: CellNets, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
    """Bound the errors of rules of `count` nodes in each direction; the origin o is 0.

    Returns
    -------
    errors : ndarray of float64, shape (1, K), or (2, K) for a flux and its moments
    along_v : ndarray of bool, shape (K,)
        Whether halving a cell along v reduces its remainder more than halving along u.
    """
    stretches, cell_count = nets.stretches, nets.center.shape[1]
    if integrand == "flux" and nets.w is None:
        raise ValueError("the flux of a polynomial has no remainder")
    # For each ellipse, the remainder divided by M.
    factors = (32 / 15 * UPWARDS * RADII ** (-2.0 * count) / (1 - RADII**-2.0))[:, np.newaxis]
    errors: FloatArray = np.zeros((1 if integrand == "size" else 2, cell_count))
    ripples = np.zeros((2, cell_count))
    # The bounds that need no ellipse.
    limits: FloatArray = np.prod(stretches, axis=0)[np.newaxis] * UPWARDS
    if integrand == "flux":
        max_distance = lengths(nets.center) + nets.radius
        limits = 2 * UPWARDS * limits * np.stack([max_distance, max_distance * max_distance])
    # The errors with u complex and with v complex add up. For surfaces `length_of_normal` and
    # `deviation` become |N₀| and D, for curves they are |A| and α.
    for axis in range(len(stretches)):
        (u_partial, *v_partials), radius = _bound_spreads(nets, axis)
        length_of_normal, deviation = lengths(u_partial.value), u_partial.deviation
        ripples[axis] = u_partial.ripple
        if v_partials:
            a, b = length_of_normal, lengths(v_partials[0].value)
            ripples[axis] = a * v_partials[0].ripple + b * u_partial.ripple
            length_of_normal = lengths(cross(u_partial.value, v_partials[0].value))
            beta = v_partials[0].deviation
            deviation = a * beta + b * deviation + deviation * beta
        if integrand == "size":
            e = (2 * length_of_normal + deviation) * deviation * UPWARDS
            bounds = [
                np.where(e < length_of_normal * length_of_normal, e / length_of_normal, np.inf)
            ]
            limits_on_smallest_ellipse = [
                np.minimum(length_of_normal + deviation[0], 2 * deviation[0])
            ]
        else:
            t = lengths(nets.center)
            max_normal, max_distance = length_of_normal + deviation, t + radius
            bounds = [
                max_distance * max_normal - t * length_of_normal,
                max_distance * max_distance * max_normal - t * t * length_of_normal,
            ]
            limits_on_smallest_ellipse = [2 * bound[0] for bound in bounds]
        for row, bound in enumerate(bounds):
            scaled_bound = bound * factors * UPWARDS
            errors[row] += np.where(np.isfinite(scaled_bound), scaled_bound, np.inf).min(axis=0)
        limits = np.fmin(limits, np.stack(limits_on_smallest_ellipse) * UPWARDS)
    return np.minimum(errors, limits), ripples[1] > ripples[0]


@dataclass(frozen=True, eq=False, slots=True)
class _Spread:
    """Bounds of a function on the R ellipses.

    Attributes
    ----------
    value : ndarray of float64, shape (d, K)
        A constant.
    deviation : ndarray of float64, shape (R, K)
        Bounds of the distance of the function from `value` on each ellipse.
    ripple : ndarray of float64, shape (K,)
        Approximately, how much the function changes with the complex parameter: it only decides in
        which direction a cell is halved.
    """

    value: FloatArray
    deviation: FloatArray
    ripple: FloatArray


def _bound_spreads(nets: CellNets, axis: int) -> tuple[list[_Spread], FloatArray]:
    """The spreads of S_u and, for surfaces, S_v; and s, a bound of |S − c| on each ellipse (R, K).

    The parameter of an axis is complex.
    """
    x = _spread(nets.x, axis)
    x_partials = [_spread(net, axis) for net in nets.x_partials]
    if nets.w is None:
        return x_partials, lengths(x.value) + x.deviation
    w = _spread(nets.w, axis)
    min_weight = w.value[0] - w.deviation * UPWARDS
    min_weight = np.where(min_weight > 0, min_weight, np.nan)
    radius = (lengths(x.value) + x.deviation) / min_weight
    partials = []
    for x_partial, net in zip(x_partials, nets.w_partials, strict=True):
        w_partial = _spread(net, axis)
        value = x_partial.value / w.value[0]
        max_w_partial = np.abs(w_partial.value[0]) + w_partial.deviation
        deviation = x_partial.deviation + radius * max_w_partial + lengths(value) * w.deviation
        ripple = x_partial.ripple + nets.radius * w_partial.ripple + lengths(value) * w.ripple
        partials.append(_Spread(value, deviation / min_weight, ripple / w.value[0]))
    return partials, radius


def _spread(net: Net, axis: int) -> _Spread:
    """The bounds of a net if one parameter is complex."""
    degree = net.values.shape[1 + axis] - 1
    mean = net.values.mean(axis=(1, 2))
    coefficients = along(chebyshev(degree), net.values, axis)
    constant = coefficients.take([0], axis=1 + axis) - mean[:, np.newaxis, np.newaxis]
    # 4 times the error of the net includes the errors of the control points, which `chebyshev` at
    # most doubles, and the rounding of the product.
    constant_deviation = lengths(constant).max(axis=(0, 1)) + 4 * net.error
    if not degree:
        return _Spread(
            mean,
            np.broadcast_to(constant_deviation, (len(RADII), len(constant_deviation))),
            0 * constant_deviation,
        )
    max_coefficients = lengths(coefficients).max(axis=1 - axis)[1:] + 4 * net.error
    deviation = ellipse_bounds(degree) @ max_coefficients + constant_deviation
    return _Spread(mean, deviation * UPWARDS, max_coefficients.sum(axis=0))


def chebyshev(degree: int) -> FloatArray:
    """The matrix that converts a Bézier net of degree n to Chebyshev coefficients, (n+1, n+1).

        c_k = (2 − [k = 0]) / N Σ_j f(cos φ_j) cos(k φ_j),  φ_j = (j + ½) π / N,  N = n + 1

    The sum is exact: the Chebyshev polynomials are orthogonal on these points.
    """

    def build() -> FloatArray:
        count = degree + 1
        angle = (np.arange(count) + 0.5) * (pi / count)
        values = bernstein(degree, (1 + np.cos(angle)) / 2)
        matrix: FloatArray = np.cos(np.arange(count)[:, np.newaxis] * angle) @ values * (2 / count)
        matrix[0] /= 2
        return matrix

    return PLANS.array(("Chebyshev", degree), build)


def ellipse_bounds(degree: int) -> FloatArray:
    """Upper bounds of |T_k| on the ellipses for k = 1 … degree: shape (len(RADII), degree)."""

    def build() -> FloatArray:
        with np.errstate(over="ignore"):  # a bound may be infinite
            powers = RADII[:, np.newaxis] ** np.arange(1.0, degree + 1)
            # The last factor is larger than the rounding of the others.
            return np.asarray((powers + 1 / powers) / 2 * (1 + 2.0**-40))

    return PLANS.array(("ellipses", degree), build)
