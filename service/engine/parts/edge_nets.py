"""Nets of the edges of a brep, and how far from them the borders of faces may be.

An edge is a curve of space. The border of a region is on the surface; it is apart from its edge by
at most the gap of the coedge. Poles inside of the box of a face, and segments that join parameter
curves, have no edge near them: points with gaps cover them.

Proof in docs/proofs.md: "Nets of a part".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.prepared import PreparedBrep
from service.engine.parts.face_nets import find_boxes, find_slivers
from service.engine.trims.border_pieces import JOIN
from service.engine.trims.lowering import COORDINATE_ERROR, EXTENT_ERROR
from service.engine.vectors import UNIT, Items, project

ALIGNED = 1 / 2
"""A piece of a border runs along a side of the box of its face up to this number of margins: then
no path in the box crosses it."""

ROUNDING, SLIVERS = 2.0, 4.0
"""Borders may be further from their edges than by their gaps, by these numbers of margins: the
first, and the second too if the box of their face reaches into spans without nets."""

SHORT = 1 / 2
"""Segments that join parameter curves are no longer than this number of margins, or get a point."""

NO_EDGE = -1
"""The number of the edge of a net that only covers a border: it is no part of the part."""


@dataclass(frozen=True, eq=False, slots=True)
class EdgeRows(Items):
    """The edges of M nets.

    Attributes
    ----------
    edge : ndarray of int, shape (M,)
        The number of the edge, or `NO_EDGE`.
    low, high : ndarray of float64, shape (M,)
        The parameters of the edge at the ends of the net.
    gaps : ndarray of float64, shape (M,)
        No border of a region that needs the edge is further from it.
    coedge : ndarray of int, shape (M,)
        Of the coedges of the edge that are borders, the one of the face with the lowest number.
    face : ndarray of int, shape (M,)
        The face of this coedge.
    is_open : ndarray of bool, shape (M,)
        Whether the edge has no other coedge.
    """

    edge: Ints
    low: FloatArray
    high: FloatArray
    gaps: FloatArray
    coedge: Ints
    face: Ints
    is_open: Bools


@dataclass(frozen=True, eq=False, slots=True)
class EdgeNets:
    """The nets of M pieces of edges, of one degree.

    Attributes
    ----------
    rows : EdgeRows
    values : ndarray of float64, shape (M, 3 or 4, n+1, 1)
        In model coordinates about the middles; homogeneous if rational.
    middles : ndarray of float64, shape (3, M)
    sizes, errors : ndarray of float64, shape (M,)
        As those of `FaceNets`.
    """

    rows: EdgeRows
    values: FloatArray
    middles: FloatArray
    sizes: FloatArray
    errors: FloatArray


def build_edge_nets(prepared: PreparedBrep, speeds: FloatArray) -> list[EdgeNets]:
    """The nets of all edges that are borders, and points that cover what has no edge.

    `speeds` (F,) are bounds of how far a point of each face moves for one unit of places, along
    both axes together.
    """
    is_border, edge = prepared.is_border, prepared.coedge_edges
    face, count = prepared.coedge_faces, len(prepared.edge_curves)
    curved = prepared.edge_curves[edge] >= 0
    is_aligned, joins = _find_aligned(prepared)
    # Gaps of edges: the greatest of the coedges that paths may cross.
    reach = ROUNDING + SLIVERS * find_slivers(prepared)
    rounding = (reach * prepared.regions.margins * speeds)[face]
    gaps = np.zeros(count)
    crossed = np.flatnonzero(curved & ~is_aligned)
    np.maximum.at(gaps, edge[crossed], (prepared.close_gaps + rounding)[crossed])
    # The first coedge of each edge is that of the face with the lowest number.
    coedge = np.full(count, -1)
    borders = np.flatnonzero(curved & is_border)
    coedge[edge[borders][::-1]] = borders[::-1]
    is_crossed = np.zeros(count, bool)
    is_crossed[edge[crossed]] = True
    uses = np.bincount(edge, minlength=count)
    used = np.flatnonzero((coedge >= 0) | is_crossed)
    low, high = prepared.edge_ranges[used].T
    parts = prepared.curves.cut(prepared.edge_curves[used], low, high)
    own = used[parts.source]
    number = np.where(coedge[own] >= 0, own, NO_EDGE)
    rows = EdgeRows(
        number, parts.low, parts.high, gaps[own], coedge[own], face[coedge[own]], uses[own] == 1
    )
    nets = [
        EdgeNets(rows.take(index), *center_curves(np.ascontiguousarray(values.transpose(0, 2, 1))))
        for index, values in prepared.curves.restrict(parts)
    ]
    poles = np.flatnonzero(~curved & ~is_aligned)
    return nets + _cover(prepared, poles, joins, speeds)


def _find_aligned(prepared: PreparedBrep) -> tuple[Bools, Ints]:
    """Which coedges run along sides of the boxes of their faces, (C,); and which joins do not.

    Joins are numbers of pieces. Short ones belong to the rounding of their coedges.
    """
    regions = prepared.regions
    pieces, face = regions.tree.pieces, prepared.coedge_faces
    every = np.arange(len(prepared.surfaces))
    boxes = np.stack(find_boxes(prepared))
    boxes = np.stack([regions.places.to_places(every, box) for box in boxes])
    low, high = boxes[:, face[pieces.coedges]].transpose(0, 2, 1)
    reach = ALIGNED * regions.margins[face[pieces.coedges]]
    along = (pieces.boxes[2:] <= low + reach) | (pieces.boxes[:2] >= high - reach)
    is_aligned = along.any(axis=0)
    is_join = pieces.spans == JOIN
    # A coedge is aligned if all its pieces are.
    result = np.ones(len(face), bool)
    result[pieces.coedges[~(is_join | is_aligned)]] = False
    length = (pieces.boxes[2:] - pieces.boxes[:2]).max(axis=0)
    is_long = length > SHORT * regions.margins[face[pieces.coedges]]
    return result, np.flatnonzero(is_join & ~is_aligned & is_long)


def _cover(prepared: PreparedBrep, poles: Ints, joins: Ints, speeds: FloatArray) -> list[EdgeNets]:
    """Points that cover the images of coedges `poles` and of pieces `joins`."""
    pieces, places = prepared.regions.tree.pieces, prepared.regions.places
    of_poles = np.flatnonzero(np.isin(pieces.coedges, poles) & (pieces.spans != JOIN))
    chosen = np.concatenate([of_poles, joins])
    if not len(chosen):
        return []
    face = prepared.coedge_faces[pieces.coedges[chosen]]
    boxes = pieces.boxes[:, chosen]
    middles = ((boxes[:2] + boxes[2:]) / 2).T
    more = (ROUNDING + SLIVERS) * prepared.regions.margins[face]
    reach = (boxes[2:] - boxes[:2]).max(axis=0) / 2 + more
    points = prepared.surfaces.evaluate(face, places.to_parameters(face, middles))
    none, zero = np.full(len(chosen), -1), np.zeros(len(chosen))
    rows = EdgeRows(none, zero, zero, reach * speeds[face], none, face, np.zeros(len(chosen), bool))
    values = np.repeat(points[:, :, np.newaxis], 2, axis=2)
    return [EdgeNets(rows, *center_curves(values))]


def center_curves(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The nets (M, 3 or 4, n+1) of pieces of curves about their middles: fields of `EdgeNets`."""
    points = project(values)
    low, high = points.min(axis=2), points.max(axis=2)
    middles = low + (high - low) / 2
    sizes = np.abs(points - middles[:, :, np.newaxis]).max(axis=(1, 2))
    largest = np.abs(points).max(axis=(1, 2))
    weights = values[:, 3:] if values.shape[1] == 4 else 1.0
    centered = values.copy()
    centered[:, :3] -= middles[:, :, np.newaxis] * weights
    degree = values.shape[2] - 1
    errors = EXTENT_ERROR * 2 * sizes + (COORDINATE_ERROR + 8 * UNIT * (degree + 4)) * largest
    return centered[..., np.newaxis], middles.T.copy(), sizes, errors
