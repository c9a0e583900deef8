"""Pieces of edges as cells whose lengths are measured."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.measures.patch_cells import PatchCells, build_cells
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.trims.lowering import COORDINATE_ERROR, EXTENT_ERROR
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import UNIT
from service.surface.brep_model import BrepModel


def list_edge_cells(placed: PlacedBrep) -> list[PatchCells]:
    """The spans of all edges of the model; the number of the edge stands for that of a patch."""
    model = placed.prepared.model
    curves = Splines.of(model.curves)
    edges = np.flatnonzero(model.edge_curves >= 0)
    spans = curves.take(model.edge_curves[edges]).list_spans()
    intervals = Intervals(
        spans.source, model.edge_curves[edges][spans.curve], spans.low, spans.high, spans.span
    )
    errors = _bound_lowering(model)[intervals.curve]
    return _build_cells(placed, curves, intervals, edges[spans.curve], errors)


def list_border_cells(placed: PlacedBrep, coedges: Ints, border: Ints) -> list[PatchCells]:
    """The edges of coedges (m,) of the prepared brep, with the number of the border of each."""
    prepared = placed.prepared
    edge = prepared.coedge_edges[coedges]
    rows = np.flatnonzero(prepared.edge_curves[edge] >= 0)
    edge = edge[rows]
    low, high = prepared.edge_ranges[edge].T
    pieces = prepared.curves.cut(prepared.edge_curves[edge], low, high)
    source = prepared.edge_sources[edge]
    model = prepared.model
    curve = np.where(source >= 0, np.append(model.edge_curves, -1)[source], -1)
    errors = np.append(_bound_lowering(model), 0.0)[curve]
    owner = pieces.source
    return _build_cells(placed, prepared.curves, pieces, border[rows[owner]], errors[owner])


def _bound_lowering(model: BrepModel) -> FloatArray:
    """Bounds of how far lowered curves may be from those of the request, (n,). Model units."""
    table = model.curves
    if not len(table):
        return np.zeros(0)
    first = table.point_starts[: len(table)]
    low, high = (
        reduce.reduceat(table.points, first, axis=0) for reduce in (np.minimum, np.maximum)
    )
    extent = (high - low).max(axis=1)
    largest = np.maximum(np.abs(low), np.abs(high)).max(axis=1)
    return np.asarray(EXTENT_ERROR * extent + COORDINATE_ERROR * largest)


def _build_cells(
    placed: PlacedBrep, curves: Splines, pieces: Intervals, number: Ints, errors: FloatArray
) -> list[PatchCells]:
    """Pieces of curves as cells, with numbers (m,), and errors (m,) in model units."""
    cells = []
    for rows, values in curves.restrict(pieces):
        weights = values[..., 3:] if values.shape[2] == 4 else 1.0
        points = values[..., :3] / weights
        local = placed.to_local(points)
        size = np.abs(points).max(axis=(1, 2)) * placed.stretch + placed.shift
        error = placed.stretch * errors[rows] + 32 * values.shape[1] * UNIT * size
        nets = local if values.shape[2] == 3 else np.concatenate([local * weights, weights], 2)
        cells.append(build_cells(nets[:, :, np.newaxis], number[rows], error))
    return cells
