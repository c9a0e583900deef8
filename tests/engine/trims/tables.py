"""Random tables of splines, and their points in rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import strategies as st

from oracles import splines
from service.bases.arrays import FloatArray
from service.surface.spline_tables import CurveTable, SurfaceTable

seeds = st.integers(0, 2**32 - 1)


def build_knots(rng: np.random.Generator, count: int, degree: int) -> FloatArray:
    """A knot vector, clamped or not, that may repeat knots up to the degree."""
    inner = count - degree - 1
    start = float(rng.integers(-3, 4))
    steps = rng.integers(0, 3, inner + 1) / 2
    steps[0] = steps[0] or 1.0
    knots = start + np.concatenate([[0.0], np.cumsum(steps)])
    knots[-1] += 1.0
    # No knot inside the domain occurs more often than the degree.
    for k in range(1, inner + 1):
        if k >= degree and knots[k] <= knots[k - degree]:
            knots[k:] += 0.5
    before, after = np.zeros(degree), np.zeros(degree)
    if rng.random() < 0.5:
        before = -np.cumsum(rng.integers(0, 2, degree))[::-1] / 4
        after = np.cumsum(rng.integers(0, 2, degree)) / 4
    return np.concatenate([knots[0] + before, knots, knots[-1] + after])


def build_curves(rng: np.random.Generator, count: int, dimension: int) -> CurveTable:
    """`count` curves of degrees 1 to 5, some of them rational."""
    degrees = rng.integers(1, 6, count)
    counts = degrees + 1 + rng.integers(0, 6, count)
    is_rational = rng.random(count) < 0.5
    weights = np.where(np.repeat(is_rational, counts), rng.integers(1, 9, counts.sum()) / 4, 1.0)
    knots = [build_knots(rng, int(n), int(p)) for n, p in zip(counts, degrees, strict=True)]
    points = rng.integers(-64, 65, (counts.sum(), dimension)) / 16 + 100.0
    return CurveTable(degrees, counts, points, weights, is_rational, np.concatenate(knots))


def build_surfaces(rng: np.random.Generator, count: int) -> SurfaceTable:
    """`count` surfaces of degrees 1 to 3, some of them rational."""
    degrees = rng.integers(1, 4, (count, 2))
    counts = degrees + 1 + rng.integers(0, 4, (count, 2))
    sizes = counts.prod(axis=1)
    is_rational = rng.random(count) < 0.5
    weights = np.where(np.repeat(is_rational, sizes), rng.integers(1, 9, sizes.sum()) / 4, 1.0)
    knots = [
        build_knots(rng, int(n), int(p))
        for n, p in zip(counts.ravel(), degrees.ravel(), strict=True)
    ]
    points = rng.integers(-64, 65, (sizes.sum(), 3)) / 16 + 100.0
    return SurfaceTable(degrees, counts, points, weights, is_rational, np.concatenate(knots))


def find_curve_point(table: CurveTable, curve: int, t: float | Fraction) -> list[Fraction]:
    """The point of a curve, exactly."""
    rows = slice(table.point_starts[curve], table.point_starts[curve + 1])
    knots = table.knots[table.knot_starts[curve] : table.knot_starts[curve + 1]]
    net = [
        [Fraction(w) * Fraction(x) for x in point] + [Fraction(w)]
        for point, w in zip(table.points[rows].tolist(), table.weights[rows].tolist(), strict=True)
    ]
    exact_knots = [Fraction(u) for u in knots.tolist()]
    *point, weight = splines.spline_point(
        [tuple(p) for p in net], exact_knots, int(table.degrees[curve]), Fraction(t)
    )
    return [x / weight for x in point]


def find_surface_point(
    table: SurfaceTable, face: int, u: float | Fraction, v: float | Fraction
) -> list[Fraction]:
    """The point of a surface, exactly."""
    rows = slice(table.point_starts[face], table.point_starts[face + 1])
    p, q = table.degrees[face].tolist()
    columns = int(table.counts[face, 1])
    knots_u, knots_v = (
        [
            Fraction(x)
            for x in table.knots[
                table.knot_starts[2 * face + k] : table.knot_starts[2 * face + k + 1]
            ].tolist()
        ]
        for k in range(2)
    )
    net = [
        tuple([Fraction(w) * Fraction(x) for x in point] + [Fraction(w)])
        for point, w in zip(table.points[rows].tolist(), table.weights[rows].tolist(), strict=True)
    ]
    lines = [
        splines.spline_point(net[k : k + columns], knots_v, q, Fraction(v))
        for k in range(0, len(net), columns)
    ]
    *point, weight = splines.spline_point(lines, knots_u, p, Fraction(u))
    return [x / weight for x in point]
