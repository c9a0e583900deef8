"""Polygons and strips as triangles, and the neighbours and reference triangles of triangles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.cutting.cells import Leaves
from service.engine.adaptive.drafts.cell_boundaries import CellBoundaries
from service.engine.adaptive.drafts.polygon_triangulation import triangulate_polygons

INDEX: DTypeLike = np.int32
"""Type of numbers that are stored for each edge: a mesh has fewer than 2^31 edges and vertices."""


@dataclass(frozen=True, eq=False, slots=True)
class TriangleRows:
    """Triangles of places.

    Attributes
    ----------
    corners : ndarray of int, shape (T, 3)
        Samples, counter-clockwise.
    leaf, segment : ndarray of int, shape (T,)
        A triangle of a leaf has the number of the leaf, and segment −1. A triangle of a strip has
        leaf −1, and the segment of the border at the strip.
    base : ndarray of int, shape (T,)
        The triangle of the strip that has the segment as a side; −1 for triangles of leaves.
    """

    corners: Ints
    leaf: Ints
    segment: Ints
    base: Ints


def build_triangles(
    boundaries: CellBoundaries, leaves: Leaves, points: FloatArray, selected: Bools, segments: Bools
) -> TriangleRows:
    """The triangles of selected leaves, and of the strips over selected segments.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 3)
        Positions of the samples.
    selected : ndarray of bool, shape (L,)
        Marks leaves to be triangulated.
    segments : ndarray of bool, shape (M,)
        Marks segments of the border whose strips are triangulated.
    """
    corners, leaf = _triangulate_leaves(boundaries, leaves, points, selected)
    none = np.full(len(leaf), -1)
    rows = segments[boundaries.segment].nonzero()[0]  # lifted corners of these strips
    if not len(rows):
        return TriangleRows(corners, leaf, none, none)
    strips = _triangulate_strips(boundaries, rows)
    return TriangleRows(
        np.concatenate([corners, strips.corners]),
        np.concatenate([leaf, strips.leaf]),
        np.concatenate([none, strips.segment]),
        np.concatenate([none, strips.base + len(corners)]),
    )


def _triangulate_leaves(
    boundaries: CellBoundaries, leaves: Leaves, points: FloatArray, selected: Bools
) -> tuple[Ints, Ints]:
    """Corners (T, 3) and leaves (T,) of the triangles of selected leaves."""
    plain = (boundaries.is_plain & selected).nonzero()[0]
    a, b, c, d = boundaries.corner[boundaries.start[plain] + np.arange(4)[:, np.newaxis]]
    # Two triangles: abc and acd at the diagonal ac, or abd and bcd at the diagonal bd.
    is_rising = leaves.is_rising[plain]
    third, first = np.where(is_rising, c, d), np.where(is_rising, a, b)
    pair = np.stack([a, b, third, first, c, d], axis=1).reshape(-1, 3)
    parts = [(pair, np.repeat(plain, 2))]
    fans = (leaves.is_fan & selected).nonzero()[0]
    if len(fans):
        parts.append(_triangulate_fans(boundaries, fans))
    rest = (~boundaries.is_plain & ~leaves.is_fan & selected).nonzero()[0]
    if len(rest):
        parts.append(_triangulate_polygons(boundaries, leaves, points, rest))
    triangles, owners = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return triangles, owners


def _triangulate_fans(boundaries: CellBoundaries, rows: Ints) -> tuple[Ints, Ints]:
    """Corners (T, 3) and leaves (T,) of the triangles of the fans in these rows."""
    start = boundaries.start[rows]
    middle = boundaries.start[rows + 1] - 1
    fan, entry = expand_runs(middle - start, start)
    after = np.where(entry + 1 == middle[fan], start[fan], entry + 1)
    return boundaries.corner[np.stack([entry, after, middle[fan]], axis=1)], rows[fan]


def _triangulate_polygons(
    boundaries: CellBoundaries, leaves: Leaves, points: FloatArray, rows: Ints
) -> tuple[Ints, Ints]:
    """Corners (T, 3) and leaves (T,) of the triangles of the polygons in these rows."""
    start = boundaries.start[rows]
    size = boundaries.start[rows + 1] - start
    polygon, entry = expand_runs(size, start)
    corners = boundaries.corner[entry]
    u0, u1, v0, v1 = leaves.rectangle.take(rows[polygon], axis=1)
    x, y = (boundaries.u[corners] - u0) / (u1 - u0), (boundaries.v[corners] - v0) / (v1 - v0)
    triangles, polygon = triangulate_polygons(
        size, x, y, points[corners].T, leaves.form.take(rows, axis=1)
    )
    return corners[triangles], rows[polygon]


def _triangulate_strips(boundaries: CellBoundaries, rows: Ints) -> TriangleRows:
    """Triangles of strips over segments [a, b]: some at a, the base on all of [a, b], some at b.

    A lifted corner is a corner of a leaf, moved from the segment into the face (`cell_boundaries`).
    The tip of the base is the last lifted corner in the first half of the segment, or the first of
    all if this half has none. But if only one end of the segment is a pole, the tip is the lifted
    corner nearest to it: all other triangles then have the other end as a corner, because lifted
    corners may be in line with a pole. `rows` are the rows of `boundaries.lifted` with the lifted
    corners of the strips. In the result, `base` has rows of the result, where the bases are first.
    """
    segment, lifted = boundaries.segment[rows], boundaries.lifted[rows]
    u, v = boundaries.u, boundaries.v
    low, high = boundaries.ends[:, rows]
    # Twice the distance of each lifted corner from the middle of its segment, negative in the first
    # half. A segment is along u or along v: the other coordinate is equal at both ends.
    from_middle = np.where(
        u[low] == u[high], 2 * v[lifted] - v[low] - v[high], 2 * u[lifted] - u[low] - u[high]
    )
    is_start = np.append(True, segment[1:] != segment[:-1])
    start = is_start.nonzero()[0]
    strip = np.cumsum(is_start) - 1
    count_before = np.add.reduceat((from_middle <= 0).astype(np.intp), start)
    tip = start + np.maximum(count_before - 1, 0)
    from_pole, to_pole = boundaries.is_polar[:, rows[start]]
    last = np.append(start[1:], len(rows)) - 1
    tip = np.where(to_pole & ~from_pole, last, np.where(from_pole & ~to_pole, start, tip))
    # Each lifted corner that follows another one of its strip makes a triangle with that one and
    # with an end of the segment: with a up to the tip, with b after the tip.
    later = (~is_start).nonzero()[0]
    is_at_a = later <= tip[strip[later]]
    fans = np.stack(
        [np.where(is_at_a, low[later], high[later]), lifted[later - 1], lifted[later]], axis=1
    )
    bases = np.stack([low[start], lifted[tip], high[start]], axis=1)
    corners = np.concatenate([bases, fans])
    owner = np.concatenate([np.arange(len(start)), strip[later]])  # the strip of each triangle
    turns_left = boundaries.turns_left[rows[start]][owner]
    corners[turns_left] = corners[turns_left][:, [0, 2, 1]]
    return TriangleRows(corners, np.full(len(corners), -1), segment[start][owner], owner)


def number_directed_edges(corners: Ints) -> tuple[Ints, Ints]:
    """Numbers of the directed edges of triangles (T, 3), and of their reverses: (3 T,) each."""
    many, end = corners.max() + 1, corners[:, [1, 2, 0]]
    forth = corners * many
    forth += end
    end *= many
    end += corners
    return forth.ravel(), end.ravel()


def is_among(values: Ints, others: Ints) -> Bools:
    """Which of a few values are among many other values; only the few values are sorted."""
    if not len(values):
        return np.zeros(0, dtype=bool)
    distinct, number = np.unique(values, return_inverse=True)
    occurs = np.zeros(len(distinct), dtype=bool)
    occurs[_find_matches(distinct, others)[1]] = True
    return occurs[number]


def _find_matches(few: Ints, many: Ints) -> tuple[Ints, Ints]:
    """Rows of `many` whose numbers occur in `few`, and their rows there; `few` is sorted."""
    nearest = np.searchsorted(few, many)
    nearest[nearest == len(few)] = 0
    rows = (few[nearest] == many).nonzero()[0]
    return rows, nearest[rows]


def number_edges(vertex: Ints) -> Ints:
    """Numbers of the edges of triangles (T, 3), equal for both directions: (3 T,)."""
    other = vertex[:, [1, 2, 0]]
    number: Ints = np.minimum(vertex, other, dtype=np.intp)
    number *= int(vertex.max(initial=0)) + 1
    number += np.maximum(vertex, other, out=other)
    return number.ravel()


def assign_references(corners: Ints, leaf: Ints, reference: Ints) -> None:
    """Replace each −1 in `reference` (T,) by the reference triangle of a neighbour, if any has one.

    The neighbour is in the same leaf if possible. A neighbour in another leaf is needed at a corner
    of a face where both sides are poles: there all triangles of a leaf may be flat.
    """
    forth, back = number_directed_edges(corners)
    waiting = (reference < 0).nonzero()[0]
    back = back[(3 * waiting[:, np.newaxis] + np.arange(3)).ravel()]
    edges, number = np.unique(back, return_inverse=True)
    rows, edge = _find_matches(edges, forth)
    owner = np.full(len(edges), -1)
    owner[edge] = rows // 3
    beside = owner[number].reshape(-1, 3)
    within = np.where(leaf[beside] == leaf[waiting][:, np.newaxis], beside, -1)
    # Each pass of the inner loop takes the reference triangles of neighbours that have one already.
    for around in (within, beside):
        while True:
            open_ = (reference[waiting] < 0).nonzero()[0]
            offered = np.where(around[open_] >= 0, reference[around[open_]], -1).max(
                axis=1, initial=-1
            )
            if not (offered >= 0).any():
                break
            reference[waiting[open_]] = offered


def find_neighbours(vertex: Ints, has_area: Bools, face: Ints) -> tuple[Ints, Ints]:
    """The vertices across edges, and the edges that more than two triangles have.

    Only triangles of one face are neighbours, so that the triangles of a face do not depend on the
    other faces of the model.

    Returns
    -------
    across : ndarray of int32, shape (T, 3)
        For each edge the opposite vertex of the triangle beyond the edge; −1 unless exactly two
        triangles with an area, of one face, have the edge.
    nonmanifold : ndarray of int
        The edges that more than two triangles with an area, of any faces, have: 3 · triangle + k.
    """
    # Memory is at its peak here: arrays are deleted as soon as possible.
    keys = number_edges(vertex)
    dropped = np.repeat(~has_area, 3)
    keys[dropped] = -1
    sides = np.argsort(keys)[np.count_nonzero(dropped) :]
    keys = keys[sides]
    same = keys[1:] == keys[:-1]
    # Where three keys in a row are equal, more than two triangles have the edge.
    begin_of_three = (same[1:] & same[:-1]).nonzero()[0]
    owner = face[sides // 3]
    if len(begin_of_three):
        # Within an edge, sort by face.
        order = np.lexsort((owner, keys))
        owner, sides = owner[order], sides[order]
    del keys
    # Whether each side, and the side before it, are one edge of one face; false at both ends.
    is_paired = np.concatenate([[False], same & (owner[1:] == owner[:-1]), [False]])
    # Two sides of one face, without a third side.
    two = (is_paired[1:-1] & ~is_paired[:-2] & ~is_paired[2:]).nonzero()[0]
    one, other = sides[two], sides[two + 1]
    nonmanifold = np.zeros(len(sides), dtype=bool)
    for step in range(3):
        nonmanifold[begin_of_three + step] = True
    sides = sides[nonmanifold]
    del owner, is_paired, two
    across = np.full(vertex.size, -1, dtype=INDEX)
    # Opposite edge (k, k + 1) is vertex k + 2, which is k − 1 modulo 3.
    for side, opposite in ((one, other), (other, one)):
        across[side] = vertex[opposite // 3, opposite % 3 - 1]
    return across.reshape(vertex.shape), sides
