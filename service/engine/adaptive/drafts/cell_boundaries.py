"""The boundaries of leaves: the polygon of each, through all vertices around it.

Leaves are cut freely, but the border is fixed. A leaf may have a corner on a side of its face where
the border has no vertex: such a corner is lifted, straight into the face, by a share of the least
height of the leaves that touch that segment [a, b] of the border. All corners on one segment are
lifted equally, and by less than the height of any leaf there. So every leaf is still a convex
polygon, through all vertices on its boundary, and between a, b and the lifted corners c1 … ck there
is a strip: a trapezoid, or a triangle if k = 1.

On a side that is one point all corners are that vertex, at different places.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs
from service.bases.unique_rows import unique_values
from service.engine.adaptive.borders.border import BorderPlaces
from service.engine.adaptive.cutting.cells import Cells, Leaves
from service.engine.adaptive.limits import build_depth_error
from service.engine.bounds.faces import SPAN

LIFT = 4
"""A corner is lifted by the least height divided by this."""

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
        Samples, in the order of face, u, v. Vertices of the border first, then the others.
    vertices : int
        Number of vertices.
    start : ndarray of int, shape (L+1,)
        Polygon k has the samples `corner[start[k] : start[k+1]]`, counter-clockwise from the one
        nearest to (0, 0); the last sample of a fan is its middle.
    corner : ndarray of int
    plain : ndarray of bool, shape (L,)
        Leaves that are no fan and whose polygon has only their four corners.
    segment : ndarray of int, shape (K,)
        Entry of the border at which the segment of each lifted corner begins, rising.
    lifted : ndarray of int, shape (K,)
        The lifted corners, along their sides.
    ends : ndarray of int, shape (2, K)
        The ends a and b of the segment of each.
    polar : ndarray of bool, shape (2, K)
        Whether the end belongs to a side that is one point.
    turned : ndarray of bool, shape (K,)
        Whether (a, b, c), not (a, c, b), is counter-clockwise.
    entry : ndarray of int, shape (M,)
        The sample of each entry of the border.
    touching : ndarray of int, shape (2, E)
        Segments of the border, and leaves that have a corner inside them or at one of their ends.
    """

    face: Ints
    u: Ints
    v: Ints
    vertex: Ints
    vertices: int
    start: Ints
    corner: Ints
    plain: Bools
    segment: Ints
    lifted: Ints
    ends: Ints
    polar: Bools
    turned: Bools
    entry: Ints
    touching: Ints


def trace_boundaries(
    border_places: BorderPlaces, leaves: Leaves, flattened: Ints
) -> CellBoundaries:
    """The boundaries of leaves that cover faces, or a part of them, without overlap.

    Parameters
    ----------
    flattened : ndarray of int, shape (M,)
        Number of halvings of the strip over the segment after each entry of the border.
    """
    count, border, fan = len(leaves), border_places.border, leaves.is_fan.nonzero()[0]
    places, vertex = leaves.box[CORNER_ROWS], np.full((4, count), -1)
    corner, number, segment, touching = _lift(border_places, leaves, flattened, (places, vertex))
    u0, u1, v0, v1 = leaves.box.take(fan, axis=1)
    face = np.concatenate([*[leaves.face] * 4, border_places.side // 4, leaves.face[fan]])
    u = np.concatenate([places[0].ravel(), border_places.u, (u0 + u1) // 2])
    v = np.concatenate([places[1].ravel(), border_places.v, (v0 + v1) // 2])
    del places
    # Lines of all faces get different numbers, which are then replaced by their ranks.
    low_u, low_v = border_places.low
    lines_u, rank_u = _rank(low_u[face] + u)
    lines_v, rank_v = _rank(low_v[face] + v)
    many_u, many_v = len(lines_u), len(lines_v)
    # Arrays with four entries for each leaf are large: they are deleted as soon as possible.
    first, sample = unique_values(rank_u * many_v + rank_v)
    face, u, v = face[first], u[first], v[first]
    rank_u, rank_v = rank_u[first], rank_v[first]
    by_u, by_v = rank_u * many_v + rank_v, rank_v * many_u + rank_u
    point_number = np.full(len(first), -1)
    on_border = np.concatenate([vertex.ravel(), border.vertex])
    point_number[sample[: len(on_border)][on_border >= 0]] = on_border[on_border >= 0]
    del on_border, vertex, rank_u, rank_v
    fresh = (point_number < 0).nonzero()[0]
    point_number[fresh] = len(border.points) + np.arange(len(fresh))
    lifted = sample[corner * count + number]
    entry = sample[4 * count : len(sample) - len(fan)].copy()
    middle = np.zeros((2, count), dtype=np.intp)
    middle[0, fan] = sample[len(sample) - len(fan) :]
    middle[1] = middle[0] + leaves.is_fan
    del sample
    order = by_v.argsort()
    by_v = by_v[order]
    begin_u, end_u = lines_u.searchsorted(low_u[leaves.face] + leaves.box[:2])
    begin_v, end_v = lines_v.searchsorted(low_v[leaves.face] + leaves.box[2:])
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
    plain = start[1:] - start[:-1] == 4
    plain[number] = False
    # Neighbouring leaves may share a lifted corner.
    pairs = segment * len(first) + lifted
    pairs = pairs[unique_values(pairs)[0]]
    segment, lift = pairs // len(first), pairs % len(first)
    ends, s = np.array([segment, segment + 1]), border_places.side[segment] % 4
    return CellBoundaries(
        face,
        u,
        v,
        point_number,
        len(border.points) + len(fresh),
        start,
        corners,
        plain,
        segment,
        lift,
        entry[ends],
        border_places.pole[border.vertex[ends]],
        (s == 1) | (s == 2),
        entry,
        touching,
    )


def _rank(values: Ints) -> tuple[Ints, Ints]:
    """Distinct values, rising, and the rank of each value."""
    first, number = unique_values(values)
    return values[first], number


def _lift(
    border_places: BorderPlaces, cells: Cells, flattened: Ints, corners: tuple[Ints, Ints]
) -> tuple[Ints, Ints, Ints, Ints]:
    """Lift corners of leaves that are on the border but not at a vertex of it.

    Parameters
    ----------
    corners : ndarrays of int, shapes (2, 4, L) and (4, L)
        Places u and v, and vertices, of the corners of all leaves. Both are changed: places of
        lifted corners, and vertices of corners at a vertex of the border.

    Returns
    -------
    corner, leaf, segment : ndarray of int, shape (k,)
        The corners that were lifted, and the entries of the border before them.
    touching : ndarray of int, shape (2, E)
        See `CellBoundaries`.
    """
    (places, vertex), box, border = corners, cells.box, border_places.border
    limits = np.zeros((len(border_places.faces.spans), 4), dtype=np.intp)
    limits[:, 1::2] = border_places.faces.spans * SPAN
    # A leaf is at side k of its face if row k of its box is equal to that of the face.
    lying, leaf = (box == limits[cells.face].T).nonzero()
    side = 4 * cells.face[leaf] + lying
    collapsed = border.collapsed.ravel()[side]
    if collapsed.any():
        point = CORNERS[lying[collapsed]].T, leaf[collapsed]
        vertex[point] = border.vertex[border.start[side[collapsed]]]
        lying, leaf, side = lying[~collapsed], leaf[~collapsed], side[~collapsed]
    across = lying - lying % 2
    along = np.array([2 - across, 3 - across])
    key = border_places.base[side] + box[along, leaf]
    entry = border_places.key.searchsorted(key, "right") - 1
    exact = border_places.key[entry] == key
    corner, both = CORNERS[lying].T, np.array([leaf, leaf])
    vertex[corner[exact], both[exact]] = border.vertex[entry[exact]]
    segment = entry.copy()
    segment[1] -= exact[1]
    touching = np.array([segment.ravel(), both.ravel()])
    free = (~exact).nonzero()
    corner, lifted, entry = corner[free], both[free], entry[free]
    if len(lifted):
        least = np.full(len(border_places.key), np.iinfo(np.intp).max)
        height = box[across + 1, leaf] - box[across, leaf]
        np.minimum.at(least, touching[0], np.concatenate([height, height]))
        depth = (least[entry] // LIFT) >> flattened[entry]
        if depth.min() < 1:
            raise build_depth_error()
        side = lying[free[1]]
        places[side // 2, corner, lifted] += np.where(side % 2 == 1, -depth, depth)
    return corner, lifted, entry, touching


def _chain_polygons(runs: Ints, order: Ints) -> tuple[Ints, Ints]:
    """Polygons from the beginnings and ends (5, 2, L) of runs of sorted samples.

    The runs are those on the sides below, right, above and left, and the middle of a fan. Samples
    are sorted by v, in `order`, for those below and above, and by u for those on the right and on
    the left. They are taken in rising order below and on the right, in falling order above and on
    the left.
    """
    # Leaf after leaf.
    first, end = runs.transpose(1, 2, 0).reshape(2, -1)
    count = end - first
    run, rising = expand_runs(count, first)
    side = run % 5
    place = np.where(side < 2, rising, (first + end - 1)[run] - rising)
    start = np.zeros(len(count) // 5 + 1, dtype=np.intp)
    start[1:] = np.cumsum(count)[4::5]
    return start, np.where((side == 0) | (side == 2), order[place], place)
