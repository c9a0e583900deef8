"""The borders of trimmed faces, cut into pieces each of which lies over one patch.

A piece runs along its loop. Coordinates are those of the patch, from 0 to 1. Pieces of a loop join
exactly: where the next piece is over the same patch it begins where the piece ends, else at the
side between the patches. For that, and to stay in [0, 1], control points are moved by rounding
alone, or by the little that the cuts at knots leave.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.homogeneous import bound_partials
from service.engine.trims.knot_cuts import SpanParts, cut_at_knots
from service.engine.trims.places import SIZE
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.engine.vectors import UNIT, Items
from service.surface.spline_tables import CurveTable

SAME = 2.0**-40
"""Ends that are apart by at most this share of the box of a face are made one."""


POINT, JOIN, JUMP = -1, -2, -3
"""In place of the span of an edge's curve: the edge is a point; the piece is the segment between
two parameter curves; or it is where a border jumps over a patch, of which the piece is a line."""


@dataclass(frozen=True, eq=False, slots=True)
class PieceRows(Items):
    """m pieces.

    Attributes
    ----------
    coedge : ndarray of int, shape (m,)
        The coedge; of a join, the coedge before it.
    low, high : ndarray of float64, shape (m,)
        The parameters of the edge, or of the join.
    edge_span : ndarray of int, shape (m,)
        The span of the edge's curve; `POINT` for degenerate edges, `JOIN` and `JUMP`.
    face, patch : ndarray of int, shape (m,)
    span : ndarray of int, shape (2, m)
        The spans of the surface along u and v.
    following : ndarray of int, shape (m,)
        The next piece of the loop.
    moved : ndarray of float64, shape (2, m)
        How far control points were moved, in the parameters of the patch, with their rounding.
    speeds : ndarray of float64, shape (2, m)
        Bounds of how far points of the surface move for these, there and in neighbouring patches.
        Model units.
    """

    coedge: Ints
    low: FloatArray
    high: FloatArray
    edge_span: Ints
    face: Ints
    patch: Ints
    span: Ints
    following: Ints
    moved: FloatArray
    speeds: FloatArray

    @property
    def drifts(self) -> FloatArray:
        """Bounds of how far the borders on the surfaces were moved, (m,). Model units."""
        return np.asarray((self.moved * self.speeds).sum(axis=0))


@dataclass(frozen=True, eq=False, slots=True)
class PieceNets:
    """The nets of pieces of one degree.

    Attributes
    ----------
    rows : ndarray of int, shape (r,)
        The pieces.
    values : ndarray of float64, shape (2, k+1, r), or (3, k+1, r) if rational
        In the parameters of patches; if rational, (w u, w v, w).
    """

    rows: Ints
    values: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class BorderPieces:
    """The pieces of all loops, and their nets by degree.

    The last pieces are jumps; `jump_sources` are the pieces at whose ends they are.
    """

    pieces: PieceRows
    nets: tuple[PieceNets, ...]
    jump_sources: Ints


def cut_borders(prepared: PreparedBrep) -> BorderPieces:
    """The borders of all faces of a brep as pieces."""
    face = prepared.coedge_faces
    surfaces = ClosedSurfaces.open(prepared.surfaces)
    places = prepared.places
    scale = places.extent[face] / SIZE
    pcurves = prepared.pcurves.map_points(-places.origin[face] / scale, scale)
    spans = pcurves.list_spans()
    # Edges with a curve are cut where its spans end.
    curve = prepared.edge_curves[prepared.coedge_edges][spans.curve]
    curved, rest = (curve >= 0).nonzero()[0], (curve < 0).nonzero()[0]
    own = prepared.curves.cut(curve[curved], spans.low[curved], spans.high[curved])
    source = np.concatenate([curved[own.source], rest])
    order = np.argsort(source, kind="stable")
    low = np.concatenate([own.low, spans.low[rest]])[order]
    high = np.concatenate([own.high, spans.high[rest]])[order]
    edge_span = np.concatenate([own.span, np.full(len(rest), POINT)])[order]
    source = source[order]
    intervals = Intervals(
        np.arange(len(source)), spans.curve[source], low, high, spans.span[source]
    )
    parts = cut_at_knots(surfaces, face, pcurves, intervals)
    parts = parts.take(parts.high > parts.low)
    edge_span = edge_span[parts.source]
    joins, join_coedge = _list_joins(prepared, pcurves)
    join_parts = cut_at_knots(surfaces, face[join_coedge], joins, joins.list_spans())
    edge_span = np.append(edge_span, np.full(len(join_parts.curve), JOIN))
    return _assemble(prepared, (pcurves, parts), (joins, join_coedge, join_parts), edge_span)


def _list_joins(prepared: PreparedBrep, pcurves: Splines) -> tuple[Splines, Ints]:
    """The segments between coedges, and the coedges before them."""
    every = np.arange(len(pcurves))
    ends = np.array([pcurves.evaluate(every, pcurves.start), pcurves.evaluate(every, pcurves.end)])
    is_reversed = prepared.coedge_reversed[:, np.newaxis]
    begin, end = np.where(is_reversed, ends[::-1], ends)
    last = np.cumsum(prepared.loop_counts) - 1
    following = every + 1
    following[last] = last + 1 - prepared.loop_counts
    apart = np.abs(begin[following] - end) > SAME * prepared.places.extent[prepared.coedge_faces]
    rows = apart.any(axis=1).nonzero()[0]
    points = np.stack([end[rows], begin[following[rows]]], axis=1)
    count = len(rows)
    table = CurveTable(
        np.ones(count, np.intp),
        np.full(count, 2),
        points.reshape(2 * count, 2),
        np.ones(2 * count),
        np.zeros(count, bool),
        np.tile([0.0, 0.0, 1.0, 1.0], count),
    )
    return Splines.of(table), rows


def _assemble(
    prepared: PreparedBrep,
    coedges: tuple[Splines, SpanParts],
    joins: tuple[Splines, Ints, SpanParts],
    edge_span: Ints,
) -> BorderPieces:
    """The pieces of curves and joins, of which each knows the next one of its loop."""
    (pcurves, parts), (join_curves, join_coedge, join_parts) = coedges, joins
    count, surfaces = len(parts.curve), prepared.surfaces
    both = SpanParts.join([parts, join_parts])
    coedge = np.concatenate([parts.curve, join_coedge[join_parts.curve]])
    is_join = np.arange(len(coedge)) >= count
    is_reversed = prepared.coedge_reversed[coedge] & ~is_join
    along = np.where(is_reversed, -both.low, both.low)
    order = np.lexsort((along, is_join, coedge))
    following = np.empty(len(order), np.intp)
    following[order] = np.roll(order, -1)
    loop = prepared.coedge_loops[coedge[order]]
    last = np.flatnonzero(np.append(loop[1:] != loop[:-1], True))
    first = np.append(0, last[:-1] + 1)
    following[order[last]] = order[first]
    face = prepared.coedge_faces[coedge]
    span = np.array(np.divmod(both.patch - surfaces.faces.first[face], surfaces.faces.stride[face]))
    pieces = PieceRows(
        coedge,
        both.low,
        both.high,
        edge_span,
        face,
        both.patch,
        span,
        following,
        np.zeros((2, len(coedge))),
        bound_partials(surfaces)[:, both.around].max(axis=1)
        * (both.knots[:, 1] - both.knots[:, 0]),
    )
    nets = []
    for splines, some, shift in ((pcurves, parts, 0), (join_curves, join_parts, count)):
        intervals = Intervals(some.source, some.curve, some.low, some.high, some.span)
        for own, values in splines.restrict(intervals) if len(some.curve) else ():
            rows = own + shift
            flipped = is_reversed[rows][:, np.newaxis, np.newaxis]
            directed = np.where(flipped, values[:, ::-1], values)
            nets.append(PieceNets(rows, np.ascontiguousarray(directed.transpose(2, 1, 0))))
    pieces, joined, end = _join_ends(pieces, both.knots, nets)
    return _add_jumps(surfaces, pieces, joined, end)


def _join_ends(
    pieces: PieceRows, knots: FloatArray, nets: Sequence[PieceNets]
) -> tuple[PieceRows, list[PieceNets], FloatArray]:
    """The pieces, and their nets in the parameters of their patches, joined exactly.

    `knots` (2, 2, m) are those of `SpanParts`. The last result are the ends of pieces, (2, m).
    """
    count = len(pieces.coedge)
    low, width = knots[:, 0], knots[:, 1] - knots[:, 0]
    moved = np.empty((2, count))
    ends = np.empty((2, 2, count))  # begin and end, u and v
    local = []
    for each in nets:
        rows = each.rows
        w = each.values[2] if len(each.values) > 2 else 1.0
        given = each.values[:2] / w
        values = (given - low[:, np.newaxis, rows]) / width[:, np.newaxis, rows]
        inside = np.minimum(np.maximum(values, 0.0), 1.0)
        # The parameters were mapped from places, restricted, and divided.
        largest = np.abs(given).max(axis=1) + np.abs(low[:, rows])
        rounding = (8 * len(values[0]) + 32) * UNIT * (largest / width[:, rows] + 1)
        moved[:, rows] = np.abs(inside - values).max(axis=1) + rounding
        ends[0][:, rows], ends[1][:, rows] = inside[:, 0], inside[:, -1]
        local.append(inside)
    after = pieces.following
    step = np.sign(pieces.span[:, after] - pieces.span)
    begin = ends[0].copy()
    begin[:, after] = np.where(step > 0, 0.0, np.where(step < 0, 1.0, begin[:, after]))
    end = np.where(step > 0, 1.0, np.where(step < 0, 0.0, begin[:, after]))
    moved += np.maximum(np.abs(begin - ends[0]), np.abs(end - ends[1]))
    joined = []
    for each, inside in zip(nets, local, strict=True):
        inside[:, 0], inside[:, -1] = begin[:, each.rows], end[:, each.rows]
        w = each.values[2:]
        values = np.concatenate([inside * w, w]) if len(w) else inside
        joined.append(PieceNets(each.rows, values))
    return replace(pieces, moved=moved), joined, end


def _add_jumps(
    surfaces: FaceSurfaces, pieces: PieceRows, nets: list[PieceNets], end: FloatArray
) -> BorderPieces:
    """The pieces, and lines across patches that a border skips because their spans are thin.

    `end` (2, m) are the ends of pieces.
    """
    steps = pieces.span[:, pieces.following] - pieces.span
    results, sources = [pieces], [np.zeros(0, np.intp)]
    count = len(pieces.coedge)
    for axis in range(2):
        row, number = expand_runs(np.maximum(np.abs(steps[axis]) - 1, 0))
        if not len(row):
            continue
        direction = np.sign(steps[axis, row])
        span = pieces.span[:, row]
        span[axis] += direction * (number + 1)
        face = pieces.face[row]
        patch = surfaces.faces.first[face] + span[0] * surfaces.faces.stride[face] + span[1]
        line = np.empty((2, 2, len(row)))
        line[axis] = np.where(direction > 0, [[0.0], [1.0]], [[1.0], [0.0]])
        line[1 - axis] = end[1 - axis, row]
        jumps = replace(
            pieces.take(row),
            edge_span=np.full(len(row), JUMP),
            patch=patch,
            span=span,
            moved=np.zeros((2, len(row))),
        )
        results.append(jumps)
        sources.append(row)
        nets.append(PieceNets(count + np.arange(len(row)), line))
        count += len(row)
    return BorderPieces(PieceRows.join(results), tuple(nets), np.concatenate(sources))
