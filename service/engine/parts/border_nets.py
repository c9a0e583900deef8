"""The edges and vertices of a part as nets for rays, with the radii of tubes and balls about them.

All gaps between the faces of a part are in tubes about its edges and in balls about its vertices.
The tube of an edge contains the images of its coedges on their faces. The ball of a vertex contains
the ends of edges there, the ends of these images, and all that joins them.

Proof in docs/proofs.md: "Tubes of edges".
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.prepared import PreparedBrep
from service.engine.nets.nets import group_nets
from service.engine.nets.query_nets import UNIT_CORNERS, QueryNets
from service.engine.parts.edge_nets import center_curves
from service.engine.parts.part import Part
from service.engine.parts.placed_nets import Frame, place_nets
from service.engine.parts.seam_gaps import bound_all_gaps
from service.engine.scenes.placing import scalings
from service.engine.trims.border_pieces import JOIN
from service.engine.vectors import Items, length
from service.surface.spline_tables import find_starts

ROUNDING = 10.0
"""Borders may be this number of margins further from their edges than by their gaps, and so may
points that count as inside."""


@dataclass(frozen=True, eq=False, slots=True)
class BorderSides(Items):
    """s coedges at edges and vertices.

    Attributes
    ----------
    coedge : ndarray of int, shape (s,)
        Among those of all breps.
    copy : ndarray of int, shape (s,)
        The copy of a brep.
    low, high : ndarray of float64, shape (s,)
        The parameters of the edge at the ends of the net.
    """

    coedge: Ints
    copy: Ints
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class BorderNets:
    """The nets of edges and vertices.

    Attributes
    ----------
    nets : QueryNets
        N nets of degree (n, 0), in the frame of the part; vertices are nets of two equal points.
    item : ndarray of int, shape (N,)
        A number of the edge or vertex that each net is a part of.
    reach : ndarray of float64, shape (N,)
        The radius of the tube or ball, in the coordinates of the nets.
    is_border : ndarray of bool, shape (N,)
        Whether the edge or vertex is a border of a face: no seam and no pole.
    first_side : ndarray of int, shape (N + 1,)
        The sides of net k are those from `first_side[k]` to `first_side[k + 1]` − 1.
    sides : BorderSides
    """

    nets: QueryNets
    item: Ints
    reach: FloatArray
    is_border: Bools
    first_side: Ints
    sides: BorderSides


@dataclass(frozen=True, eq=False, slots=True)
class _Curves:
    """M pieces of the curves of one brep, of one degree, with their gaps, sides and numbers.

    `nets` are those of `center_curves`. The sides of pieces follow each other; piece k has
    `count[k]` of them. Lengths are in model units until the curves are placed.
    """

    nets: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    item: Ints
    gap: FloatArray
    is_border: Bools
    count: Ints
    sides: BorderSides


@dataclass(frozen=True, eq=False, slots=True)
class _Placed:
    """Pieces of curves in the frame of the part: values of nets, numbers, reaches, and sides."""

    values: FloatArray
    item: Ints
    reach: FloatArray
    is_border: Bools
    count: Ints
    sides: BorderSides


def build_border_nets(part: Part) -> BorderNets | None:
    """The nets of all edges and vertices; None if there are none."""
    placed = _place(part)
    by_shape: dict[tuple[int, ...], list[_Placed]] = {}
    for each in placed:
        by_shape.setdefault(each.values.shape[:3], []).append(each)
    # `group_nets` joins nets of one shape.
    ordered = [each for parts in by_shape.values() for each in parts]
    if not ordered:
        return None
    groups = group_nets([(each.item, each.values) for each in ordered])
    item = np.concatenate([each.item for each in ordered])
    corners = np.broadcast_to(UNIT_CORNERS, (len(item), 4, 2))
    nets = part.nets
    return BorderNets(
        QueryNets(groups, nets.origin, nets.scale, item, corners, nets.diagonal),
        item,
        np.concatenate([each.reach for each in ordered]),
        np.concatenate([each.is_border for each in ordered]),
        find_starts(np.concatenate([each.count for each in ordered])),
        BorderSides.join([each.sides for each in ordered]),
    )


def _place(part: Part) -> list[_Placed]:
    """The edges and vertices of all copies of breps."""
    frame = Frame(part.nets.origin, part.nets.scale)
    members = part.members
    curves = [
        list(_list_curves(prepared, speeds))
        for prepared, speeds in zip(members.definitions, part.speeds, strict=True)
    ]
    errors = part.faces.errors
    error = 0.0 if errors is None else float(errors.max(initial=0.0))
    placed = []
    first_item = 0
    for number, copy in enumerate(members.copies):
        prepared = members.definitions[copy.definition]
        stretch = scalings(copy.matrix)[1] / frame.scale * (1.0 + 2.0**-40)
        for each in curves[copy.definition]:
            values, own_errors = place_nets(*each.nets, matrix=copy.matrix, frame=frame)
            sides = each.sides
            moved = BorderSides(
                copy.first_coedge + sides.coedge,
                np.full(len(sides.coedge), number),
                sides.low,
                sides.high,
            )
            reach = each.gap * stretch + own_errors + error
            item = first_item + each.item
            placed.append(_Placed(values, item, reach, each.is_border, each.count, moved))
        first_item += len(prepared.edge_curves) + len(prepared.vertices)
    return placed


def _list_curves(prepared: PreparedBrep, speeds: FloatArray) -> Iterator[_Curves]:
    """The edges of a brep that coedges run along, then the vertices at which coedges end."""
    face = prepared.coedge_faces
    gaps = bound_all_gaps(prepared)
    gaps += ROUNDING * prepared.regions.margins[face] * speeds[face]
    yield from _list_edges(prepared, gaps)
    yield from _list_vertices(prepared, gaps + _measure_joins(prepared, speeds))


def _list_edges(prepared: PreparedBrep, gaps: FloatArray) -> Iterator[_Curves]:
    """The edges that have curves, with the greatest gaps of their coedges."""
    edge = prepared.coedge_edges
    coedges = np.flatnonzero(prepared.edge_curves[edge] >= 0)
    coedges = coedges[np.argsort(edge[coedges], kind="stable")]
    edges, first, count = np.unique(edge[coedges], return_index=True, return_counts=True)
    if not len(edges):
        return
    gap = np.maximum.reduceat(gaps[coedges], first)
    is_border = np.logical_or.reduceat(prepared.is_border[coedges], first)
    low, high = prepared.edge_ranges[edges].T
    parts = prepared.curves.cut(prepared.edge_curves[edges], low, high)
    for index, values in prepared.curves.restrict(parts):
        own = parts.source[index]
        net, row = expand_runs(count[own], first[own])
        ends = parts.low[index][net], parts.high[index][net]
        sides = BorderSides(coedges[row], np.zeros(len(row), np.intp), *ends)
        nets = center_curves(np.ascontiguousarray(values.transpose(0, 2, 1)))
        yield _Curves(nets, edges[own], gap[own], is_border[own], count[own], sides)


def _list_vertices(prepared: PreparedBrep, gaps: FloatArray) -> Iterator[_Curves]:
    """The vertices at the ends of coedges, as nets of two equal points."""
    side = np.tile(np.arange(len(gaps)), 2)
    edge = prepared.coedge_edges[side]
    vertex = prepared.edge_vertices[prepared.coedge_edges].T.ravel()
    t = prepared.edge_ranges[prepared.coedge_edges].T.ravel()
    apart = gaps[side]
    curved = np.flatnonzero(prepared.edge_curves[edge] >= 0)
    ends = prepared.curves.evaluate(prepared.edge_curves[edge[curved]], t[curved])
    apart[curved] += length(ends - prepared.vertices[vertex[curved]], -1)
    order = np.argsort(vertex, kind="stable")
    vertices, first, count = np.unique(vertex[order], return_index=True, return_counts=True)
    if not len(vertices):
        return
    values = np.repeat(prepared.vertices[vertices][:, :, np.newaxis], 2, axis=2)
    gap = np.maximum.reduceat(apart[order], first)
    is_border = np.logical_or.reduceat(prepared.is_border[side[order]], first)
    sides = BorderSides(side[order], np.zeros(len(order), np.intp), t[order], t[order])
    item = len(prepared.edge_curves) + vertices
    yield _Curves(center_curves(values), item, gap, is_border, count, sides)


def _measure_joins(prepared: PreparedBrep, speeds: FloatArray) -> FloatArray:
    """Bounds (C,) of the lengths of the images of the joins at the ends of coedges."""
    pieces = prepared.regions.tree.pieces
    joins = np.flatnonzero(pieces.spans == JOIN)
    before = pieces.coedges[joins]
    # The coedge after a join is the next one of its loop, or the same one.
    starts = find_starts(prepared.loop_counts)
    loop = prepared.coedge_loops[before]
    after = np.where(before + 1 == starts[loop + 1], starts[loop], before + 1)
    size = np.abs(pieces.ends[:, joins] - pieces.begins[:, joins]).max(axis=0)
    size *= speeds[prepared.coedge_faces[before]]
    lengths = np.zeros(len(prepared.coedge_edges))
    np.maximum.at(lengths, before, size)
    np.maximum.at(lengths, after, size)
    return lengths
