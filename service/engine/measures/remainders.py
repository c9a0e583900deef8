"""Bounds of the errors of Gauss–Legendre rules over cells, by ellipses in the complex plane.

If f is analytic within the ellipse E_ρ about the interval, and |f − f₀| ≤ M there, the rule of m
nodes has an error of at most (32/15) M ρ^−2m / (1 − ρ^−2); in two parameters the error is the sum
of two of these. M follows from the Chebyshev coefficients of the nets of X = w (S − c), w and their
partials (`cells`). With one parameter complex, for the constants A, B and N₀ = A × B of a cell,

    |S − c| ≤ s,   |S_u − A| ≤ α,   |S_v − B| ≤ β,   |S_u × S_v − N₀| ≤ D = |A| β + α |B| + α β

If no ellipse gives a small bound, the largest |f| over the cell does.

Proofs in docs/proofs.md: "Errors of Gauss–Legendre quadrature", "Integrands over an ellipse" and
"Nodes, weights and bases".

References
----------
Trefethen, Approximation Theory and Approximation Practice (2013), chapter 3, and theorems 8.1 and
19.3.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.bases.bernstein import bernstein
from service.bases.cache import BASES
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
    # The errors with u complex and with v complex add up.
    for axis in range(len(stretches)):
        changes = bound_changes(nets, integrand, partial(_spread, axis=axis))
        ripples[axis] = changes.ripple
        for row, bound in enumerate(changes.bounds):
            scaled_bound = bound * factors * UPWARDS
            errors[row] += np.where(np.isfinite(scaled_bound), scaled_bound, np.inf).min(axis=0)
        limits = np.fmin(limits, np.stack(changes.limits) * UPWARDS)
    return np.minimum(errors, limits), ripples[1] > ripples[0]


@dataclass(frozen=True, eq=False, slots=True)
class Spread:
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


@dataclass(frozen=True, eq=False, slots=True)
class Changes:
    """How far integrands are from constants on the R ellipses; a flux is followed by its moment.

    Attributes
    ----------
    constants : list of ndarray of float64, shape (K,)
        The lengths of the constants f₀.
    bounds : list of ndarray of float64, shape (R, K)
        The bounds M of |f − f₀|.
    limits : list of ndarray of float64, shape (K,)
        Bounds of the error of every rule whose weights are positive.
    ripple : ndarray of float64, shape (K,)
        As in `Spread`.
    """

    constants: list[FloatArray]
    bounds: list[FloatArray]
    limits: list[FloatArray]
    ripple: FloatArray


def bound_changes(nets: CellNets, integrand: Integrand, spread: Callable[[Net], Spread]) -> Changes:
    """How far the integrand is from a constant where `spread` gives the spreads of nets.

    For surfaces `length_of_normal` and `deviation` are |N₀| and D, for curves they are |A| and α.
    """
    (u_partial, *v_partials), radius = bound_spreads(nets, spread)
    length_of_normal, deviation = lengths(u_partial.value), u_partial.deviation
    ripple = u_partial.ripple
    if v_partials:
        a, b = length_of_normal, lengths(v_partials[0].value)
        ripple = a * v_partials[0].ripple + b * u_partial.ripple
        length_of_normal = lengths(cross(u_partial.value, v_partials[0].value))
        beta = v_partials[0].deviation
        deviation = a * beta + b * deviation + deviation * beta
    if integrand == "size":
        e = (2 * length_of_normal + deviation) * deviation * UPWARDS
        bound = np.where(e < length_of_normal * length_of_normal, e / length_of_normal, np.inf)
        limit = np.minimum(length_of_normal + deviation[0], 2 * deviation[0])
        return Changes([length_of_normal], [bound], [limit], ripple)
    t = lengths(nets.center)
    max_normal, max_distance = length_of_normal + deviation, t + radius
    constants = [t * length_of_normal, t * t * length_of_normal]
    bounds = [
        max_distance * max_normal - t * length_of_normal,
        max_distance * max_distance * max_normal - t * t * length_of_normal,
    ]
    return Changes(constants, bounds, [2 * bound[0] for bound in bounds], ripple)


def bound_spreads(
    nets: CellNets, spread: Callable[[Net], Spread]
) -> tuple[list[Spread], FloatArray]:
    """The spreads of S_u and, for surfaces, S_v; and s, a bound of |S − c| on ellipses, (R, K)."""
    x = spread(nets.x)
    x_partials = [spread(net) for net in nets.x_partials]
    if nets.w is None:
        return x_partials, lengths(x.value) + x.deviation
    w = spread(nets.w)
    min_weight = w.value[0] - w.deviation * UPWARDS
    min_weight = np.where(min_weight > 0, min_weight, np.nan)
    radius = (lengths(x.value) + x.deviation) / min_weight
    partials = []
    for x_partial, net in zip(x_partials, nets.w_partials, strict=True):
        w_partial = spread(net)
        value = x_partial.value / w.value[0]
        max_w_partial = np.abs(w_partial.value[0]) + w_partial.deviation
        deviation = x_partial.deviation + radius * max_w_partial + lengths(value) * w.deviation
        ripple = x_partial.ripple + nets.radius * w_partial.ripple + lengths(value) * w.ripple
        partials.append(Spread(value, deviation / min_weight, ripple / w.value[0]))
    return partials, radius


def _spread(net: Net, axis: int) -> Spread:
    """The bounds of a net if one parameter is complex."""
    degree = net.values.shape[1 + axis] - 1
    mean = net.values.mean(axis=(1, 2))
    coefficients = along(chebyshev(degree), net.values, axis)
    constant = coefficients.take([0], axis=1 + axis) - mean[:, np.newaxis, np.newaxis]
    # 4 times the error of the net includes the errors of the control points, which `chebyshev` at
    # most doubles, and the rounding of the product.
    constant_deviation = lengths(constant).max(axis=(0, 1)) + 4 * net.error
    if not degree:
        return Spread(
            mean,
            np.broadcast_to(constant_deviation, (len(RADII), len(constant_deviation))),
            0 * constant_deviation,
        )
    max_coefficients = lengths(coefficients).max(axis=1 - axis)[1:] + 4 * net.error
    deviation = ellipse_bounds(degree) @ max_coefficients + constant_deviation
    return Spread(mean, deviation * UPWARDS, max_coefficients.sum(axis=0))


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

    return BASES.array(("Chebyshev", degree), build)


def ellipse_bounds(degree: int) -> FloatArray:
    """Upper bounds of |T_k| on the ellipses for k = 1 … degree: shape (len(RADII), degree)."""

    def build() -> FloatArray:
        with np.errstate(over="ignore"):  # a bound may be infinite
            powers = RADII[:, np.newaxis] ** np.arange(1.0, degree + 1)
            # The last factor is larger than the rounding of the others.
            return np.asarray((powers + 1 / powers) / 2 * (1 + 2.0**-40))

    return BASES.array(("ellipses", degree), build)
