"""Points inside faces: corners of the leaves of the engine's cells, away from borders.

Leaves are estimated to be near enough to two triangles (`service.engine.adaptive.cutting`), so most
triangles between their corners need no further point.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, mark_begins, row_slices
from service.engine.adaptive.cutting.cells import FaceCells, Leaves, Task
from service.engine.adaptive.cutting.subdivision import AHEAD, divide_cells
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.box_pairs import BoxTree
from service.engine.trims.places import Places

NEAR = 0.4
"""Points nearer to the border than this share of their leaf are left out."""

FEW = 8
"""Faces of one span in one direction, and up to this many in the other, begin as cells of one span
each: cells of several spans cost more to estimate."""

LEAST = 64
"""The least extent of a cell to begin with, in units of `SPAN`; smaller ones become one span."""

CHUNK = 1 << 11
"""Points that are compared with segments in one step; it limits memory."""

EXACT = 1 << 33
"""Places up to this size times `SPAN` are exact in 64 bits."""


@dataclass(frozen=True, eq=False, slots=True)
class LeafPoints:
    """m corners of leaves, sorted by face and place; one for each place.

    Attributes
    ----------
    faces : ndarray of int, shape (m,)
    places : ndarray of int, shape (m, 2)
    sizes : ndarray of float64, shape (m, 2)
        The least sides of the leaves at each place.
    cells : ndarray of float64, shape (F, 2)
        Means of the sides of the leaves of all faces; those of the box where there are no leaves.
    """

    faces: Ints
    places: Ints
    sizes: FloatArray
    cells: FloatArray

    def take(self, rows: Ints | Bools) -> "LeafPoints":
        """Some of the points."""
        return LeafPoints(self.faces[rows], self.places[rows], self.sizes[rows], self.cells)


def find_leaf_points(
    surface: Places, faces: Ints, boxes: tuple[Ints, Ints], goal: Goal, limits: MeshLimits
) -> LeafPoints:
    """Corners of the leaves of faces (m,).

    Parameters
    ----------
    faces : ndarray of int, shape (m,)
    boxes : pair of ndarray of int, shape (F, 2)
        The least and the greatest places of the polygons of all faces.

    Raises
    ------
    TooLarge, InvalidRequest
        The errors of `divide_cells`.
    """
    low, high = boxes
    means = np.maximum((high - low).astype(np.float64), 1.0)
    if not len(faces):
        none = np.empty((0, 2))
        return LeafPoints(faces, none.astype(np.intp), none, means)
    cells = _build_cells(surface, faces, low[faces], high[faces])
    task = Task(surface.surfaces.nets, surface.faces, goal, limits)
    leaves = divide_cells(task, cells, AHEAD)
    sides = _to_places(surface, leaves)
    if surface.has_skipped_spans:
        proper = np.flatnonzero((sides[::2] < sides[1::2]).all(axis=0))
        leaves, sides = leaves.take(proper), sides.take(proper, axis=1)
    (u0, u1, v0, v1), extents = sides, sides[1::2] - sides[::2]
    # The means of the logarithms of sides, weighted by area.
    area = extents[0] * extents[1]
    total = np.bincount(leaves.face, area, minlength=len(low))
    has_leaves = total > 0
    for axis in (0, 1):
        logs = np.bincount(leaves.face, np.log(extents[axis]) * area, minlength=len(low))
        means[has_leaves, axis] = np.exp(logs[has_leaves] / total[has_leaves])
    fans = leaves.is_fan.nonzero()[0]
    u = np.concatenate([u0, u0, u1, u1, (u0 + u1)[fans] / 2])
    v = np.concatenate([v0, v1, v0, v1, (v0 + v1)[fans] / 2])
    sizes = np.concatenate([*[extents] * 4, extents[:, fans] / 2], axis=1).T
    owners = np.concatenate([*[leaves.face] * 4, leaves.face[fans]])
    places = np.rint(np.stack([u, v], axis=1)).astype(np.intp)
    return _join_equal(LeafPoints(owners, places, sizes, means))


def find_points_inside(points: LeafPoints, border: Polygons, boxes: tuple[Ints, Ints]) -> Bools:
    """Which points are inside the boxes of polygons, and further than `NEAR` from all segments."""
    own_low, own_high = (box[points.faces] for box in boxes)
    inside: Bools = np.all((points.places > own_low) & (points.places < own_high), axis=1)
    rows = inside.nonzero()[0]
    inside[rows] = _are_far(points.take(rows), border)
    return inside


def _build_cells(surface: Places, faces: Ints, low: Ints, high: Ints) -> FaceCells:
    """Cells about the boxes of faces, in units of 1 / SPAN of their spans."""
    rectangle = np.empty((4, len(faces)), np.intp)
    for axis in (0, 1):
        begin, end = surface.find_spans(faces, axis, low[:, axis], high[:, axis])
        first, last = surface.knots_at(faces, axis, begin)
        width, ends = last - first, np.array([low[:, axis], high[:, axis]]) - first
        small = np.abs(ends).max(axis=0) < EXACT
        exact = np.where(small, ends, 0)
        inner_low = np.where(small, exact[0] * SPAN // width, np.floor(ends[0] / width * SPAN))
        inner_high = np.where(small, -(-exact[1] * SPAN // width), np.ceil(ends[1] / width * SPAN))
        inner_low, inner_high = np.maximum(inner_low, 0), np.minimum(inner_high, SPAN)
        whole = (end > begin) | (inner_high - inner_low < LEAST)
        rectangle[2 * axis] = begin * SPAN + np.where(whole, 0, inner_low)
        rectangle[2 * axis + 1] = np.where(whole, (end + 1) * SPAN, begin * SPAN + inner_high)
    return _separate_spans(FaceCells(rectangle, faces))


def _separate_spans(cells: FaceCells) -> FaceCells:
    """Cells with `FEW` spans in one direction, and one in the other, as one cell for each span."""
    spans = -(-cells.extents // SPAN)
    few = (spans.max(axis=0) > 1) & (spans.min(axis=0) == 1) & (spans.max(axis=0) <= FEW)
    rows = few.nonzero()[0]
    if not len(rows):
        return cells
    along_v = spans[1, rows] > 1
    run, number = expand_runs(spans[:, rows].max(axis=0))
    parts, axis = cells.take(rows[run]), along_v[run].astype(np.intp)
    column = np.arange(len(run))
    begin = parts.rectangle[2 * axis, column] + number * SPAN
    parts.rectangle[2 * axis, column], parts.rectangle[2 * axis + 1, column] = begin, begin + SPAN
    return FaceCells.join([cells.take(~few), parts])


def _to_places(surface: Places, leaves: Leaves) -> FloatArray:
    """The ends (4, m) of leaves as places, not rounded."""
    sides = np.empty(leaves.rectangle.shape)
    for row, ends in enumerate(leaves.rectangle):
        axis = row // 2
        span = np.minimum(ends // SPAN, surface.faces.spans[axis, leaves.face] - 1)
        first, last = surface.knots_at(leaves.face, axis, span)
        sides[row] = (last - first) / SPAN * (ends - span * SPAN) + first
    return sides


def _join_equal(points: LeafPoints) -> LeafPoints:
    """The points, sorted, with one for each place: it has the least size."""
    order = np.lexsort((points.places[:, 1], points.places[:, 0], points.faces))
    points = points.take(order)
    is_first = mark_begins(points.faces)
    is_first[1:] |= (points.places[1:] != points.places[:-1]).any(axis=1)
    begins = is_first.nonzero()[0]
    least = np.minimum.reduceat(points.sizes, begins)
    return LeafPoints(points.faces[begins], points.places[begins], least, points.cells)


def _are_far(points: LeafPoints, border: Polygons) -> Bools:
    """Which points are further than `NEAR` times their size from all segments of their faces."""
    far = np.ones(len(points.faces), bool)
    begins, along = border.begins.astype(np.float64), (border.ends - border.begins).astype(float)
    tree = BoxTree.of(
        border.faces,
        np.minimum(border.begins, border.ends),
        np.maximum(border.begins, border.ends),
    )
    for rows in row_slices(len(far), 1, CHUNK):
        places, sizes = points.places[rows], points.sizes[rows]
        low = np.floor(places - NEAR * sizes).astype(np.intp)
        high = np.ceil(places + NEAR * sizes).astype(np.intp)
        point, segment = tree.find_pairs(points.faces[rows], low, high)
        size = sizes[point]
        to_begin, step = (begins[segment] - places[point]) / size, along[segment] / size
        squared = np.square(step).sum(axis=1)
        foot = -(to_begin * step).sum(axis=1) / np.where(squared > 0, squared, 1.0)
        nearest = to_begin + np.clip(foot, 0.0, 1.0)[:, np.newaxis] * step
        is_near = np.square(nearest).sum(axis=1) < NEAR * NEAR
        far[rows.start + point[is_near]] = False
    return far
