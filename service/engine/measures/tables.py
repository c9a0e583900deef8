"""Gauss–Legendre rules, Bernstein bases at their nodes, and Chebyshev coefficients of the bases.

All arrays are cached and read-only. u = 2⁻⁵³ is the unit roundoff.

**Nodes and weights.** Newton's method in 40 decimal digits finds the roots x of the Legendre
polynomial P_m; the node (1 − x)/2 and the weight 1 / ((1 − x²) P_m′(x)²) over [0, 1] are then
rounded once: their relative errors are at most u. Nodes above ½ are the mirror images of those
below, and so are the values of a basis there, so that a node near 1 loses no digits.

**Basis.** A value of degree n at a node t ≤ ½ comes from n steps. Each adds two products of
non-negative numbers: one with t and one with 1 − t, which have relative errors of at most 2 u. So
the relative error of the value is at most 6 n u.

**Chebyshev coefficients.** B_i^n(t) = Σ_k c_ik T_k(2t − 1). Since |c_ik| ≤ 2/π ∫ B_i / √(1 − x²),
and the B_i add up to 1, Σ_i |c_ik| ≤ 2 for every k. In floating point the error of an angle is at
most 2 π n u, the relative error of B_i at that angle at most 6 n u, and the relative error of a sum
of n + 1 products at most (n + 2) u: for every k the errors of all c_ik add up to at most 30 (n + 1)
u.

**Ellipses.** On the ellipse E_ρ in the complex plane, with foci −1 and 1 and half axes that add up
to ρ, |T_k| ≤ (ρ^k + ρ^−k)/2.

References
----------
Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3, 8 and 19.
"""

from decimal import Decimal, localcontext
from math import cos, pi

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein, binomials
from service.bases.cache import PLANS

RADII = np.array([1.1, 1.2, 1.35, 1.5, 1.7, 2, 2.4, 2.8, 3.4, 4, 5, 6, 7, 8, 10, 13, 18, 25, 40])
"""The ρ of the ellipses. Each gives a bound of the remainder of a rule; the least bound counts."""


def gauss(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes in [0, ½] and weights of the rule of `count` nodes over [0, 1]: ⌈count / 2⌉ each."""
    table = PLANS.array(("Gauss-Legendre", count), lambda: np.array(_rule(count)).T)
    return table[0], table[1]


def _rule(count: int) -> list[tuple[float, float]]:
    """Compute pairs (node, weight) for the nodes in [0, ½], in decimal arithmetic."""
    rule = []
    with localcontext() as context:
        context.prec = 40
        for k in range((count + 1) // 2):
            x = Decimal(cos(pi * (k + 0.75) / (count + 0.5)))
            # Each step of Newton's method doubles the number of correct digits.
            for _ in range(6):
                value, slope = _legendre(count, x)
                x -= value / slope
            _, slope = _legendre(count, x)
            rule.append((float((1 - x) / 2), float(1 / ((1 - x * x) * slope * slope))))
    return rule


def _legendre(count: int, x: Decimal) -> tuple[Decimal, Decimal]:
    """P_m(x) and P_m′(x) for m = `count`, by the recurrence of three terms."""
    previous_value, value = Decimal(1), x
    for k in range(2, count + 1):
        previous_value, value = value, ((2 * k - 1) * x * value - (k - 1) * previous_value) / k
    return value, count * (previous_value - x * value) / (1 - x * x)


def weights_at_nodes(count: int) -> FloatArray:
    """The weights of all nodes, (count,)."""
    _, weights = gauss(count)
    return np.concatenate([weights, weights[: count // 2][::-1]])


def basis_at_nodes(degree: int, count: int) -> FloatArray:
    """Bernstein basis at the nodes of a rule, (count, degree + 1)."""

    def build() -> FloatArray:
        nodes, _ = gauss(count)
        lower = bernstein(degree, nodes)
        return np.concatenate([lower, lower[: count // 2][::-1, ::-1]])

    return PLANS.array(("basis at nodes", degree, count), build)


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


def halves(degree: int) -> FloatArray:
    """The matrix (2 (n+1), n+1) that halves a net: it gives the nets over [0, ½] and over [½, 1].

    Row j of the first half has the factors C(j, k) / 2^j of the control points k; the second half
    is its mirror image.
    """

    def build() -> FloatArray:
        lower = np.zeros((degree + 1, degree + 1))
        for j in range(degree + 1):
            lower[j, : j + 1] = np.ldexp(binomials(j), -j)
        return np.concatenate([lower, lower[::-1, ::-1]])

    return PLANS.array(("halves", degree), build)
