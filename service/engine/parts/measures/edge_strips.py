"""Strips between the borders of faces and edges, which close a part; and how else it may be closed.

Each piece of a border gets a strip to its edge. Poles, and the segments that join parameter curves,
get a strip to their vertex, and triangles lead from the ends of strips to vertices. So the faces of
a shell, each with its strips, are closed where their edges are. Every other solid that has the same
faces, and differs only within the gaps of edges, differs by at most the volume of tubes about them.

Proof in docs/proofs.md: "Closing the gaps of edges".
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import elevation_matrix
from service.engine.brep.prepared import PreparedBrep
from service.engine.measures.cells import UPWARDS
from service.engine.measures.strips import StripRows, Strips
from service.engine.parts.measures.border_pieces import (
    JOIN,
    JUMP,
    POINT,
    BorderPieces,
)
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.trims.span_nets import Intervals
from service.engine.trims.spline_shapes import measure_polygons
from service.engine.vectors import length


@dataclass(frozen=True, eq=False, slots=True)
class Closing:
    """The strips that close faces, and what else may close them, in the frame of a placed brep.

    Attributes
    ----------
    strips : list of Strips
        Those of each face have the sign of its normal.
    leaks : ndarray of float64, shape (F,)
        The most that the triangles of each face, and the places at which its strips meet up to
        rounding, change its flux.
    tubes : ndarray of float64, shape (F,)
        The volume about the edges and vertices of each face within which a part may be closed in
        other ways; an edge that several faces have counts for each of them.
    """

    strips: list[Strips]
    leaks: FloatArray
    tubes: FloatArray


def close_faces(placed: PlacedBrep, borders: BorderPieces) -> Closing:
    """The strips of all pieces of borders, and bounds of how much other closings differ."""
    prepared, pieces = placed.prepared, borders.pieces
    stretch, radius = placed.stretch, placed.radius
    faces, drifts = len(prepared.surfaces), stretch * pieces.drifts
    coedge, has_edge = pieces.coedge, pieces.edge_span >= 0
    reaches = np.where(has_edge, stretch * prepared.close_gaps[coedge] + drifts, np.inf)
    strips, rows = _build_strips(placed, borders, reaches)
    for each, piece in zip(strips, rows, strict=True):
        reaches[piece] = np.minimum(reaches[piece], each.bound_gaps())
    # Strips of neighbouring pieces meet up to drifts: triangles close the rest.
    radius = radius + float(reaches.max(initial=0.0))
    following = pieces.following
    apart = drifts + drifts[following]
    reach = np.maximum(reaches, reaches[following])
    triangles = radius / 2 * apart * (reach + apart)
    leaks, total = np.zeros((2, faces))
    leaks += np.bincount(pieces.face, triangles, minlength=faces)
    # The triangles from the ends of edges to vertices.
    reach_of_coedge = np.zeros(len(prepared.coedge_edges))
    np.maximum.at(reach_of_coedge, coedge[has_edge], reaches[has_edge])
    apart = stretch * _measure_ends(prepared)
    triangles = (radius * apart * (apart + reach_of_coedge)).sum(axis=0)
    leaks += np.bincount(prepared.coedge_faces, triangles, minlength=faces)
    # Tubes about edges; balls about vertices, as large as the strips and triangles there.
    curve = prepared.edge_curves[prepared.coedge_edges]
    lengths = stretch * np.where(
        curve >= 0, np.append(measure_polygons(prepared.curves), 0.0)[curve], 0.0
    )
    tubes = pi * reach_of_coedge**2 * (lengths + 4 / 3 * reach_of_coedge)
    at_vertices = np.zeros(len(prepared.coedge_edges))
    np.maximum.at(at_vertices, coedge[~has_edge], reaches[~has_edge])
    balls = np.maximum(apart + reach_of_coedge, at_vertices)
    tubes += (4 / 3 * pi * balls**3).sum(axis=0)
    total += np.bincount(prepared.coedge_faces, tubes, minlength=faces)
    return Closing(strips, leaks * UPWARDS, total * UPWARDS)


def _build_strips(
    placed: PlacedBrep, borders: BorderPieces, gaps: FloatArray
) -> tuple[list[Strips], list[Ints]]:
    """The strips, and the pieces that they belong to; `gaps` (m,) are bounds of their widths."""
    pieces, nets = borders.pieces, placed.prepared.surfaces.nets
    edges = _list_edges(placed, borders)
    strips, rows = [], []
    for each in borders.nets:
        group = nets.group[pieces.patch[each.rows]]
        for number in np.unique(group).tolist():
            chosen = np.flatnonzero(group == number)
            piece, curves = each.rows[chosen], each.values[:, :, chosen]
            if len(curves) > 2:
                _, exponent = np.frexp(curves[2].max(axis=0))
                curves = np.ldexp(curves, -exponent)
            face = pieces.face[piece]
            strip_rows = StripRows(
                curves,
                edges[:, :, piece],
                gaps[piece],
                nets.row[pieces.patch[piece]],
                face,
                placed.sides[face],
                np.zeros(len(piece), np.intp),
            )
            strips.append(Strips(placed.patches[number], strip_rows))
            rows.append(piece)
    return strips, rows


def _list_edges(placed: PlacedBrep, borders: BorderPieces) -> FloatArray:
    """Homogeneous nets (4, n+1, m) of the edges of pieces, along their loops, of one degree n."""
    prepared, pieces = placed.prepared, borders.pieces
    curves = prepared.curves
    degree = max((group.degree for group in curves.groups), default=1)
    nets = np.empty((4, degree + 1, len(pieces.coedge)))
    rows = np.flatnonzero(pieces.edge_span >= 0)
    coedge = pieces.coedge[rows]
    curve = prepared.edge_curves[prepared.coedge_edges[coedge]]
    intervals = Intervals(rows, curve, pieces.low[rows], pieces.high[rows], pieces.edge_span[rows])
    for some, values in curves.restrict(intervals) if len(rows) else ():
        weights = values[..., 3:] if values.shape[2] == 4 else np.ones((*values.shape[:2], 1))
        points = placed.to_local(values[..., :3] / weights) * weights
        own = np.concatenate([points, weights], axis=2)
        raised = elevation_matrix(values.shape[1] - 1, degree) @ own
        is_reversed = prepared.coedge_reversed[coedge[some]][:, np.newaxis, np.newaxis]
        directed = np.where(is_reversed, raised[:, ::-1], raised)
        nets[:, :, rows[some]] = directed.transpose(2, 1, 0)
    # Poles and joins have the vertex at the end of their coedge; jumps the end of an edge.
    rest = np.flatnonzero((pieces.edge_span == POINT) | (pieces.edge_span == JOIN))
    first, last = prepared.edge_vertices[prepared.coedge_edges[pieces.coedge[rest]]].T
    vertex = np.where(prepared.coedge_reversed[pieces.coedge[rest]], first, last)
    nets[:3, :, rest] = placed.to_local(prepared.vertices[vertex]).T[:, np.newaxis]
    nets[3, :, rest] = 1.0
    jumps = np.flatnonzero(pieces.edge_span == JUMP)
    nets[:, :, jumps] = nets[:, -1:, borders.jump_sources]
    _, exponent = np.frexp(nets[3].max(axis=0))
    return np.asarray(np.ldexp(nets, -exponent))


def _measure_ends(prepared: PreparedBrep) -> FloatArray:
    """How far the edges of coedges begin and end from their vertices, (2, C). Model units."""
    edge = prepared.coedge_edges
    apart = np.zeros((2, len(edge)))
    rows = np.flatnonzero(prepared.edge_curves[edge] >= 0)
    curve = prepared.edge_curves[edge[rows]]
    for end in range(2):
        points = prepared.curves.evaluate(curve, prepared.edge_ranges[edge[rows], end])
        vertices = prepared.vertices[prepared.edge_vertices[edge[rows], end]]
        # 2^-50 is for the rounding of points.
        size = np.abs(points).max(axis=1) + np.abs(vertices).max(axis=1)
        apart[end, rows] = length(points - vertices, -1) + 2.0**-48 * size
    return apart
