"""Areas, volumes and lengths of inscribed polyhedra and polygons, extrapolated; and closed forms.

A surface is sampled at n × n places between its knots, for n = n₀, 2 n₀, 4 n₀, …, by its own
definition (`tests.oracles.sheets`). The area, the volume and the length of inscribed polyhedra and
polygons differ from the truth by a series in 1/n², of which Romberg's scheme removes one power
after the other. The engine is not used: no normals, no quadrature, no bounds.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from math import comb

import mpmath
import numpy as np

from tests.oracles.exact import Net
from tests.oracles.sheets import Array, Sheet, TensorSheet


def romberg(inscribed: Callable[[int], float], first: int, levels: int) -> tuple[float, float]:
    """The limit of a function whose error is a series in 1/n², and an estimate of the error."""
    rows: list[list[float]] = []
    for level in range(levels):
        row = [inscribed(first * 2**level)]
        for k, before in enumerate(rows[-1] if rows else [], start=1):
            row.append(row[-1] + (row[-1] - before) / (4**k - 1))
        rows.append(row)
    return rows[-1][-1], abs(rows[-1][-1] - rows[-2][-1]) + 1e-14 * abs(rows[-1][-1])


def measure_area(sheets: Sequence[Sheet], first: int = 4, levels: int = 6) -> tuple[float, float]:
    """The area of all sheets together, and an estimate of its error."""

    def inscribed(n: int) -> float:
        return sum(float(_norms(_crosses(*_triangles(s, n))).sum()) / 2 for s in sheets)

    return romberg(inscribed, first, levels)


def measure_flux(sheets: Sequence[Sheet], first: int = 4, levels: int = 6) -> tuple[float, float]:
    """Σ ∫∫ S · N of all sheets, three times the enclosed volume, and an estimate of its error."""

    def inscribed(n: int) -> float:
        total = 0.0
        for sheet in sheets:
            a, b, c = _triangles(sheet, n)
            total += float((a * _crosses(a, b, c)).sum()) / 2
        return total

    return romberg(inscribed, first, levels)


def measure_length(points: Callable[[Array], Array], first: int = 4) -> tuple[float, float]:
    """The length of a curve over [0, 1], and an estimate of its error."""

    def inscribed(n: int) -> float:
        return float(_norms(np.diff(points(np.linspace(0, 1, n + 1)), axis=0)).sum())

    return romberg(inscribed, first, 7)


def _triangles(sheet: Sheet, n: int) -> tuple[Array, Array, Array]:
    """Corners (T, 3) of the triangles of a grid: n × n cells between neighbouring knots."""
    if isinstance(sheet, TensorSheet):
        u, v = (_divide(breaks, n) for breaks in sheet.breaks)
    else:
        u = v = np.linspace(0, 1, n + 1)
    s, t = (axis.ravel() for axis in np.meshgrid(u, v, indexing="ij"))
    places = np.stack([s, t], axis=1)
    if not isinstance(sheet, TensorSheet):
        places = np.stack([s * (1 - t), t], axis=1)  # the square mapped to the triangle
    grid = (sheet.at(places) + sheet.origin).reshape(len(u), len(v), 3)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    # Both diagonals, each for one half of the area: odd powers of 1/n cancel.
    corners = [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
    x, y, z = (np.concatenate([three[k].reshape(-1, 3) for three in corners]) for k in range(3))
    return x, y, z


def _divide(breaks: Array, n: int) -> Array:
    steps = np.arange(n) / n
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])


def _crosses(a: Array, b: Array, c: Array) -> Array:
    """Half the normals of triangles: each cell occurs twice, with either diagonal."""
    return np.asarray(np.cross(b - a, c - a) / 2)


def _norms(vectors: Array) -> Array:
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=1)))


def exact_flux(nets: Sequence[Net]) -> Fraction:
    """Σ ∫∫ S · (S_u × S_v) of polynomial nets, without any rounding.

    ∫∫ det(S, S_u, S_v) = Σ det(P_ij, p (P_k+1,l − P_kl), q (P_m,n+1 − P_mn)) ∫∫ B B B
    """
    return sum((_exact_flux(net) for net in nets), Fraction(0))


def _exact_flux(net: Net) -> Fraction:
    p, q = len(net) - 1, len(net[0]) - 1
    total = Fraction(0)
    u_steps = [
        (k, n, tuple(p * (b - a) for a, b in zip(net[k][n], net[k + 1][n], strict=True)))
        for k, n in product(range(p), range(q + 1))
    ]
    v_steps = [
        (k, n, tuple(q * (b - a) for a, b in zip(net[k][n], net[k][n + 1], strict=True)))
        for k, n in product(range(p + 1), range(q))
    ]
    for (k, m, a), (i, n, b) in product(u_steps, v_steps):
        normal = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        for r, s in product(range(p + 1), range(q + 1)):
            dot = sum((x * y for x, y in zip(net[r][s], normal, strict=True)), Fraction(0))
            total += dot * _share((p - 1, k), (p, i), (p, r)) * _share((q, m), (q - 1, n), (q, s))
    return total


def _share(*of: tuple[int, int]) -> Fraction:
    """∫ of a product of Bernstein polynomials B_i^n, each given as (n, i)."""
    n, i = sum(degree for degree, _ in of), sum(number for _, number in of)
    top = Fraction(1)
    for degree, number in of:
        top *= comb(degree, number)
    return top / (comb(n, i) * (n + 1))


def ellipsoid_area(a: float, b: float, c: float) -> mpmath.mpf:
    """The area of an ellipsoid, a > b > c, by Legendre's elliptic integrals with 50 digits."""
    with mpmath.workdps(50):
        x, y, z = map(mpmath.mpf, (a, b, c))
        phi = mpmath.acos(z / x)
        m = x**2 * (y**2 - z**2) / (y**2 * (x**2 - z**2))
        sine = mpmath.sin(phi)
        both = mpmath.ellipe(phi, m) * sine**2 + mpmath.ellipf(phi, m) * mpmath.cos(phi) ** 2
        return 2 * mpmath.pi * (z**2 + x * y / sine * both)
