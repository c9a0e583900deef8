"""Polygons and strips as triangles, and what is beside each of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.cells import Leaves
from service.engine.adaptive.polygons.cell_boundaries import CellBoundaries
from service.engine.adaptive.polygons.polygon_triangulation import triangulate_polygons

INDEX: DTypeLike = np.int32
"""Of what is kept for each edge of triangles, of which there are fewer than 2^31."""


@dataclass(frozen=True, eq=False, slots=True)
class TriangleRows:
    """Triangles of places.

    Attributes
    ----------
    corners : ndarray of int, shape (T, 3)
        Samples, counter-clockwise.
    leaf, segment : ndarray of int, shape (T,)
        The leaf that a triangle is of, or else −1 and the segment of the border that its strip is
        over.
    base : ndarray of int, shape (T,)
        The triangle of the same strip that has the segment for a side; −1 of leaves.
    """

    corners: Ints
    leaf: Ints
    segment: Ints
    base: Ints


def build_triangles(
    outline: CellBoundaries, leaves: Leaves, points: FloatArray, wanted: Bools, segments: Bools
) -> TriangleRows:
    """The triangles of some leaves of an outline, and of the strips over some segments.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 3)
        Positions of the samples.
    wanted : ndarray of bool, shape (L,)
    segments : ndarray of bool, shape (M,)
    """
    corners, leaf = _triangulate_leaves(outline, leaves, points, wanted)
    none = np.full(len(leaf), -1)
    if not len(outline.segment):
        return TriangleRows(corners, leaf, none, none)
    strips = _triangulate_strips(outline, segments[outline.segment].nonzero()[0])
    return TriangleRows(
        np.concatenate([corners, strips.corners]),
        np.concatenate([leaf, strips.leaf]),
        np.concatenate([none, strips.segment]),
        np.concatenate([none, strips.base + len(corners)]),
    )


def _triangulate_leaves(
    outline: CellBoundaries, leaves: Leaves, points: FloatArray, wanted: Bools
) -> tuple[Ints, Ints]:
    """Corners and leaves of triangles."""
    plain = (outline.plain & wanted).nonzero()[0]
    four = outline.corner[outline.start[plain] + np.arange(4)[:, np.newaxis]]
    rising = leaves.rising[plain]
    third = np.where(rising, four[2], four[3])
    other = np.where(rising, four[0], four[1])
    pair = np.stack([four[0], four[1], third, other, four[2], four[3]], axis=1).reshape(-1, 3)
    rest = (~outline.plain & wanted).nonzero()[0]
    if not len(rest):
        return pair, np.repeat(plain, 2)
    start = outline.start[rest]
    size = outline.start[rest + 1] - start
    polygon = np.repeat(np.arange(len(rest)), size)
    corners = outline.corner[np.arange(len(polygon)) + (start - np.cumsum(size) + size)[polygon]]
    u0, u1, v0, v1 = leaves.cells.box[:, rest[polygon]]
    x, y = (outline.u[corners] - u0) / (u1 - u0), (outline.v[corners] - v0) / (v1 - v0)
    triangles, polygon = triangulate_polygons(size, x, y, points[corners].T, leaves.form[:, rest])
    return (
        np.concatenate([pair, corners[triangles]]),
        np.concatenate([np.repeat(plain, 2), rest[polygon]]),
    )


def _triangulate_strips(outline: CellBoundaries, rows: Ints) -> TriangleRows:
    """A fan from a, a triangle on the whole segment, and a fan from b; of these lifted corners.

    The one in the middle has for its tip the last lifted corner in the first half of the segment.
    Where one end is a pole all of them fan from the other: seen from a pole, lifted corners may be
    in line. Bases are counted among the triangles of strips.
    """
    segment, lifted = outline.segment[rows], outline.lifted[rows]
    count = len(segment)
    if not count:
        none = np.empty(0, dtype=np.intp)
        return TriangleRows(np.empty((0, 3), dtype=np.intp), none, none, none)
    u, v = outline.u, outline.v
    low, high = outline.ends[:, rows]
    # Along the segment one of the two coordinates says the same for all three: no harm in adding.
    far = np.where(
        u[low] == u[high], 2 * v[lifted] - v[low] - v[high], 2 * u[lifted] - u[low] - u[high]
    )
    new = np.append(True, segment[1:] != segment[:-1])
    start = new.nonzero()[0]
    strip = np.cumsum(new) - 1
    before = np.add.reduceat((far <= 0).astype(np.intp), start)
    tip = start + np.maximum(before - 1, 0)
    from_pole, to_pole = outline.polar[:, rows[start]]
    last = np.append(start[1:], count) - 1
    tip = np.where(to_pole & ~from_pole, last, np.where(from_pole & ~to_pole, start, tip))
    pair = (~new).nonzero()[0]
    first = pair <= tip[strip[pair]]
    fans = np.stack(
        [np.where(first, low[pair], high[pair]), lifted[pair - 1], lifted[pair]], axis=1
    )
    bases = np.stack([low[start], lifted[tip], high[start]], axis=1)
    corners = np.concatenate([bases, fans])
    number = np.concatenate([np.arange(len(start)), strip[pair]])
    turned = outline.turned[rows[start]][number]
    corners[turned] = corners[turned][:, [0, 2, 1]]
    return TriangleRows(corners, np.full(len(corners), -1), segment[start][number], number)


def number_directed_edges(corners: Ints) -> tuple[Ints, Ints]:
    """Numbers of the edges of triangles (T, 3), as they run and backwards: (3 T,) each."""
    many, end = corners.max() + 1, corners[:, [1, 2, 0]]
    there = corners * many
    there += end
    end *= many
    end += corners
    return there.ravel(), end.ravel()


def is_among(values: Ints, others: Ints) -> Bools:
    """Which of few values are among many others: the few are sorted, not the many."""
    if not len(values):
        return np.zeros(0, dtype=bool)
    known, number = np.unique(values, return_inverse=True)
    there = np.zeros(len(known), dtype=bool)
    there[_find_places(known, others)[1]] = True
    found: Bools = there[number]
    return found


def _find_places(known: Ints, others: Ints) -> tuple[Ints, Ints]:
    """Those of many others that are among a few sorted numbers, and which of these they are."""
    place = np.searchsorted(known, others)
    place[place == len(known)] = 0
    here = (known[place] == others).nonzero()[0]
    return here, place[here]


def number_edges(vertex: Ints) -> Ints:
    """Numbers of the edges of triangles (T, 3), the same in both directions: (3 T,)."""
    other = vertex[:, [1, 2, 0]]
    found: Ints = np.minimum(vertex, other, dtype=np.intp)
    found *= int(vertex.max(initial=0)) + 1
    found += np.maximum(vertex, other, out=other)
    return found.ravel()


def assign_hosts(corners: Ints, leaf: Ints, host: Ints) -> None:
    """Find hosts for triangles that have none: beside them, if possible in the same leaf.

    A leaf at a corner of its face of which both sides are one point has no triangle of its own.
    Only those are looked for that have none, −1; `host` (T,) is changed.
    """
    there, back = number_directed_edges(corners)
    waiting = (host < 0).nonzero()[0]
    back = back[(3 * waiting[:, np.newaxis] + np.arange(3)).ravel()]
    known, number = np.unique(back, return_inverse=True)
    here, which = _find_places(known, there)
    found = np.full(len(known), -1)
    found[which] = here // 3
    beside = found[number].reshape(-1, 3)
    within = np.where(leaf[beside] == leaf[waiting][:, np.newaxis], beside, -1)
    for around in (within, beside):
        while True:
            open_ = (host[waiting] < 0).nonzero()[0]
            offered = np.where(around[open_] >= 0, host[around[open_]], -1).max(axis=1, initial=-1)
            if not (offered >= 0).any():
                break
            host[waiting[open_]] = offered


def find_neighbours(vertex: Ints, kept: Bools, face: Ints) -> tuple[Ints, Ints, Ints]:
    """Triangles beside edges, their vertices across, and edges (triangle · 3 + k) of too many.

    What is beside a face is not seen from it: its triangles must not depend on its company.
    """
    # At the peak of a mesh's memory: nothing is held any longer than it is needed.
    keys = number_edges(vertex)
    gone = np.repeat(~kept, 3)
    keys[gone] = -1
    sides = np.argsort(keys)[np.count_nonzero(gone) :]
    keys = keys[sides]
    same = keys[1:] == keys[:-1]
    third = (same[1:] & same[:-1]).nonzero()[0]
    owner = face[sides // 3]
    if len(third):
        # One face after another within an edge.
        order = np.lexsort((owner, keys))
        owner, sides = owner[order], sides[order]
    del keys
    mine = np.concatenate([[False], same & (owner[1:] == owner[:-1]), [False]])
    # Two of one face, neither of them with a third.
    two = (mine[1:-1] & ~mine[:-2] & ~mine[2:]).nonzero()[0]
    one, other = sides[two], sides[two + 1]
    crowd = np.zeros(len(sides), dtype=bool)
    for step in range(3):
        crowd[third + step] = True
    sides = sides[crowd]
    del owner, mine, two
    beside, across = np.full((2, vertex.size), -1, dtype=INDEX)
    for own, theirs in ((one, other), (other, one)):
        triangle, edge = np.divmod(theirs, 3)
        beside[own] = triangle
        across[own] = vertex[triangle, edge - 1]
    return beside.reshape(vertex.shape), across.reshape(vertex.shape), sides


def find_crossed_edges(corners: Ints, crowd: Ints) -> Ints:
    """Of edges with more than two triangles, those that run through the inside of a face."""
    there, back = number_directed_edges(corners)
    inside = crowd[is_among(back[crowd], there)]
    return np.stack([inside // 3, inside % 3], axis=1)
