"""Limits of normals where du × dv vanishes: poles, cusps, folded corners.

On a line into the domain, du × dv is a polynomial in the distance s. If its lowest term is c sᵏ,
the unit normal tends to c/|c|. This module computes c exactly. It divides the values at some s > 0
by s until the polynomial through them does not vanish at 0; its value at 0 is c.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from oracles.exact import (
    Vector,
    cross,
    hodograph,
    normalize,
    surface_point,
    to_exact_net,
    transpose,
)


def find_limit_normal(
    points: Any, weights: Any, place: tuple[Fraction, Fraction], direction: tuple[int, int]
) -> tuple[float, float, float] | None:
    """The limit of the unit normal at `place` + s `direction`, both (u, v), as s > 0 tends to 0.

    Returns None if du × dv vanishes on this whole line.
    """
    net = to_exact_net(points, weights)
    # On the line the degree of S is at most n; the product of two partials has at most degree 2n.
    # The numerator of a rational partial is itself a product of two polynomials of degree n.
    n = (len(net) - 1) * abs(direction[0]) + (len(net[0]) - 1) * abs(direction[1])
    count = (2 if weights is None else 4) * n + 1
    steps = [Fraction(k, 2 * count) for k in range(1, count + 1)]
    values = [
        _scaled_normal(net, place[0] + s * direction[0], place[1] + s * direction[1]) for s in steps
    ]
    if not any(any(value) for value in values):
        return None
    while True:
        value_at_zero = _extrapolate(steps, values)
        if any(value_at_zero):
            return normalize(value_at_zero)
        values = [tuple(x / s for x in value) for s, value in zip(steps, values, strict=True)]


def _scaled_normal(net: list[list[Vector]], u: Fraction, v: Fraction) -> Vector:
    """A positive multiple of du × dv that is a polynomial in u and v, also for rational nets."""
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
    """The value at 0 of the polynomial through all pairs (step, value), by Lagrange's formula."""
    total: list[Fraction] = [Fraction(0)] * len(values[0])
    for i, (s, value) in enumerate(zip(steps, values, strict=True)):
        factor = Fraction(1)
        for j, other_step in enumerate(steps):
            if j != i:
                factor *= other_step / (other_step - s)
        total = [t + factor * x for t, x in zip(total, value, strict=True)]
    return tuple(total)
