"""What the leaves look like from outside: which vertices each of them has, all around.

Leaves are free, borders are not. A leaf may have a corner on a side of its face where the border
has no vertex: such a corner is lifted, straight into the face, by a share of the least height of
the leaves that touch that segment [a, b] of the border. All corners of one segment are lifted
equally, and by less than any leaf there is high. So every leaf is a convex polygon still, through
all vertices on its outline, and between a, b and the lifted corners c1 … ck there is a strip: a
trapezoid, or a triangle if k = 1.

On a side that is one point all corners are that vertex, at places of their own.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.boxes import Cells
from service.engine.adaptive.limits import too_deep
from service.engine.bounds.faces import SPAN, Faces

LIFT = 4
"""A corner is lifted by the least height over this."""

CORNERS = np.array([[0, 3], [1, 2], [0, 1], [3, 2]])
"""Corners at both ends of each side; corners are counted (0, 0), (1, 0), (1, 1), (0, 1)."""

CORNER_ROWS = np.array([[0, 1, 1, 0], [2, 2, 3, 3]])
"""Rows of a box in which the corners' places are."""


@dataclass(frozen=True, eq=False, slots=True)
class Outline:
    """Samples, and the polygons and strips that they are the corners of.

    Attributes
    ----------
    face, u, v, vertex : ndarray of int, shape (N,)
        Samples, in the order of face, u, v. Vertices of the border first, then the others.
    vertices : int
        How many.
    start : ndarray of int, shape (L+1,)
        Polygon k has the samples `corner[start[k] : start[k+1]]`, counter-clockwise from the one
        nearest to (0, 0).
    corner : ndarray of int
    plain : ndarray of bool, shape (L,)
        Leaves that have their own four corners and nothing else.
    segment : ndarray of int, shape (K,)
        Entry of the border at which the segment of each lifted corner begins, rising;
    lifted : ndarray of int, shape (K,)
        those corners, along their sides;
    ends : ndarray of int, shape (2, K)
        a and b;
    polar : ndarray of bool, shape (2, K)
        whether a side that is one point ends there;
    turned : ndarray of bool, shape (K,)
        whether (a, b, c), not (a, c, b), is counter-clockwise.
    entry : ndarray of int, shape (M,)
        The sample that each entry of the border is.
    touching : ndarray of int, shape (2, E)
        Segments, and leaves that have a corner in them or at an end of theirs.
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


def outlined(faces: Faces, border: Border, cells: Cells, flattened: Ints) -> Outline:
    """The outline of leaves, that cover the faces without gap or overlap.

    Parameters
    ----------
    flattened : ndarray of int, shape (M,)
        How often the strip over the segment after each entry of the border was halved.
    """
    count = len(cells)
    places, vertex = cells.box[CORNER_ROWS], np.full((4, count), -1)
    corner, number, segment, touching = _lift(faces, border, cells, flattened, (places, vertex))
    side = np.repeat(np.arange(len(border.start) - 1), np.diff(border.start))
    at_u, at_v = _places(faces, side, border.at)
    face = np.concatenate([np.tile(cells.face, 4), side // 4])
    u, v = np.concatenate([places[0].ravel(), at_u]), np.concatenate([places[1].ravel(), at_v])
    # Whole numbers that tell lines of all faces apart, and then small ones, in the same order.
    low_u, low_v = (np.cumsum(n * SPAN + 1) - (n * SPAN + 1) for n in faces.spans.T)
    lines_u, rank_u = np.unique(low_u[face] + u, return_inverse=True)
    lines_v, rank_v = np.unique(low_v[face] + v, return_inverse=True)
    many_u, many_v = len(lines_u), len(lines_v)
    by_u, first, sample = np.unique(
        rank_u * many_v + rank_v, return_index=True, return_inverse=True
    )
    own = np.full(len(first), -1)
    known = np.concatenate([vertex.ravel(), border.vertex])
    own[sample[known >= 0]] = known[known >= 0]
    fresh = (own < 0).nonzero()[0]
    own[fresh] = len(border.points) + np.arange(len(fresh))
    by_v = rank_v[first] * many_u + rank_u[first]
    order = np.argsort(by_v)
    by_v = by_v[order]
    begin_u, end_u = np.searchsorted(lines_u, low_u[cells.face] + cells.box[:2])
    begin_v, end_v = np.searchsorted(lines_v, low_v[cells.face] + cells.box[2:])
    below, above = begin_v * many_u, end_v * many_u
    before, after = begin_u * many_v, end_u * many_v
    runs = [
        (by_v.searchsorted(below + begin_u), by_v.searchsorted(below + end_u, "right")),
        (by_u.searchsorted(after + begin_v, "right"), by_u.searchsorted(after + end_v, "right")),
        (by_v.searchsorted(above + begin_u), by_v.searchsorted(above + end_u)),
        (by_u.searchsorted(before + begin_v, "right"), by_u.searchsorted(before + end_v)),
    ]
    start, corners = _chained(np.array(runs), order)
    plain = np.diff(start) == 4
    plain[number] = False
    pairs = np.unique(segment * len(first) + sample[corner * count + number])
    segment, lift = pairs // len(first), pairs % len(first)
    entry = sample[4 * count :]
    ends = np.array([segment, segment + 1])
    return Outline(
        face[first],
        u[first],
        v[first],
        own,
        len(border.points) + len(fresh),
        start,
        corners,
        plain,
        segment,
        lift,
        entry[ends],
        np.isin(border.vertex[ends], border.vertex[border.start[:-1][border.collapsed.ravel()]]),
        np.isin(side[segment] % 4, (1, 2)),
        entry,
        touching,
    )


def _lift(
    faces: Faces, border: Border, cells: Cells, flattened: Ints, corners: tuple[Ints, Ints]
) -> tuple[Ints, Ints, Ints, Ints]:
    """Lift corners, in place, or tell which vertices of the border they are.

    Parameters
    ----------
    corners : ndarrays of int, shapes (2, 4, L) and (4, L)
        Their places u and v, and vertices.

    Returns
    -------
    corner, leaf, segment : ndarray of int, shape (k,)
        The corners that were lifted, and the entries of the border before them.
    touching : ndarray of int, shape (2, E)
        See `Outline`.
    """
    (places, vertex), box, spans = corners, cells.box, faces.spans * SPAN
    limits = np.zeros((len(spans), 4), dtype=np.intp)
    limits[:, 1::2] = spans
    # Rows of a box are named as the sides of a face that they may be.
    lying, leaf = (box == limits[cells.face].T).nonzero()
    collapsed = border.collapsed[cells.face[leaf], lying]
    if collapsed.any():
        side, point = lying[collapsed], leaf[collapsed]
        vertex[CORNERS[side].T, point] = border.vertex[border.start[4 * cells.face[point] + side]]
        lying, leaf = lying[~collapsed], leaf[~collapsed]
    sizes = spans[:, [1, 1, 0, 0]].ravel() + 1
    base = np.cumsum(sizes) - sizes
    keys = np.repeat(base, np.diff(border.start)) + border.at
    across = lying - lying % 2
    along = np.array([2 - across, 3 - across])
    wanted = base[4 * cells.face[leaf] + lying] + box[along, leaf]
    entry = keys.searchsorted(wanted, "right") - 1
    exact = keys[entry] == wanted
    corner, both = CORNERS[lying].T, np.array([leaf, leaf])
    vertex[corner[exact], both[exact]] = border.vertex[entry[exact]]
    segment = entry.copy()
    segment[1] -= exact[1]
    touching = np.array([segment.ravel(), both.ravel()])
    free = (~exact).nonzero()
    if not len(free[0]):
        return corner[free], both[free], entry[free], touching
    least = np.full(len(keys), np.iinfo(np.intp).max)
    np.minimum.at(least, touching[0], np.tile(box[across + 1, leaf] - box[across, leaf], 2))
    corner, found, segment = corner[free], both[free], entry[free]
    depth = (least[segment] // LIFT) >> flattened[segment]
    if depth.min() < 1:
        raise too_deep()
    side = lying[free[1]]
    places[side // 2, corner, found] += np.where(side % 2 == 1, -depth, depth)
    return corner, found, segment, touching


def _places(faces: Faces, side: Ints, at: Ints) -> tuple[Ints, Ints]:
    """Places of the border's entries, from sides (4 f + s) and places along them."""
    far = (faces.spans * SPAN)[side // 4]
    s = side % 4
    u = np.where(s < 2, np.where(s == 1, far[:, 0], 0), at)
    v = np.where(s < 2, at, np.where(s == 3, far[:, 1], 0))
    return u, v


def _chained(runs: Ints, order: Ints) -> tuple[Ints, Ints]:
    """Polygons from runs of sorted samples, (4, 2, L): where each begins and ends.

    Below and above the samples are sorted by v, in `order`, on the right and on the left by u;
    below and on the right they are taken upwards, above and on the left downwards.
    """
    # Leaf after leaf.
    first, end = runs.transpose(1, 2, 0).reshape(2, -1)
    count = end - first
    stop = np.cumsum(count)
    run = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(run)) - (stop - count)[run]
    up = run % 4 < 2
    place = np.where(up, first[run] + step, end[run] - 1 - step)
    start = np.zeros(len(count) // 4 + 1, dtype=np.intp)
    start[1:] = stop[3::4]
    return start, np.where(run % 2 == 0, order[place], place)
