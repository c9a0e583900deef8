"""Checks of tables of splines: the same checks as of single curves and surfaces, for all at once.

The functions only tell which splines must be refused. The class of the single spline words the
error.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs
from service.surface.checks import MAX_COORDINATE, MAX_WEIGHT_RATIO, USUAL_EXPONENT
from service.surface.knot_tables import KnotTable
from service.surface.knots import MAX_BEZIER_POINTS, MAX_ENTRIES, MAX_PIECES
from service.surface.spline_tables import CurveTable, SurfaceTable

Table = TypeVar("Table", CurveTable, SurfaceTable)

NO_NUMBERS: Ints = np.empty(0, np.intp)


def check_curves(table: CurveTable) -> tuple[CurveTable, Ints]:
    """The table in its normal form, and the numbers of the curves that must be refused.

    The normal form has merged knots, no −0, and weights only where they have an effect; weights far
    from 1 are multiplied by a power of two, as those of single curves. If any curve must be
    refused, the table is returned as it is.
    """
    if not len(table) or table.is_normal:
        return table, NO_NUMBERS
    starts = table.point_starts[:-1]
    highest = np.maximum.reduceat(table.points, starts, axis=0)
    is_one_point = (highest == np.minimum.reduceat(table.points, starts, axis=0)).all(axis=1)
    raw_knots = KnotTable(table.knots, table.degrees, table.counts)
    is_invalid = is_one_point | raw_knots.find_disordered() | _find_wrong_numbers(table)
    if is_invalid.any():
        return table, np.flatnonzero(is_invalid)
    knots = raw_knots.merge()
    spans, orders = knots.span_counts, table.degrees + 1
    is_long = (spans > MAX_PIECES) | (spans * orders**2 > MAX_ENTRIES)
    is_invalid = is_long | knots.find_discontinuous()
    return _finish(table, knots, is_invalid)


def check_surfaces(table: SurfaceTable) -> tuple[SurfaceTable, Ints]:
    """The table in its normal form, and the numbers of the surfaces that must be refused.

    See `check_curves`.
    """
    if not len(table) or table.is_normal:
        return table, NO_NUMBERS
    raw_knots = KnotTable(table.knots, table.degrees.ravel(), table.counts.ravel())
    is_invalid = raw_knots.find_disordered().reshape(-1, 2).any(axis=1) | _find_wrong_numbers(table)
    if is_invalid.any():
        return table, np.flatnonzero(is_invalid)
    knots = raw_knots.merge()
    spans, orders = knots.span_counts.reshape(-1, 2), table.degrees + 1
    is_long = (spans * orders**2).max(axis=1) > MAX_ENTRIES
    is_long |= (spans * orders).prod(axis=1) > MAX_BEZIER_POINTS
    is_long |= spans.prod(axis=1) > MAX_PIECES
    is_invalid = is_long | knots.find_discontinuous().reshape(-1, 2).any(axis=1)
    return _finish(table, knots, is_invalid)


def _finish(table: Table, knots: KnotTable, is_invalid: Bools) -> tuple[Table, Ints]:
    """The normal form of a table whose merged knots are `knots`, unless any spline is invalid."""
    if is_invalid.any():
        return table, np.flatnonzero(is_invalid)
    weights, is_rational = table.weights, table.is_rational
    if is_rational.any():
        low, high = _weight_ranges(table)
        is_rational = is_rational & (low < high)
        counts = count_runs(table.point_starts[:-1], len(weights))
        exponents = np.frexp(high)[1]
        exponents[np.abs(exponents) <= USUAL_EXPONENT] = 0
        weights = np.ldexp(weights, -np.repeat(exponents, counts))
        weights = np.where(np.repeat(is_rational, counts), weights, 1.0)
    points = table.points + 0.0  # −0 becomes 0, so that equal splines have equal bytes
    table = replace(
        table, points=points, weights=weights, is_rational=is_rational, knots=knots.knots + 0.0
    )
    for column in (table.degrees, table.counts, points, weights, is_rational, table.knots):
        column.flags.writeable = False
    object.__setattr__(table, "is_normal", True)
    return table, NO_NUMBERS


def find_end_points(table: CurveTable) -> FloatArray:
    """First and last point of each curve, (n, 2, D): control points if the knots are clamped.

    Other curves are evaluated by de Boor's algorithm.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., section 5.2.
    """
    starts = table.point_starts
    ends: FloatArray = table.points[np.array([starts[:-1], starts[1:] - 1]).T]
    knots = KnotTable(table.knots, table.degrees, table.counts)
    outer = table.knots[np.array([knots.starts[:-1], knots.starts[1:] - 1])]
    is_free = (knots.domains != outer).any(axis=0)
    if not is_free.any():
        return ends
    spans = np.flatnonzero(knots.is_span)
    owners, curves = knots.vectors[spans], np.arange(len(table))
    last = np.searchsorted(owners, curves, side="right") - 1
    end_spans = spans[np.stack([np.searchsorted(owners, curves), last])]
    weights = table.weights[:, np.newaxis]
    homogeneous = np.concatenate([table.points * weights, weights], axis=1)
    # Control point i of curve k is `points[knot_starts[k] + i − shifts[k]]`.
    shifts = table.knot_starts[:-1] - table.point_starts[:-1]
    for degree in np.unique(table.degrees[is_free]).tolist():
        chosen = np.flatnonzero((table.degrees == degree) & is_free)
        index = end_spans[:, chosen, np.newaxis] + np.arange(-degree, 1)  # (2, k, degree + 1)
        net = homogeneous[index - shifts[chosen, np.newaxis]]
        parameters = knots.domains[:, chosen, np.newaxis]
        for level in range(1, degree + 1):
            low = table.knots[index[..., level:]]
            high = table.knots[index[..., level:] + degree - level + 1]
            share = ((parameters - low) / (high - low))[..., np.newaxis]
            net = (1 - share) * net[..., :-1, :] + share * net[..., 1:, :]
        ends[chosen] = (net[..., 0, :-1] / net[..., 0, -1:]).swapaxes(0, 1)
    return ends


def _find_wrong_numbers(table: CurveTable | SurfaceTable) -> Bools:
    """Whether each spline has a coordinate or a weight that is refused."""
    starts = table.point_starts[:-1]
    is_wrong = ~(np.abs(table.points) <= MAX_COORDINATE).all(axis=1)  # true for NaN, too
    is_wrong |= ~((table.weights > 0) & np.isfinite(table.weights))
    low, high = _weight_ranges(table)
    return np.logical_or.reduceat(is_wrong, starts) | ~(high <= MAX_WEIGHT_RATIO * low)


def _weight_ranges(table: CurveTable | SurfaceTable) -> tuple[FloatArray, FloatArray]:
    """The least and the largest weight of each spline."""
    starts = table.point_starts[:-1]
    return np.minimum.reduceat(table.weights, starts), np.maximum.reduceat(table.weights, starts)
