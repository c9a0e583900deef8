"""Proved bounds of the distances from pieces of edges to their chords.

A piece is cut at the breaks of its curve. Over each part the curve is in the hull of its control
points, and its distance from the chord is bounded by theirs.

Proof in docs/proofs.md: "Edges and their polylines".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.bounds.chords import bound_from_distances, measure_distances
from service.engine.trims.splines import Splines
from service.engine.vectors import UNIT, project

QUARTERS = 4
"""A piece over several spans is cut into this number of equal parts, too: hulls become smaller."""

LOWERING = 2.0**-38, 2.0**-50
"""Errors of Bézier points: shares of the extent of the part and of the largest coordinate."""


def bound_edge_pieces(
    curves: Splines, curve: Ints, low: FloatArray, high: FloatArray, chords: FloatArray
) -> FloatArray:
    """Bounds (m,) of the distances from curves over [low, high], (m,) each, to chords (m, 2, 3).

    The rounding of restricted nets, of distances and of lowering is in the bounds.
    """
    intervals = curves.cut(curve, low, high)
    source = intervals.source
    if len(source) > len(curve):
        several = np.bincount(source, minlength=len(curve)) > 1
        one, many = (~several).nonzero()[0], several.nonzero()[0]
        part = np.arange(QUARTERS * len(many)) % QUARTERS
        piece = np.concatenate([one, many.repeat(QUARTERS)])
        begin, width = low[many].repeat(QUARTERS), (high - low)[many].repeat(QUARTERS)
        ends = high[many].repeat(QUARTERS)
        begins = np.concatenate([low[one], begin + width * part / QUARTERS])
        last = part == QUARTERS - 1
        ends = np.where(last, ends, begin + width * (part + 1) / QUARTERS)
        intervals = curves.cut(curve[piece], begins, np.concatenate([high[one], ends]))
        source = piece[intervals.source]
    bounds = np.empty(len(source))
    for rows, nets in curves.restrict(intervals):
        points, chord = project(nets, -1), chords[source[rows]]
        distances = measure_distances(points, chord)
        weights = nets[..., 3] if nets.shape[-1] > 3 else None
        # NumPy reduces many short rows slowly.
        long_points, long_chord = (
            np.ascontiguousarray(x.transpose(1, 2, 0)) for x in (points, chord)
        )
        most, least = long_points.max(axis=0), long_points.min(axis=0)
        extent = (most - least).max(axis=0)
        far = np.maximum(np.maximum(most, -least).max(axis=0), np.abs(long_chord).max(axis=(0, 1)))
        degree = nets.shape[1] - 1
        rounding = count_edge_roundings(degree) * UNIT * far
        rounding += LOWERING[0] * extent + LOWERING[1] * far
        least = np.minimum(bound_from_distances(distances, weights), distances.max(axis=1))
        bounds[rows] = least + rounding
    if len(source) == len(curve):
        return bounds
    largest = np.zeros(len(curve))
    np.maximum.at(largest, source, bounds)
    return largest


def count_edge_roundings(degree: int) -> int:
    """All rounding of a bound of an edge, in units u of the largest coordinate."""
    return 16 * degree + 64
