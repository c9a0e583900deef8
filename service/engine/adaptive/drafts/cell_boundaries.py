"""The boundaries of leaves: the polygon of each, through all vertices around it.

Leaves may be cut at any place, but the vertices of the border are fixed. A leaf may have a corner
inside a segment [a, b] of the border, where the border has no vertex. This corner is lifted: moved
into the face, at a right angle to the side, by a share of the least height of the leaves that touch
the segment. All corners on one segment are lifted equally, and by less than the height of any leaf
there. So every leaf is still a convex polygon, through all vertices on its boundary. Between a, b
and the lifted corners c1 … ck there is a strip: a trapezoid, or a triangle if k = 1.

On a side that is one point all corners are that vertex, at different places.

The *entries* of the border are its vertices side by side (`Border`). A segment of the border has
the number of the entry at its beginning.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs, unique_values
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import FaceCells, Leaves
from service.engine.adaptive.limits import build_depth_error
from service.engine.bounds.faces import SPAN

LIFT = 4
"""A corner is lifted by the least height of the leaves at its segment, divided by this and by 2 for
each halving of its strip. A leaf lifted at opposite sides keeps at least half its height."""

CORNERS = np.array([[0, 3], [1, 2], [0, 1], [3, 2]])
"""Corners at both ends of each side; corners are counted (0, 0), (1, 0), (1, 1), (0, 1)."""

CORNER_ROWS = np.array([[0, 1, 1, 0], [2, 2, 3, 3]])
"""Rows of a box that hold the places u and v of the corners."""


@dataclass(frozen=True, eq=False, slots=True)
class CellBoundaries:
    """Polygons of leaves, strips at the border, and the samples at their corners.

    Attributes
    ----------
    face, u, v, vertex : ndarray of int, shape (N,)
        Samples, in the order of face, u, v. The vertices of the border have the first numbers.
    start : ndarray of int, shape (L+1,)
        Polygon k has the samples `corner[start[k] : start[k+1]]`, counter-clockwise from the
        corner (0, 0) unless it is lifted; the last sample of a fan is its middle.
    corner : ndarray of int, shape (C,)
        Samples at the corners of all polygons.
    is_plain : ndarray of bool, shape (L,)
        Whether a leaf is not a fan and its polygon has only four corners, none of them lifted.
    segment : ndarray of int, shape (K,)
        The segment of the border with each lifted corner, in ascending order.
    lifted : ndarray of int, shape (K,)
        Samples at the lifted corners, in the order of places along their sides.
    ends : ndarray of int, shape (2, K)
        Samples at the ends a and b of the segment of each lifted corner.
    is_polar : ndarray of bool, shape (2, K)
        Whether the end belongs to a side that is one point.
    turns_left : ndarray of bool, shape (K,)
        Whether (a, b, c) is counter-clockwise, for the lifted corner c.
    entry : ndarray of int, shape (M,)
        The sample of each entry of the border.
    touching : ndarray of int, shape (2, E)
        Pairs of a segment of the border and a leaf with a corner inside it or at one of its ends.
    """

    face: Ints
    u: Ints
    v: Ints
    vertex: Ints
    start: Ints
    corner: Ints
    is_plain: Bools
    segment: Ints
    lifted: Ints
    ends: Ints
    is_polar: Bools
    turns_left: Bools
    entry: Ints
    touching: Ints


def trace_boundaries(border: Border, leaves: Leaves, halvings: Ints) -> CellBoundaries:
    """The boundaries of leaves that cover faces, or a part of them, without overlap.

    `halvings` (M,) has the number of halvings of the height of the strip after each entry of the
    border.
    """
    count, fan = len(leaves), leaves.is_fan.nonzero()[0]
    # Places (2, 4, L) and vertices (4, L) of the corners of leaves; −1 stands for a new vertex.
    places, vertex = leaves.rectangle[CORNER_ROWS], np.full((4, count), -1)
    corner, leaf, segment, touching = _lift(border, leaves, halvings, (places, vertex))
    u0, u1, v0, v1 = leaves.rectangle.take(fan, axis=1)
    face = np.concatenate([*[leaves.face] * 4, border.side // 4, leaves.face[fan]])
    u = np.concatenate([places[0].ravel(), border.u, (u0 + u1) // 2])
    v = np.concatenate([places[1].ravel(), border.v, (v0 + v1) // 2])
    del places
    # Each line of constant u, or of constant v, of each face gets a number of its own; the numbers
    # are replaced by their ranks.
    low_u, low_v = border.low
    lines_u, rank_u = _rank(low_u[face] + u)
    lines_v, rank_v = _rank(low_v[face] + v)
    many_u, many_v = len(lines_u), len(lines_v)
    # Arrays with four entries for each leaf are large: they are deleted as soon as possible.
    first, sample = unique_values(rank_u * many_v + rank_v)
    face, u, v = face[first], u[first], v[first]
    rank_u, rank_v = rank_u[first], rank_v[first]
    # Numbers that sort the samples by u, then v; and by v, then u.
    by_u, by_v = rank_u * many_v + rank_v, rank_v * many_u + rank_u
    point_number = np.full(len(first), -1)
    on_border = np.concatenate([vertex.ravel(), border.vertex])
    point_number[sample[: len(on_border)][on_border >= 0]] = on_border[on_border >= 0]
    del on_border, vertex, rank_u, rank_v
    fresh = (point_number < 0).nonzero()[0]
    point_number[fresh] = len(border.points) + np.arange(len(fresh))
    lifted = sample[corner * count + leaf]
    entry = sample[4 * count : len(sample) - len(fan)].copy()
    # Begin and end of a run of one sample, the middle of a fan; empty for other leaves.
    middle = np.zeros((2, count), dtype=np.intp)
    middle[0, fan] = sample[len(sample) - len(fan) :]
    middle[1] = middle[0] + leaves.is_fan
    del sample
    order = by_v.argsort()
    by_v = by_v[order]
    begin_u, end_u = lines_u.searchsorted(low_u[leaves.face] + leaves.rectangle[:2])
    begin_v, end_v = lines_v.searchsorted(low_v[leaves.face] + leaves.rectangle[2:])
    # The runs of samples along each side: below with both corners, on the right and above without
    # the first, on the left with none. A lifted corner is not on its line; it is in the run of the
    # other side that it ends.
    below, above = begin_v * many_u, end_v * many_u
    before, after = begin_u * many_v, end_u * many_v
    runs = [
        (by_v.searchsorted(below + begin_u), by_v.searchsorted(below + end_u, "right")),
        (by_u.searchsorted(after + begin_v, "right"), by_u.searchsorted(after + end_v, "right")),
        (by_v.searchsorted(above + begin_u), by_v.searchsorted(above + end_u)),
        (by_u.searchsorted(before + begin_v, "right"), by_u.searchsorted(before + end_v)),
        middle,
    ]
    start, corners = _chain_polygons(np.array(runs), order)
    is_plain = start[1:] - start[:-1] == 4
    is_plain[leaf] = False
    # Neighbouring leaves may share a lifted corner.
    pairs = segment * len(first) + lifted
    pairs = pairs[unique_values(pairs)[0]]
    segment, lifted = pairs // len(first), pairs % len(first)
    # The face is to the left of a segment on side 1 or 2, to the right on the others.
    ends, s = np.array([segment, segment + 1]), border.side[segment] % 4
    return CellBoundaries(
        face,
        u,
        v,
        point_number,
        start,
        corners,
        is_plain,
        segment,
        lifted,
        entry[ends],
        border.is_pole[border.vertex[ends]],
        (s == 1) | (s == 2),
        entry,
        touching,
    )


def _rank(values: Ints) -> tuple[Ints, Ints]:
    """Distinct values in ascending order, and the rank of each value."""
    first, number = unique_values(values)
    return values[first], number


def _lift(
    border: Border, cells: FaceCells, halvings: Ints, corners: tuple[Ints, Ints]
) -> tuple[Ints, Ints, Ints, Ints]:
    """Lift corners of leaves that are on the border, but not at a vertex of the border.

    Parameters
    ----------
    corners : ndarrays of int, shapes (2, 4, L) and (4, L)
        Places u and v, and vertices, of the corners of all leaves. Both arrays change: the places
        of lifted corners, and the vertices of corners at a vertex of the border.

    Returns
    -------
    corner, leaf, segment : ndarray of int, shape (k,)
        The lifted corners, their leaves and their segments.
    touching : ndarray of int, shape (2, E)
        See `CellBoundaries`.
    """
    (places, vertex), box = corners, cells.rectangle
    face_boxes = np.zeros((4, len(border.faces.first)), dtype=np.intp)
    face_boxes[1::2] = border.faces.spans * SPAN
    # A leaf is at side s of its face if row s of its box is equal to that of the face.
    s, leaf = (box == face_boxes.take(cells.face, axis=1)).nonzero()
    side = 4 * cells.face[leaf] + s
    collapsed = border.collapsed.ravel()[side]
    if collapsed.any():
        point = CORNERS[s[collapsed]].T, leaf[collapsed]
        vertex[point] = border.vertex[border.start[side[collapsed]]]
        s, leaf, side = s[~collapsed], leaf[~collapsed], side[~collapsed]
    # Rows of the box: across the side, and those of both ends along it.
    across = s - s % 2
    key = border.base[side] + box[np.array([2 - across, 3 - across]), leaf]
    entry = border.key.searchsorted(key, "right") - 1
    exact = border.key[entry] == key
    # Both ends of each side of a leaf on the border: shape (2, sides).
    corner, end_leaf = CORNERS[s].T, np.array([leaf, leaf])
    vertex[corner[exact], end_leaf[exact]] = border.vertex[entry[exact]]
    segment = entry.copy()
    # Where the second end of a side of a leaf is a vertex, the side touches the segment before it.
    segment[1] -= exact[1]
    touching = np.array([segment.ravel(), end_leaf.ravel()])
    free = (~exact).nonzero()
    corner, lifted, entry = corner[free], end_leaf[free], entry[free]
    if len(lifted):
        least = np.full(len(border.key), np.iinfo(np.intp).max)
        height = box[across + 1, leaf] - box[across, leaf]
        np.minimum.at(least, touching[0], np.concatenate([height, height]))
        lift = (least[entry] // LIFT) >> halvings[entry]
        if lift.min() < 1:
            raise build_depth_error()
        s = s[free[1]]
        places[s // 2, corner, lifted] += np.where(s % 2 == 1, -lift, lift)
    return corner, lifted, entry, touching


def _chain_polygons(runs: Ints, order: Ints) -> tuple[Ints, Ints]:
    """`start` and `corner` of `CellBoundaries`, from runs of sorted samples.

    The rows of `runs` (5, 2, L) are the beginnings and ends of the runs of samples below, to the
    right, above and to the left of each leaf, and in the middle of a fan. For the runs below and
    above, samples are sorted by v; `order` is this order. For the other runs they are sorted by u.
    Samples are listed in ascending order below and on the right, and in descending order above and
    on the left.
    """
    first, end = runs.transpose(1, 2, 0).reshape(2, -1)
    count = end - first
    run, rising = expand_runs(count, first)
    side = run % 5
    index = np.where(side < 2, rising, (first + end - 1)[run] - rising)
    start = np.zeros(len(count) // 5 + 1, dtype=np.intp)
    start[1:] = np.cumsum(count)[4::5]
    return start, np.where((side == 0) | (side == 2), order[index], index)
