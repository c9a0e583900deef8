"""Slivers: rectangles of places that contain what is between parameter curves and their segments.

Let a side of a polygon run from A to B, and let the piece of its parameter curve, with the straight
line to the next coedge, have the control points P_i. If these advance monotonically along A → B,
the curve is a graph over the line, and only what is on its right can be in the region and outside
of the polygon. Then the sliver is a rectangle from A → B to the right, that contains all P_i there.
Otherwise it contains all P_i.

Proof in docs/proofs.md: "The polygon of a trimmed face".
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.borders.border import Border
from service.engine.brep.borders.convex import clip_to_square, list_fans
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE
from service.engine.vectors import Items, length, project

PARTS = 4
"""Pieces of parameter curves are cut into this number of parts, so that rectangles become lower."""

NOISE = 2.0**-10
"""Units of places; points of parameter curves are computed with a smaller error."""

MARGIN = 2.0
"""Rectangles are larger by this number of units on all sides, so that they may be rounded."""


@dataclass(frozen=True, eq=False, slots=True)
class Slivers(Items):
    """q triangles of places that together cover the slivers of some sides.

    Attributes
    ----------
    owners : ndarray of int, shape (q,)
        The row of the side that each belongs to, in ascending order.
    corners : ndarray of int, shape (3, 2, q)
    """

    owners: Ints
    corners: Ints


@dataclass(frozen=True, eq=False, slots=True)
class _Frames:
    """Sides as lines from A in the direction T, a unit vector; the extents of the curves there.

    Attributes
    ----------
    origins, tangents : ndarray of float64, shape (m, 2)
    low, high : ndarray of float64, shape (m,)
        Least and greatest distance along T, of the side and of control points.
    right, left : ndarray of float64, shape (m,)
        Greatest distance of control points to each side; at least 0.
    is_graph : ndarray of bool, shape (m,)
        Whether control points advance monotonically along T.
    """

    origins: FloatArray
    tangents: FloatArray
    low: FloatArray
    high: FloatArray
    right: FloatArray
    left: FloatArray
    is_graph: Bools


def find_slivers(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, sides: Ints, *, inner: bool
) -> Slivers:
    """Triangles that cover the slivers of sides (m,); owners are rows of `sides`.

    Parameters
    ----------
    inner : bool
        Whether what is asked for is not the region outside of the polygon, but the polygon outside
        of the region: rectangles on the left.
    """
    rows = _find_curved(prepared, border, sides).nonzero()[0]
    frames = _measure_extents(prepared, samples, border, sides[rows])
    near, far = (frames.left, frames.right) if inner else (frames.right, frames.left)
    far = np.where(frames.is_graph, 0.0, far)
    high = (np.maximum(near, far) > NOISE).nonzero()[0]
    if not len(high):
        return Slivers(high, np.empty((3, 2, 0), np.intp))
    tangents = frames.tangents[high]
    across = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    if inner:
        across = -across
    sides_of_rectangle = frames.low[high] - MARGIN, frames.high[high] + MARGIN
    heights = near[high] + MARGIN, -far[high] - MARGIN
    corners = [
        frames.origins[high] + x[:, np.newaxis] * tangents + y[:, np.newaxis] * across
        for x, y in zip(
            (*sides_of_rectangle, *sides_of_rectangle[::-1]),
            (heights[1], heights[1], heights[0], heights[0]),
            strict=True,
        )
    ]
    # Counter-clockwise in both cases.
    polygons = np.stack(corners[::-1] if not inner else corners, axis=1)
    # Planes have no ends; other surfaces are only known inside of the box.
    leaves = ((polygons < 0) | (polygons > SIZE)).any(axis=(1, 2))
    leaves &= ~prepared.surfaces.is_planar[border.faces[sides[rows[high]]]]
    inside, outside = (~leaves).nonzero()[0], leaves.nonzero()[0]
    number, triangles = list_fans(np.rint(polygons[inside]).astype(np.intp))
    slivers = Slivers(rows[high[inside[number]]], triangles)
    if not len(outside):
        return slivers
    clipped = np.rint(clip_to_square(polygons[outside], float(SIZE))).astype(np.intp)
    number, triangles = list_fans(clipped)
    slivers = Slivers.join([slivers, Slivers(rows[high[outside[number]]], triangles)])
    return slivers.take(slivers.owners.argsort(kind="stable"))


def measure_heights(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, sides: Ints
) -> FloatArray:
    """How far control points of parameter curves are from the sides (m,), in units of places."""
    heights = np.zeros(len(sides))
    rows = _find_curved(prepared, border, sides).nonzero()[0]
    frames = _measure_extents(prepared, samples, border, sides[rows])
    heights[rows] = np.maximum(frames.right, frames.left)
    return heights


def _find_curved(prepared: PreparedBrep, border: Border, sides: Ints) -> Bools:
    """Which sides (m,) need a sliver: all but those of straight parameter curves.

    The last side of a straight one may need it, where the next coedge begins elsewhere.
    """
    coedges = border.coedges[sides]
    curved = (prepared.pcurves.degree > 1) | (prepared.pcurves.span_count > 1)
    is_last = border.coedges[border.nexts[sides]] != coedges
    is_last |= border.nexts[sides] <= sides
    is_reversed = prepared.coedge_reversed[coedges]
    own_end = np.where(is_reversed, border.offsets[coedges], border.offsets[coedges + 1] - 1)
    next_row = border.rows[border.nexts[sides]]
    apart = np.abs(border.places[own_end] - border.places[next_row]).max(axis=1) > NOISE
    found: Bools = curved[coedges] | (is_last & apart)
    return found


def _measure_extents(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, sides: Ints
) -> _Frames:
    """The frames of sides (m,)."""
    begins = np.clip(border.places[border.rows[sides]], 0.0, SIZE)
    ends = np.clip(border.places[border.rows[border.nexts[sides]]], 0.0, SIZE)
    chord = ends - begins
    lengths = length(chord, -1)
    tangents = chord / np.where(lengths > 0, lengths, 1.0)[:, np.newaxis]
    tangents[lengths == 0] = 1.0, 0.0
    is_reversed = prepared.coedge_reversed[border.coedges[sides]]
    low, high = np.zeros(len(sides)), lengths.copy()
    right, left, is_graph = np.zeros(len(sides)), np.zeros(len(sides)), lengths > 0
    # What the curve has come to along T, for its first and for its last point.
    first, last = np.full((2, len(sides)), np.nan)
    for owner, points in _list_control_points(prepared, samples, border, sides):
        relative = points - begins[owner][:, np.newaxis]
        tangent = tangents[owner][:, np.newaxis]
        along = relative[..., 0] * tangent[..., 0] + relative[..., 1] * tangent[..., 1]
        to_right = relative[..., 0] * tangent[..., 1] - relative[..., 1] * tangent[..., 0]
        np.minimum.at(low, owner, along.min(axis=1))
        np.maximum.at(high, owner, along.max(axis=1))
        np.maximum.at(right, owner, to_right.max(axis=1))
        np.maximum.at(left, owner, -to_right.min(axis=1))
        steps = np.where(is_reversed[owner], -1.0, 1.0)[:, np.newaxis] * np.diff(along, axis=1)
        turns = np.zeros(len(sides), bool)
        turns[owner[(steps < -NOISE).any(axis=1)]] = True
        is_graph &= ~turns
        np.fmin.at(first, owner, np.minimum(along[:, 0], along[:, -1]))
        np.fmax.at(last, owner, np.maximum(along[:, 0], along[:, -1]))
    # The lines from A to the curve, and from the curve to B.
    is_graph &= (first >= -NOISE) & (last <= lengths + NOISE)
    return _Frames(begins, tangents, low, high, right, left, is_graph)


def _list_control_points(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, sides: Ints
) -> Iterator[tuple[Ints, FloatArray]]:
    """Rows of `sides` (r,) and control points (r, n+1, 2) of the parts of their pieces."""
    piece = border.samples[sides].repeat(PARTS)
    part = np.arange(PARTS * len(sides)) % PARTS
    begin = samples.parameters[piece]
    width = samples.parameters[piece + 1] - begin
    low = begin + width * (part / PARTS)
    high = np.append(low[1:], 0.0)
    high[PARTS - 1 :: PARTS] = samples.parameters[piece[PARTS - 1 :: PARTS] + 1]
    intervals = prepared.pcurves.cut(border.coedges[sides].repeat(PARTS), low, high)
    owner = intervals.source // PARTS
    for rows, nets in prepared.pcurves.restrict(intervals):
        yield owner[rows], project(nets, -1, 2)
