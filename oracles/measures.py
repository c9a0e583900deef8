"""Areas and volumes of surfaces and lengths of curves, extrapolated; and closed forms.

A surface is given as sheets (`oracles.sheets`), which are evaluated by their own definition.
A sheet is sampled at n × n places between neighbouring knots, for n = n₀, 2 n₀, 4 n₀, …. The area
and the volume of the inscribed polyhedron, and the length of an inscribed polygon, differ from the
truth by a series in 1/n². Romberg's scheme removes one power of 1/n² after the other. The code
shares no normals, no quadrature and no bounds with the engine.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from math import comb

import mpmath
import numpy as np

from oracles.exact import Net
from oracles.sheets import Array, Sheet, TensorSheet


def romberg(
    measure_inscribed: Callable[[int], float], first: int, levels: int
) -> tuple[float, float]:
    """The limit of a function of n whose error is a series in 1/n², and an estimate of its error.

    The function is called with `first`, 2 `first`, 4 `first`, …, `levels` values in all.
    """
    rows: list[list[float]] = []
    for level in range(levels):
        row = [measure_inscribed(first * 2**level)]
        for k, coarser in enumerate(rows[-1] if rows else [], start=1):
            row.append(row[-1] + (row[-1] - coarser) / (4**k - 1))
        rows.append(row)
    return rows[-1][-1], abs(rows[-1][-1] - rows[-2][-1]) + 1e-14 * abs(rows[-1][-1])


def measure_area(sheets: Sequence[Sheet], first: int = 4, levels: int = 6) -> tuple[float, float]:
    """The area of all sheets together, and an estimate of its error."""

    def measure_inscribed(n: int) -> float:
        return sum(float(_norms(_crosses(*_triangles(s, n))).sum()) / 2 for s in sheets)

    return romberg(measure_inscribed, first, levels)


def measure_flux(sheets: Sequence[Sheet], first: int = 4, levels: int = 6) -> tuple[float, float]:
    """Σ ∫∫ S · (S_u × S_v) over all sheets, and an estimate of its error.

    For sheets that enclose a volume, this is three times the volume.
    """

    def measure_inscribed(n: int) -> float:
        total = 0.0
        for sheet in sheets:
            a, b, c = _triangles(sheet, n)
            total += float((a * _crosses(a, b, c)).sum()) / 2
        return total

    return romberg(measure_inscribed, first, levels)


def measure_length(points: Callable[[Array], Array], first: int = 4) -> tuple[float, float]:
    """The length of a curve over [0, 1], and an estimate of its error."""

    def measure_inscribed(n: int) -> float:
        return float(_norms(np.diff(points(np.linspace(0, 1, n + 1)), axis=0)).sum())

    return romberg(measure_inscribed, first, 7)


def _triangles(sheet: Sheet, n: int) -> tuple[Array, Array, Array]:
    """First, second and third corners (T, 3) of the triangles of a grid.

    The grid has n × n cells between neighbouring knots. Each cell is divided into two triangles by
    one diagonal, and again by the other; so the triangles cover the surface twice.
    """
    if isinstance(sheet, TensorSheet):
        u, v = (_divide(breaks, n) for breaks in sheet.breaks)
    else:
        u = v = np.linspace(0, 1, n + 1)
    s, t = (axis.ravel() for axis in np.meshgrid(u, v, indexing="ij"))
    places = np.stack([s, t], axis=1)
    if not isinstance(sheet, TensorSheet):
        places = np.stack([s * (1 - t), t], axis=1)  # maps the square to the triangle
    grid = (sheet.at(places) + sheet.origin).reshape(len(u), len(v), 3)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    # With both diagonals the odd powers of 1/n cancel.
    corners = [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
    x, y, z = (
        np.concatenate([triangle[k].reshape(-1, 3) for triangle in corners]) for k in range(3)
    )
    return x, y, z


def _divide(breaks: Array, n: int) -> Array:
    """Parameters that divide every span into n equal parts."""
    steps = np.arange(n) / n
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])


def _crosses(a: Array, b: Array, c: Array) -> Array:
    """Half of (b − a) × (c − a), because the triangles cover the surface twice."""
    return np.asarray(np.cross(b - a, c - a) / 2)


def _norms(vectors: Array) -> Array:
    """Lengths (m,) of vectors (m, 3)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=1)))


def exact_flux(nets: Sequence[Net]) -> Fraction:
    """Σ ∫∫ S · (S_u × S_v) of polynomial nets, exactly.

    The integral of a net is the sum over all indices k, m, i, n, r and s of
    det(P_rs, p (P_{k+1,m} − P_km), q (P_{i,n+1} − P_in)) times ∫∫ of the product of the three
    basis functions.
    """
    return sum((_exact_flux(net) for net in nets), Fraction(0))


def _exact_flux(net: Net) -> Fraction:
    """∫∫ S · (S_u × S_v) of one net."""
    p, q = len(net) - 1, len(net[0]) - 1
    total = Fraction(0)
    u_steps = [
        (k, m, tuple(p * (b - a) for a, b in zip(net[k][m], net[k + 1][m], strict=True)))
        for k, m in product(range(p), range(q + 1))
    ]
    v_steps = [
        (i, n, tuple(q * (b - a) for a, b in zip(net[i][n], net[i][n + 1], strict=True)))
        for i, n in product(range(p + 1), range(q))
    ]
    for (k, m, a), (i, n, b) in product(u_steps, v_steps):
        normal = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        for r, s in product(range(p + 1), range(q + 1)):
            dot = sum((x * y for x, y in zip(net[r][s], normal, strict=True)), Fraction(0))
            u_integral = _integrate_product((p - 1, k), (p, i), (p, r))
            v_integral = _integrate_product((q, m), (q - 1, n), (q, s))
            total += dot * u_integral * v_integral
    return total


def _integrate_product(*factors: tuple[int, int]) -> Fraction:
    """The integral over [0, 1] of a product of Bernstein polynomials B_i^n, given as (n, i)."""
    n, i = sum(degree for degree, _ in factors), sum(number for _, number in factors)
    numerator = Fraction(1)
    for degree, number in factors:
        numerator *= comb(degree, number)
    return numerator / (comb(n, i) * (n + 1))


def ellipsoid_area(a: float, b: float, c: float) -> mpmath.mpf:
    """The area of an ellipsoid, a > b > c, by Legendre's elliptic integrals with 50 digits."""
    with mpmath.workdps(50):
        x, y, z = map(mpmath.mpf, (a, b, c))
        phi = mpmath.acos(z / x)
        m = x**2 * (y**2 - z**2) / (y**2 * (x**2 - z**2))
        sine = mpmath.sin(phi)
        integrals = mpmath.ellipe(phi, m) * sine**2 + mpmath.ellipf(phi, m) * mpmath.cos(phi) ** 2
        return 2 * mpmath.pi * (z**2 + x * y / sine * integrals)
