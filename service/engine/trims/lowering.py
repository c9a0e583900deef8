"""Curves and surfaces of all faces in Bézier form: all spans of one degree at once.

Proof in docs/proofs.md: "Lowered splines".
"""

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.span_nets import SpanNets
from service.engine.trims.spans import (
    Breaks,
    extract_points,
    find_breaks,
    find_general_spans,
    find_knots_around,
    list_spans,
)
from service.surface.batches import TensorPatches
from service.surface.spline_tables import CurveTable, SurfaceTable, find_starts

EXTENT_ERROR, COORDINATE_ERROR = 2.0**-38, 2.0**-50
"""A Bézier point is off by at most this share of the extent of its control points, and this share
of their largest coordinate."""


def lower_curves(table: CurveTable) -> tuple[Breaks, list[SpanNets], Ints, Ints]:
    """The spans of curves: their breaks, and one group of nets for each degree.

    The last two are the group of each curve, (n,), and the column of its first span there, (n,).
    """
    count = len(table)
    position, owner = list_spans(table.knots, table.degrees, table.knot_starts)
    breaks = find_breaks(table.knots, position, owner, count)
    span_count = breaks.count
    first_point = table.point_starts[owner] + position - table.knot_starts[owner]
    kind = 2 * table.degrees + table.is_rational
    group, row = np.zeros((2, count), np.intp)
    groups: list[SpanNets] = []
    for key in np.unique(kind).tolist():
        degree, is_rational = key // 2, bool(key % 2)
        curves, chosen = (kind == key).nonzero()[0], (kind[owner] == key).nonzero()[0]
        index = (first_point[chosen] - degree)[:, np.newaxis] + np.arange(degree + 1)
        points, weights = table.points[index], table.weights[index] if is_rational else None
        around = find_knots_around(table.knots, position[chosen], degree)
        general = find_general_spans(around).nonzero()[0]
        if len(general):
            mixed, mixed_weights = extract_points(
                points[general][:, :, np.newaxis],
                None if weights is None else weights[general][..., np.newaxis],
                around[general],
            )
            points[general] = mixed[:, :, 0]
            if weights is not None and mixed_weights is not None:
                weights[general] = mixed_weights[..., 0]
        values = to_homogeneous(points, weights).transpose(1, 2, 0)
        group[curves], row[curves] = len(groups), find_starts(span_count[curves])[:-1]
        groups.append(SpanNets(np.ascontiguousarray(values), is_rational))
    return breaks, groups, group, row


def lower_surfaces(
    table: SurfaceTable, position: Ints, breaks: Breaks
) -> tuple[tuple[TensorPatches, ...], Ints, FloatArray]:
    """The patches of surfaces in batches, one for each degree, polynomial degree (1, 1) first.

    Parameters
    ----------
    table : SurfaceTable
        F surfaces.
    position : ndarray of int, shape (m,)
        The rows of `table.knots` at which spans begin, for u and for v of surface after surface.
    breaks : Breaks
        The breaks between these spans.

    Returns
    -------
    batches : tuple of TensorPatches
    first : ndarray of int, shape (F,)
        The first patch of each surface; v varies fastest.
    errors : ndarray of float64, shape (F,)
        Bounds of the distances of the patches from the surfaces.
    """
    spans = breaks.count.reshape(-1, 2)
    first_span = find_starts(breaks.count)[:-1].reshape(-1, 2)
    local = position - np.repeat(table.knot_starts[:-1], breaks.count)
    first, errors = np.zeros(len(table), np.intp), np.zeros(len(table))
    kind = 2 * (table.degrees[:, 0] * 65 + table.degrees[:, 1]) + table.is_rational
    batches, count = [], 0
    for key in np.unique(kind).tolist():
        faces = (kind == key).nonzero()[0]
        p, q = table.degrees[faces[0]].tolist()
        patch_counts = spans[faces].prod(axis=1)
        run, number = expand_runs(patch_counts)
        face = faces[run]
        # The spans of each patch along u and along v, among all spans.
        u = first_span[face, 0] + number // spans[face, 1]
        v = first_span[face, 1] + number % spans[face, 1]
        rows = (local[u] - p)[:, np.newaxis] + np.arange(p + 1)
        columns = (local[v] - q)[:, np.newaxis] + np.arange(q + 1)
        index = rows[:, :, np.newaxis] * table.counts[face, 1][:, np.newaxis, np.newaxis]
        index = index + columns[:, np.newaxis] + table.point_starts[face][:, None, None]
        points = table.points[index]
        weights = table.weights[index] if key % 2 else None
        around_u = find_knots_around(table.knots, position[u], p)
        around_v = find_knots_around(table.knots, position[v], q)
        is_general = find_general_spans(around_u) | find_general_spans(around_v)
        general = is_general.nonzero()[0]
        if len(general):
            chosen = points[general]
            points[general], mixed = extract_points(
                chosen,
                None if weights is None else weights[general],
                around_u[general],
                around_v[general],
            )
            if weights is not None and mixed is not None:
                weights[general] = mixed
            error = EXTENT_ERROR * np.ptp(chosen, axis=(1, 2)).max(axis=1)
            error += COORDINATE_ERROR * np.abs(chosen).max(axis=(1, 2, 3))
            np.maximum.at(errors, face[general], error)
        first[faces] = count + find_starts(patch_counts)[:-1]
        count += len(face)
        batches.append(TensorPatches(points, weights))
    return tuple(batches), first, errors


def move_plane_corners(corners: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The nets (m, 2, 2, 3) of planes over [low, high], (m, 2) each, if they were over [0, 1]²."""
    origin = corners[:, 0, 0]
    du, dv = corners[:, 1, 0] - origin, corners[:, 0, 1] - origin
    u, v = np.stack([low[:, 0], high[:, 0]], axis=1), np.stack([low[:, 1], high[:, 1]], axis=1)
    moved = u[:, :, np.newaxis, np.newaxis] * du[:, np.newaxis, np.newaxis]
    moved = moved + v[:, np.newaxis, :, np.newaxis] * dv[:, np.newaxis, np.newaxis]
    result: FloatArray = origin[:, np.newaxis, np.newaxis] + moved
    return result
