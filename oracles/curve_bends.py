"""Derivatives, curvature and torsion of curves in exact arithmetic.

Polynomials are found from points of the curve, without differences of control points. Limits are
found by stepping away from the parameter, not from series.
"""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

import mpmath

from oracles.exact import Vector

STEPS = Fraction(1, 10**60), Fraction(1, 10**90)
"""The steps with which limits are found: two, as an infinite limit differs between them."""


def find_taylor_terms(
    point: Callable[[Fraction], Vector], degree: int, t: Fraction, width: Fraction
) -> list[Vector]:
    """The coefficients about t of the polynomial `point`, which holds over [t, t + width].

    They are the sums of Lagrange's polynomials through degree + 1 points.
    """
    nodes = [width * Fraction(k, degree or 1) for k in range(degree + 1)]
    values = [point(t + node) for node in nodes]
    terms = [[Fraction(0)] * len(values[0]) for _ in nodes]
    for k, value in enumerate(values):
        polynomial = [Fraction(1)]
        for other, node in enumerate(nodes):
            if other != k:
                scale = nodes[k] - node
                shifted = [Fraction(0), *polynomial]
                polynomial = [
                    (high - node * low) / scale
                    for high, low in zip(shifted, [*polynomial, Fraction(0)], strict=True)
                ]
        for power, factor in enumerate(polynomial):
            terms[power] = [x + factor * y for x, y in zip(terms[power], value, strict=True)]
    return [tuple(term) for term in terms]


def find_derivatives(terms: Sequence[Vector], dimension: int, s: Fraction) -> list[Vector]:
    """The first, second and third derivative at the distance s, exactly.

    The terms are those of points, or of homogeneous points (w x, …, w).
    """
    values = []
    for order in range(4):
        sums = [Fraction(0)] * len(terms[0])
        for k in range(order, len(terms)):
            factor = math.perm(k, order) * s ** (k - order)
            sums = [x + factor * y for x, y in zip(sums, terms[k], strict=True)]
        values.append(sums)
    if len(terms[0]) == dimension:
        return [tuple(value) for value in values[1:]]
    results: list[Vector] = []
    for order, value in enumerate(values):
        rest = list(value[:-1])
        for k in range(1, order + 1):
            factor = math.comb(order, k) * values[k][-1]
            rest = [x - factor * y for x, y in zip(rest, results[order - k], strict=True)]
        results.append(tuple(x / values[0][-1] for x in rest))
    return results[1:]


def find_bends(derivatives: Sequence[Vector]) -> tuple[float | None, float | None]:
    """Curvature and torsion from three derivatives; None where a formula divides by zero.

    In the plane the curvature has a sign, and there is no torsion.
    """
    is_planar = len(derivatives[0]) == 2
    first, second, third = ((*vector, Fraction(0))[:3] for vector in derivatives)
    normal = [first[i] * second[j] - first[j] * second[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    speed, size = _dot(first, first), _dot(normal, normal)
    if not speed:
        return None, None
    with mpmath.workdps(200):
        turn = mpmath.sqrt(_to_mpf(size)) * (-1 if is_planar and normal[2] < 0 else 1)
        curvature = float(turn / mpmath.sqrt(_to_mpf(speed)) ** 3)
        if is_planar or not size:
            return curvature, None
        return curvature, float(_to_mpf(_dot(normal, third) / size))


def find_limits(
    terms: Sequence[Vector], dimension: int, side: int = 1
) -> tuple[float | None, float | None]:
    """Limits of curvature and torsion from the right, or with `side` −1 from the left.

    None where there is no finite limit.
    """
    near, nearer = (find_bends(find_derivatives(terms, dimension, side * step)) for step in STEPS)

    def agree(a: float | None, b: float | None) -> float | None:
        if a is None or b is None or abs(a - b) > 1e-12 * max(1.0, abs(a)):
            return None
        return b

    return agree(near[0], nearer[0]), agree(near[1], nearer[1])


def _to_mpf(value: Fraction) -> mpmath.mpf:
    return mpmath.mpf(value.numerator) / value.denominator


def _dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))
