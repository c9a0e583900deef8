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

FIXED = (0, 1, 2, 3)
"""Row of a box that is constant along each side,"""

ALONG = ((2, 3), (2, 3), (0, 1), (0, 1))
"""the rows that say where it begins and ends,"""

HEIGHT = ((0, 1), (0, 1), (2, 3), (2, 3))
"""and those that say how high the box is above it."""

CORNERS = ((0, 3), (1, 2), (0, 1), (3, 2))
"""Corners at both ends of each side; corners are counted (0, 0), (1, 0), (1, 1), (0, 1)."""

CORNER_U, CORNER_V = np.array([0, 1, 1, 0]), np.array([2, 2, 3, 3])
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
    u, v = cells.box[CORNER_U].copy(), cells.box[CORNER_V].copy()
    vertex = np.full((4, count), -1)
    corner, number, segment, touching = _lift(
        faces, border, cells, flattened=flattened, places=(u, v), vertex=vertex
    )
    side = np.repeat(np.arange(len(border.start) - 1), np.diff(border.start))
    at_u, at_v = _places(faces, side, border.at)
    face = np.concatenate([np.tile(cells.face, 4), side // 4])
    u = np.concatenate([u.ravel(), at_u])
    v = np.concatenate([v.ravel(), at_v])
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
    rows = rank_u[first], rank_v[first]
    by_v = rows[1] * many_u + rows[0]
    order = np.argsort(by_v)
    by_v = by_v[order]
    begin_u, end_u = (np.searchsorted(lines_u, low_u[cells.face] + cells.box[k]) for k in (0, 1))
    begin_v, end_v = (np.searchsorted(lines_v, low_v[cells.face] + cells.box[k]) for k in (2, 3))
    runs = [
        _run(by_v, begin_v * many_u, begin_u, end_u, "both"),
        _run(by_u, end_u * many_v, begin_v, end_v, "right"),
        _run(by_v, end_v * many_u, begin_u, end_u, "left"),
        _run(by_u, begin_u * many_v, begin_v, end_v, "none"),
    ]
    start, corners = _chained(runs, order)
    lifted = np.zeros(count, dtype=bool)
    lifted[number] = True
    plain = (np.diff(start) == 4) & ~lifted
    pairs = np.unique(segment * len(first) + sample[corner * count + number])
    segment, lift = pairs // len(first), pairs % len(first)
    entry = sample[4 * count :]
    pole = np.zeros(len(border.points), dtype=bool)
    pole[border.vertex[border.start[:-1][border.collapsed.ravel()]]] = True
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
        pole[border.vertex[ends]],
        np.isin(side[segment] % 4, (1, 2)),
        entry,
        touching,
    )


def _lift(
    faces: Faces,
    border: Border,
    cells: Cells,
    *,
    flattened: Ints,
    places: tuple[Ints, Ints],
    vertex: Ints,
) -> tuple[Ints, Ints, Ints, Ints]:
    """Lift corners, in place, or tell which vertices of the border they are.

    Returns
    -------
    corner, leaf, segment : ndarray of int, shape (k,)
        The corners that were lifted, and the entries of the border before them.
    touching : ndarray of int, shape (2, E)
        See `Outline`.
    """
    sizes = (faces.spans * SPAN)[:, [1, 1, 0, 0]].ravel()
    base = np.cumsum(sizes + 1) - (sizes + 1)
    keys = np.repeat(base, np.diff(border.start)) + border.at
    least = np.full(len(keys), np.iinfo(np.intp).max)
    found: list[tuple[Ints, Ints, Ints]] = []
    touching: list[Ints] = []
    for side in range(4):
        limit = faces.spans[cells.face, side // 2] * SPAN if side % 2 else 0
        here = (cells.box[FIXED[side]] == limit).nonzero()[0]
        collapsed = border.collapsed[cells.face[here], side]
        for corner in CORNERS[side]:
            point = here[collapsed]
            vertex[corner, point] = border.vertex[border.start[4 * cells.face[point] + side]]
        here = here[~collapsed]
        begin, end = HEIGHT[side]
        height = cells.box[end, here] - cells.box[begin, here]
        for last, corner in enumerate(CORNERS[side]):
            key = base[4 * cells.face[here] + side] + cells.box[ALONG[side][last], here]
            entry = np.searchsorted(keys, key, side="right") - 1
            exact = keys[entry] == key
            vertex[corner, here[exact]] = border.vertex[entry[exact]]
            segment = entry - exact if last else entry
            np.minimum.at(least, segment, height)
            touching.append(np.array([segment, here]))
            free = ~exact
            found.append((np.full(free.sum(), 4 * side + corner), here[free], entry[free]))
    code, leaf, segment = (np.concatenate(parts) for parts in zip(*found, strict=True))
    lying, which = code // 4, code % 4
    depth = (least[segment] // LIFT) >> flattened[segment]
    if len(depth) and depth.min() < 1:
        raise too_deep()
    across = np.where(lying % 2 == 1, -depth, depth)
    for axis in (0, 1):
        mine = lying // 2 == axis
        places[axis][which[mine], leaf[mine]] += across[mine]
    return which, leaf, segment, np.concatenate(touching, axis=1)


def _places(faces: Faces, side: Ints, at: Ints) -> tuple[Ints, Ints]:
    """Places of the border's entries, from sides (4 f + s) and places along them."""
    far = (faces.spans * SPAN)[side // 4]
    s = side % 4
    u = np.where(s < 2, np.where(s == 1, far[:, 0], 0), at)
    v = np.where(s < 2, at, np.where(s == 3, far[:, 1], 0))
    return u, v


def _run(keys: Ints, line: Ints, begin: Ints, end: Ints, closed: str) -> tuple[Ints, Ints]:
    """Where the points of lines, from begin to end, stand among sorted keys: first and count."""
    first = np.searchsorted(
        keys, line + begin, side="left" if closed in ("both", "left") else "right"
    )
    last = np.searchsorted(
        keys, line + end, side="right" if closed in ("both", "right") else "left"
    )
    return first, last - first


def _chained(runs: list[tuple[Ints, Ints]], order: Ints) -> tuple[Ints, Ints]:
    """Polygons: below and on the right upwards, above and on the left downwards."""
    start = np.zeros(len(runs[0][0]) + 1, dtype=np.intp)
    np.cumsum(np.sum([count for _, count in runs], axis=0), out=start[1:])
    corner = np.empty(start[-1], dtype=np.intp)
    put = start[:-1].copy()
    for number, (first, count) in enumerate(runs):
        leaf = np.repeat(np.arange(len(count)), count)
        step = np.arange(len(leaf)) - (np.cumsum(count) - count)[leaf]
        place = first[leaf] + (step if number < 2 else count[leaf] - 1 - step)
        corner[put[leaf] + step] = order[place] if number % 2 == 0 else place
        put += count
    return start, corner
