"""B-splines in exact rational arithmetic, by the recursion of Cox and de Boor.

    N_i^0(t) = 1 where U_i ≤ t < U_{i+1}, else 0
    N_i^p(t) = (t − U_i)/(U_{i+p} − U_i) N_i^{p−1}(t)
               + (U_{i+p+1} − t)/(U_{i+p+1} − U_{i+1}) N_{i+1}^{p−1}(t),  0/0 = 0

The NURBS Book, 2nd ed., equation 2.5. At a knot the functions are their limits from the right; at
the end of the domain they are their limits from the left.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache

from oracles.exact import Vector


def find_span(knots: Sequence[Fraction], degree: int, t: Fraction) -> int:
    """The s with U_s ≤ t < U_{s+1}; at the end of the domain, the last span that is not
    empty.
    """
    last = len(knots) - degree - 2
    spans = [s for s in range(degree, last + 1) if knots[s] < knots[s + 1]]
    return max((s for s in spans if knots[s] <= t), default=spans[0])


def basis_values(knots: Sequence[Fraction], degree: int, t: Fraction) -> list[Fraction]:
    """All B-splines of the knot vector at t."""
    return _basis_values(tuple(knots), degree, t)


@lru_cache(maxsize=256)
def _basis_values(knots: tuple[Fraction, ...], degree: int, t: Fraction) -> list[Fraction]:
    span = find_span(knots, degree, t)
    values = [Fraction(int(i == span)) for i in range(len(knots) - 1)]
    for p in range(1, degree + 1):
        values = [
            _multiply(t - knots[i], knots[i + p] - knots[i], values[i])
            + _multiply(knots[i + p + 1] - t, knots[i + p + 1] - knots[i + 1], values[i + 1])
            for i in range(len(values) - 1)
        ]
    return values


def _multiply(a: Fraction, b: Fraction, value: Fraction) -> Fraction:
    """a/b times value, where 0/0 = 0."""
    return a / b * value if b and value else Fraction(0)


def spline_point(
    points: Sequence[Vector], knots: Sequence[Fraction], degree: int, t: Fraction
) -> Vector:
    """Σ N_i(t) P_i."""
    pairs = zip(basis_values(knots, degree, t), points, strict=True)
    terms = [(n, p) for n, p in pairs if n]
    return tuple(
        sum((n * p[axis] for n, p in terms), Fraction(0)) for axis in range(len(points[0]))
    )


def spline_surface_point(
    net: Sequence[Sequence[Vector]],
    knots: tuple[Sequence[Fraction], Sequence[Fraction]],
    degree: tuple[int, int],
    place: tuple[Fraction, Fraction],
) -> Vector:
    """Σ N_i(u) N_j(v) P_ij, projected if there are four coordinates."""
    lines = [spline_point(row, knots[1], degree[1], place[1]) for row in net]
    point = spline_point(lines, knots[0], degree[0], place[0])
    if len(point) == 3:
        return point
    return tuple(x / point[3] for x in point[:3])


def to_fractions(values: object) -> list[Fraction]:
    """Floats as exact rational numbers."""
    return [Fraction(float(value)) for value in values]  # type: ignore[attr-defined]
