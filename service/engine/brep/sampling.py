"""Edges sampled by tolerance, once for all faces, and pieces of edges halved."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.limits import MeshLimits
from service.engine.brep.collapse import collapse_edges, measure_end_gaps
from service.engine.brep.edge_bounds import bound_edge_pieces
from service.engine.brep.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.spline_shapes import find_kinks
from service.engine.vectors import Items, length

EDGE_SHARE = 0.7
"""Share of the tolerance for edges; the surface beside a chord, measured later, may have more."""

PIECE_WORK = 5e3
"""Multiplications to bound a piece of an edge, approximately."""

ROUNDS = 60
"""The most rounds of division; each halves pieces that are too far from their chords, or more."""

MOST_PARTS = 16
"""The most parts into which one round divides a piece."""

SAME = 2.0**-22
"""Samples nearer than this share of the range of their edge are one."""

MOST_EVEN = 64
"""The most parts of a curve whose loops are tested."""

BENT = 0.5
"""In the first `BENT_ROUNDS` rounds a piece is also divided if its curve is further from the chord
than this share of the chord's length, so that short closed edges keep their shape."""

BENT_ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces(Items):
    """m pieces of edges, each between two parameters."""

    edges: Ints
    low: FloatArray
    high: FloatArray

    def divide(self, parts: Ints) -> "_Pieces":
        """Each piece in a number of equal parts (m,)."""
        run, number = expand_runs(parts)
        low = self.low[run] + (self.high - self.low)[run] * (number / parts[run])
        high = np.append(low[1:], 0.0)
        high[number == parts[run] - 1] = self.high
        return _Pieces(self.edges[run], low, high)


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
    edges, parameters = _list_first_samples(prepared, is_point, ends.vertices)
    first = (edges[1:] == edges[:-1]).nonzero()[0]
    pieces = _Pieces(edges[first], parameters[first], parameters[first + 1])
    used = np.unique(edges)
    least = _count_least_pieces(is_point, ends.vertices, used)
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
    edges, parameters = _list_first_samples(prepared, is_point, ends)
    first = (edges[1:] == edges[:-1]).nonzero()[0]
    pieces = _Pieces(edges[first], parameters[first], parameters[first + 1])
    pcurves = prepared.pcurves
    wanted = np.where(pcurves.degree > 1, np.minimum(parts * pcurves.span_count, MOST_EVEN), 1)
    counts = np.ones(len(is_point), np.intp)
    np.maximum.at(counts, prepared.coedge_edges, wanted)
    present = np.bincount(pieces.edges, minlength=len(is_point))
    counts = np.maximum(-(-counts // np.maximum(present, 1)), 1)
    used = np.unique(edges)
    least = _count_least_pieces(is_point, ends, used)
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


def _list_first_samples(
    prepared: PreparedBrep, is_point: Bools, ends: Ints
) -> tuple[Ints, FloatArray]:
    """Edges and parameters of the ends of all used edges, and of kinks; sorted by both."""
    used = np.unique(prepared.coedge_edges)
    start, end = prepared.edge_ranges.T
    edge_of = np.full(len(prepared.curves), -1)
    edge_of[prepared.edge_curves[prepared.edge_curves >= 0]] = (
        prepared.edge_curves >= 0
    ).nonzero()[0]
    curve, kinks = find_kinks(prepared.curves)
    extent = prepared.places.extent[prepared.coedge_faces]
    coedge, pcurve_kinks = find_kinks(prepared.pcurves, extent)
    # A closed curve of three to five spans, such as a circle, keeps its breaks.
    closed = used[(ends[used, 0] == ends[used, 1]) & ~is_point[used]]
    spans = prepared.curves.span_count[prepared.edge_curves[closed]]
    closed = closed[(spans >= 3) & (spans <= 5)]
    closed_curves = prepared.edge_curves[closed]
    run, row = expand_runs(
        prepared.curves.span_count[closed_curves] - 1,
        prepared.curves.first_break[closed_curves] + 1,
    )
    inner_edges = np.concatenate([edge_of[curve], prepared.coedge_edges[coedge], closed[run]])
    inner = np.concatenate([kinks, pcurve_kinks, prepared.curves.breaks[row]])
    is_used = np.zeros(len(is_point) + 1, bool)
    is_used[used] = ~is_point[used]
    margin = SAME * (end - start)[inner_edges]
    keep = is_used[inner_edges]
    keep &= (inner > start[inner_edges] + margin) & (inner < end[inner_edges] - margin)
    edges = np.concatenate([used, used, inner_edges[keep]])
    parameters = np.concatenate([start[used], end[used], inner[keep]])
    order = np.lexsort((parameters, edges))
    edges, parameters = edges[order], parameters[order]
    new = np.ones(len(edges), bool)
    new[1:] = edges[1:] != edges[:-1]
    new[1:] |= np.diff(parameters) > SAME * (end - start)[edges[1:]]
    return edges[new], parameters[new]


def _count_least_pieces(is_point: Bools, ends: Ints, used: Ints) -> Ints:
    """The least number of pieces of each edge (E,), so that no two chords are between two vertices.

    It is 3 for closed edges, 2 for edges with the same two vertices, else 1.
    """
    least = np.ones(len(is_point), np.intp)
    edges = used[~is_point[used]]
    low, high = ends[edges].min(axis=1), ends[edges].max(axis=1)
    _, number, count = np.unique(low << 32 | high, return_inverse=True, return_counts=True)
    least[edges] = np.where(low == high, 3, np.where(count[number] > 1, 2, 1))
    return least


def _divide_pieces(
    prepared: PreparedBrep,
    ends: _Ends,
    tolerance: float,
    pieces: _Pieces,
    limits: MeshLimits,
) -> tuple[_Pieces, FloatArray]:
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
        gaps = (ends.gaps[pieces.edges] * np.stack(at_ends, axis=1)).max(axis=1)
        needs = bounds > np.maximum(tolerance, gaps + tolerance / 2)
        if round_number < BENT_ROUNDS:
            needs |= bounds > BENT * length(chords[:, 1] - chords[:, 0], -1)
        step = low + (high - low) / MOST_PARTS
        needs &= (low < step) & (step < high) & (round_number < ROUNDS - 1)
        done.append(pieces.take(~needs))
        done_bounds.append(bounds[~needs])
        total += len(done_bounds[-1])
        pieces, bounds = pieces.take(needs), bounds[needs]
        parts = np.ceil(np.sqrt(np.minimum(bounds / tolerance, MOST_PARTS**2)))
        pieces = pieces.divide(np.maximum(parts, 2).astype(np.intp))
    return _Pieces.join(done), np.concatenate(done_bounds)


def _find_chords(
    prepared: PreparedBrep, ends: _Ends, pieces: _Pieces, at_ends: tuple[Bools, Bools]
) -> FloatArray:
    """The chords (m, 2, 3) of pieces; at the ends of edges they end in the vertices."""
    curves = np.tile(prepared.edge_curves[pieces.edges], 2)
    parameters = np.concatenate([pieces.low, pieces.high])
    chords = prepared.curves.evaluate(curves, parameters).reshape(2, -1, 3)
    for column, at_end in enumerate(at_ends):
        vertices = ends.vertices[pieces.edges[at_end], column]
        chords[column, at_end] = prepared.vertices[vertices]
    return np.ascontiguousarray(chords.swapaxes(0, 1))


def halve_pieces(
    prepared: PreparedBrep, samples: EdgeSamples, pieces: Ints
) -> tuple[EdgeSamples, Ints]:
    """Halve pieces, given in any order and maybe repeatedly.

    Returns
    -------
    samples : EdgeSamples
    source : ndarray of int, shape (T,)
        The old number of each sample; −1 for new samples.
    """
    pieces = np.unique(pieces)
    low, high = samples.parameters[pieces], samples.parameters[pieces + 1]
    middle = low + (high - low) / 2
    proper = (low < middle) & (middle < high)
    return insert_samples(prepared, samples, pieces[proper], middle[proper])


def insert_samples(
    prepared: PreparedBrep, samples: EdgeSamples, pieces: Ints, parameters: FloatArray
) -> tuple[EdgeSamples, Ints]:
    """Insert samples inside pieces; both are in ascending order. The result is as above."""
    at = pieces + 1
    source = np.insert(np.arange(len(samples.edges)), at, -1)
    edges = np.insert(samples.edges, at, samples.edges[pieces])
    new_parameters = np.insert(samples.parameters, at, parameters)
    bounds = np.insert(samples.bounds, at, samples.bounds[pieces])
    known = samples.positions[samples.vertices][source]
    known[source < 0] = np.nan
    renewed = EdgeSamples.number(
        prepared,
        edges=edges,
        parameters=new_parameters,
        bounds=bounds,
        is_point=samples.is_point,
        ends=samples.ends,
        known=known,
    )
    new = (source < 0).nonzero()[0]
    changed = np.unique(np.concatenate([new - 1, new]))
    changed = changed[~samples.is_point[edges[changed]]]
    if len(changed):
        chords = renewed.positions[
            np.stack([renewed.vertices[changed], renewed.vertices[changed + 1]], axis=1)
        ]
        renewed.bounds[changed] = bound_edge_pieces(
            prepared.curves,
            prepared.edge_curves[edges[changed]],
            new_parameters[changed],
            new_parameters[changed + 1],
            chords,
        )
    return renewed, source
