"""Edges sampled by tolerance, once for all faces."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.adaptive.limits import MeshLimits
from service.engine.brep.borders.collapse import collapse_edges, measure_end_gaps
from service.engine.brep.borders.edge_bounds import bound_edge_pieces
from service.engine.brep.borders.edge_pieces import (
    EdgePieces,
    count_least_pieces,
    list_first_samples,
)
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.vectors import length

EDGE_SHARE = 0.7
"""Share of the tolerance for edges; the surface beside a chord, measured later, may have more."""

SPARE = 1.1
"""Bounds of parts fall by nearly the square of their number. This
factor saves most further halvings."""

PIECE_WORK = 5e3
"""Multiplications to bound a piece of an edge, approximately."""

ROUNDS = 60
"""The most rounds of division; each halves pieces that are too far from their chords, or more."""

MOST_PARTS = 16
"""The most parts into which one round divides a piece."""

MOST_EVEN = 64
"""The most parts of a curve whose loops are tested."""

BENT = 0.5
"""In the first `BENT_ROUNDS` rounds a piece is also divided if its curve is further from the chord
than this share of the chord's length, so that short closed edges keep their shape."""

BENT_ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class _Ends:
    """The first and the last vertex of each edge, and the gaps between curves and them, (E, 2)."""

    vertices: Ints
    gaps: FloatArray


def sample_edges(
    prepared: PreparedBrep, tolerance: float, limits: MeshLimits | None = None
) -> EdgeSamples:
    """Samples of all edges that coedges use, with chords within `EDGE_SHARE` of the tolerance.

    Kinks of an edge and of its parameter curves are samples. A closed edge has at least three
    pieces, and edges with the same two vertices have at least two pieces each. Where a vertex is
    further from the end of its curve, the piece there is divided until the gap alone is left.

    Raises
    ------
    TooLarge
        `too_many_triangles`, `too_costly`.
    """
    limits = limits or MeshLimits()
    gaps = measure_end_gaps(prepared, prepared.edge_vertices)
    collapse = collapse_edges(prepared, gaps, tolerance)
    is_point = prepared.is_degenerate | collapse.is_collapsed
    if collapse.is_collapsed.any():
        gaps = measure_end_gaps(prepared, collapse.ends)
    ends = _Ends(collapse.ends, gaps)
    edges, parameters = list_first_samples(prepared, is_point, ends.vertices)
    first = (edges[1:] == edges[:-1]).nonzero()[0]
    pieces = EdgePieces(edges[first], parameters[first], parameters[first + 1])
    used = edges[find_begins(edges)]
    least = count_least_pieces(is_point, ends.vertices, used)
    parts = -(-least // np.maximum(np.bincount(pieces.edges, minlength=len(is_point)), 1))
    parts[is_point] = 1
    pieces = pieces.divide(parts[pieces.edges])
    on_points = is_point[pieces.edges]
    curved, bounds = _divide_pieces(
        prepared, ends, EDGE_SHARE * tolerance, pieces.take(~on_points), limits
    )
    points = pieces.take(on_points)
    edges = np.concatenate([curved.edges, points.edges, used])
    parameters = np.concatenate([curved.low, points.low, prepared.edge_ranges[used, 1]])
    bounds = np.concatenate([bounds, collapse.chains[points.edges], np.zeros(len(used))])
    order = np.lexsort((parameters, edges))
    return EdgeSamples.number(
        prepared,
        edges=edges[order],
        parameters=parameters[order],
        bounds=bounds[order],
        is_point=is_point,
        ends=ends.vertices,
        known=np.full((len(edges), 3), np.nan),
    )


def sample_evenly(prepared: PreparedBrep, parts: int) -> EdgeSamples:
    """Samples of edges at equal parameters, without positions and bounds: for tests of loops.

    An edge has `parts` samples, or more, for each span of its parameter curve with the most spans,
    up to `MOST_EVEN`; and none inside if all its parameter curves are lines. Kinks are samples.
    """
    is_point, ends = prepared.is_degenerate, prepared.edge_vertices
    edges, parameters = list_first_samples(prepared, is_point, ends)
    first = (edges[1:] == edges[:-1]).nonzero()[0]
    pieces = EdgePieces(edges[first], parameters[first], parameters[first + 1])
    pcurves = prepared.pcurves
    wanted = np.where(pcurves.degree > 1, np.minimum(parts * pcurves.span_count, MOST_EVEN), 1)
    counts = np.ones(len(is_point), np.intp)
    np.maximum.at(counts, prepared.coedge_edges, wanted)
    present = np.bincount(pieces.edges, minlength=len(is_point))
    counts = np.maximum(-(-counts // np.maximum(present, 1)), 1)
    used = edges[find_begins(edges)]
    least = count_least_pieces(is_point, ends, used)
    counts = np.maximum(counts, -(-least // np.maximum(present, 1)))
    counts[is_point] = 1
    pieces = pieces.divide(counts[pieces.edges])
    edges = np.concatenate([pieces.edges, used])
    parameters = np.concatenate([pieces.low, prepared.edge_ranges[used, 1]])
    order = np.lexsort((parameters, edges))
    return EdgeSamples.number(
        prepared,
        edges=edges[order],
        parameters=parameters[order],
        bounds=np.full(len(edges), np.inf),
        is_point=is_point,
        ends=ends,
        known=np.zeros((len(edges), 3)),
    )


def _divide_pieces(
    prepared: PreparedBrep,
    ends: _Ends,
    tolerance: float,
    pieces: EdgePieces,
    limits: MeshLimits,
) -> tuple[EdgePieces, FloatArray]:
    """Pieces of edges divided until they are near their chords, and their bounds.

    A face with k sides has at least k − 2 triangles.
    """
    done, done_bounds = [pieces.take(slice(0))], [np.zeros(0)]
    faces, total = len(prepared.surfaces), 0
    for round_number in range(ROUNDS):
        if not len(pieces.edges):
            break
        limits.spend(PIECE_WORK * len(pieces.edges))
        limits.count(total + len(pieces.edges) - 2 * faces)
        low, high = pieces.low, pieces.high
        at_ends = (
            low == prepared.edge_ranges[pieces.edges, 0],
            high == prepared.edge_ranges[pieces.edges, 1],
        )
        chords = _find_chords(prepared, ends, pieces, at_ends)
        curves = prepared.edge_curves[pieces.edges]
        bounds = bound_edge_pieces(prepared.curves, curves, low, high, chords)
        at_begin, at_end = ends.gaps.T.take(pieces.edges, axis=1) * np.array(at_ends)
        gaps = np.maximum(at_begin, at_end)
        needs = bounds > np.maximum(tolerance, gaps + tolerance / 2)
        if round_number < BENT_ROUNDS:
            needs |= bounds > BENT * length(chords[:, 1] - chords[:, 0], -1)
        step = low + (high - low) / MOST_PARTS
        needs &= (low < step) & (step < high) & (round_number < ROUNDS - 1)
        done.append(pieces.take(~needs))
        done_bounds.append(bounds[~needs])
        if not needs.any():
            break
        total += len(done_bounds[-1])
        pieces, bounds = pieces.take(needs), bounds[needs]
        parts = np.ceil(np.sqrt(np.minimum(SPARE * bounds / tolerance, MOST_PARTS**2)))
        pieces = pieces.divide(np.maximum(parts, 2).astype(np.intp))
    return EdgePieces.join(done), np.concatenate(done_bounds)


def _find_chords(
    prepared: PreparedBrep, ends: _Ends, pieces: EdgePieces, at_ends: tuple[Bools, Bools]
) -> FloatArray:
    """The chords (m, 2, 3) of pieces; at the ends of edges they end in the vertices."""
    curves = prepared.edge_curves[pieces.edges]
    parameters = np.concatenate([pieces.low, pieces.high])
    chords = prepared.curves.evaluate(np.concatenate([curves, curves]), parameters).reshape(
        2, -1, 3
    )
    for column, at_end in enumerate(at_ends):
        vertices = ends.vertices[pieces.edges[at_end], column]
        chords[column, at_end] = prepared.vertices[vertices]
    return np.ascontiguousarray(chords.swapaxes(0, 1))
