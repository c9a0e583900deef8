"""Limits of normals where du × dv vanishes: poles, cusps, folded corners.

Along a line into the domain du × dv is a polynomial in the distance s. Where it begins with
c sᵏ, the unit normal tends to c/|c|. The coefficient is found exactly: while the polynomial
vanishes at 0 divide by s, each time extrapolating through as many points as it has coefficients.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from tests.oracles.exact import (
    Vector,
    cross,
    hodograph,
    normalize,
    surface_point,
    to_exact_net,
    transpose,
)


def find_limit_normal(
    points: Any, weights: Any, at: tuple[Fraction, Fraction], into: tuple[int, int]
) -> tuple[float, float, float] | None:
    """Unit normal at `at`, reached from the side `into` = (du, dv); None if du × dv ≡ 0 there."""
    net = to_exact_net(points, weights)
    # Along the line S has degree n at most, the product of two partials 2n; numerators of
    # rational partials are themselves products of two.
    n = (len(net) - 1) * abs(into[0]) + (len(net[0]) - 1) * abs(into[1])
    count = (2 if weights is None else 4) * n + 1
    steps = [Fraction(k, 2 * count) for k in range(1, count + 1)]
    values = [_direction(net, at[0] + s * into[0], at[1] + s * into[1]) for s in steps]
    if not any(any(value) for value in values):
        return None
    while True:
        first = _extrapolate(steps, values)
        if any(first):
            return normalize(first)
        values = [tuple(x / s for x in value) for s, value in zip(steps, values, strict=True)]


def _direction(net: list[list[Vector]], u: Fraction, v: Fraction) -> Vector:
    """A positive multiple of du × dv that is a polynomial in u and v, rational surface or not."""
    value = surface_point(net, u, v)
    du = surface_point(hodograph(net), u, v)
    dv = surface_point(transpose(hodograph(transpose(net))), u, v)
    if len(value) == 3:
        return cross(du, dv)
    w = value[3]
    return cross(
        tuple(w * d - du[3] * x for d, x in zip(du[:3], value[:3], strict=True)),
        tuple(w * d - dv[3] * x for d, x in zip(dv[:3], value[:3], strict=True)),
    )


def _extrapolate(steps: Sequence[Fraction], values: Sequence[Vector]) -> Vector:
    """Value at 0 of the polynomial through (s, value): Lagrange's formula."""
    total: list[Fraction] = [Fraction(0)] * len(values[0])
    for i, (s, value) in enumerate(zip(steps, values, strict=True)):
        share = Fraction(1)
        for j, other in enumerate(steps):
            if j != i:
                share *= other / (other - s)
        total = [t + share * x for t, x in zip(total, value, strict=True)]
    return tuple(total)
