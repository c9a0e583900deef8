"""Polygons and strips as triangles, and what falls to each of them."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.boxes import Leaves
from service.engine.adaptive.polygons.fans import cut
from service.engine.adaptive.polygons.outlines import Outline


@dataclass(frozen=True, eq=False, slots=True)
class Triangles:
    """Triangles of places that cover all faces.

    Attributes
    ----------
    corners : ndarray of int, shape (T, 3)
        Samples, counter-clockwise.
    leaf, segment : ndarray of int, shape (T,)
        The leaf that a triangle is of, or else −1 and the segment of the border that its strip is
        over.
    base : ndarray of int, shape (T,)
        The triangle of the same strip that has the segment for a side; −1 of leaves.
    host : ndarray of int, shape (T,)
        The triangle to which the surface over this one falls: itself, unless two of its vertices
        are one; then one beside it, or −1 if the whole face has none.
    beside : ndarray of int, shape (T, 3)
        The triangle beyond edge k, k+1 in the same face, if there is just one, or else −1;
    across : ndarray of int, shape (T, 3)
        the vertex opposite to the edge there.
    bare : ndarray of int, shape (Y,)
        Leaves with a piece of the border that no triangle has for an edge.
    crossed : ndarray of int, shape (X, 2)
        Triangles, and which of their edges, where more than two meet that are not all borders.
    """

    corners: Ints
    leaf: Ints
    segment: Ints
    base: Ints
    host: Ints
    beside: Ints
    across: Ints
    bare: Ints
    crossed: Ints

    @property
    def kept(self) -> Bools:
        """Which triangles are part of the mesh, shape (T,)."""
        kept: Bools = self.host == np.arange(len(self.host))
        return kept


def triangulated(outline: Outline, leaves: Leaves, positions: FloatArray) -> Triangles:
    """The triangles of an outline, whose vertices are at these positions (V, 3)."""
    parts = [*_of_leaves(outline, leaves, positions), _of_strips(outline)]
    corners, leaf, segment, base = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    base[base >= 0] += len(corners) - len(parts[-1][0])
    vertex = outline.vertex[corners]
    vanished = (vertex == np.roll(vertex, 1, axis=1)).any(axis=1)
    host = np.where(vanished, -1, np.arange(len(corners)))
    bare = np.empty(0, dtype=np.intp)
    if vanished.any():
        there, back = _edges(corners)
        _foster(there, back, leaf, host)
        edges = np.flatnonzero(np.repeat(vanished, 3))
        edges = edges[~_among(back[edges], there)]
        keys = _pairs(vertex)
        ends = vertex.ravel()[edges], np.roll(vertex, -1, axis=1).ravel()[edges]
        open_ = (ends[0] != ends[1]) & ~_among(keys[edges], keys[np.repeat(~vanished, 3)])
        bare = np.unique(leaf[edges[open_] // 3])
    beside, across, crowd = _neighbours(vertex, ~vanished, outline.face[corners[:, 0]])
    crossed = _crossed(corners, crowd) if len(crowd) else np.empty((0, 2), dtype=np.intp)
    return Triangles(corners, leaf, segment, base, host, beside, across, bare, crossed)


_Rows = tuple[Ints, Ints, Ints, Ints]
"""Corners, leaf, segment, base."""


def _of_leaves(outline: Outline, leaves: Leaves, positions: FloatArray) -> list[_Rows]:
    found: list[_Rows] = []
    plain = np.flatnonzero(outline.plain)
    if len(plain):
        four = outline.corner[outline.start[plain] + np.arange(4)[:, np.newaxis]]
        rising = leaves.rising[plain]
        third = np.where(rising, four[2], four[3])
        other = np.where(rising, four[0], four[1])
        pair = np.stack([four[0], four[1], third, other, four[2], four[3]], axis=1)
        found.append(_rows(pair.reshape(-1, 3), np.repeat(plain, 2)))
    size = np.diff(outline.start)
    size[plain] = 0
    box, form = leaves.cells.box, leaves.form
    for count in np.flatnonzero(np.bincount(size)[1:]) + 1:
        these = np.flatnonzero(size == count)
        corners = outline.corner[outline.start[these] + np.arange(count)[:, np.newaxis]]
        u0, u1, v0, v1 = box[:, these]
        x, y = (outline.u[corners] - u0) / (u1 - u0), (outline.v[corners] - v0) / (v1 - v0)
        points = positions[outline.vertex[corners]].transpose(0, 2, 1)
        triangles, polygon = cut(corners, x, y, points, form[:, these])
        found.append(_rows(triangles, these[polygon]))
    return found


def _rows(corners: Ints, leaf: Ints) -> _Rows:
    none = np.full(len(leaf), -1)
    return corners, leaf, none, none


def _of_strips(outline: Outline) -> _Rows:
    """A fan from a, a triangle on the whole segment, and a fan from b.

    The one in the middle has for its tip the last lifted corner in the first half of the segment.
    Where one end is a pole all of them fan from the other: seen from a pole, lifted corners may be
    in line. Bases are counted among the triangles of strips.
    """
    segment, lifted = outline.segment, outline.lifted
    count = len(segment)
    if not count:
        return _rows(np.empty((0, 3), dtype=np.intp), np.empty(0, dtype=np.intp))
    u, v = outline.u, outline.v
    low, high = outline.ends
    # Along the segment one of the two coordinates says the same for all three: no harm in adding.
    far = np.where(
        u[low] == u[high], 2 * v[lifted] - v[low] - v[high], 2 * u[lifted] - u[low] - u[high]
    )
    new = np.append(True, segment[1:] != segment[:-1])
    start = np.flatnonzero(new)
    strip = np.cumsum(new) - 1
    before = np.add.reduceat((far <= 0).astype(np.intp), start)
    tip = start + np.maximum(before - 1, 0)
    from_pole, to_pole = outline.polar[:, start]
    last = np.append(start[1:], count) - 1
    tip = np.where(to_pole & ~from_pole, last, np.where(from_pole & ~to_pole, start, tip))
    pair = np.flatnonzero(~new)
    first = pair <= tip[strip[pair]]
    fans = np.stack(
        [np.where(first, low[pair], high[pair]), lifted[pair - 1], lifted[pair]], axis=1
    )
    bases = np.stack([low[start], lifted[tip], high[start]], axis=1)
    corners = np.concatenate([bases, fans])
    number = np.concatenate([np.arange(len(start)), strip[pair]])
    turned = outline.turned[start][number]
    corners[turned] = corners[turned][:, [0, 2, 1]]
    return corners, np.full(len(corners), -1), segment[start][number], number


def _edges(corners: Ints) -> tuple[Ints, Ints]:
    """Numbers of the edges of triangles (T, 3), as they run and backwards: (3 T,) each."""
    many = corners.max() + 1
    begin, end = corners, np.roll(corners, -1, axis=1)
    return (begin * many + end).ravel(), (end * many + begin).ravel()


def _among(values: Ints, others: Ints) -> Bools:
    """Which values are among so many others that NumPy's `isin`, which hashes them, takes long."""
    known = np.sort(others)
    place = np.searchsorted(known, values).clip(max=len(known) - 1)
    among: Bools = known[place] == values if len(known) else np.zeros(len(values), dtype=bool)
    return among


def _pairs(vertex: Ints) -> Ints:
    """Numbers of the edges of triangles (T, 3), the same in both directions: (3 T,)."""
    low, high = vertex, np.roll(vertex, -1, axis=1)
    pairs: Ints = np.minimum(low, high) * (vertex.max() + 1) + np.maximum(low, high)
    return pairs.ravel()


def _foster(there: Ints, back: Ints, leaf: Ints, host: Ints) -> None:
    """Find hosts for triangles that have none: beside them, if possible in the same leaf.

    A leaf at a corner of its face of which both sides are one point has no triangle of its own.
    """
    order = np.argsort(there)
    found = order[np.minimum(np.searchsorted(there[order], back), len(there) - 1)]
    beside = np.where(there[found] == back, found // 3, -1).reshape(-1, 3)
    within = np.where(leaf[beside] == leaf[:, np.newaxis], beside, -1)
    for around in (within, beside):
        while True:
            waiting = np.flatnonzero(host < 0)
            offered = np.where(around[waiting] >= 0, host[around[waiting]], -1).max(axis=1)
            if not (offered >= 0).any():
                break
            host[waiting] = offered


def _neighbours(vertex: Ints, kept: Bools, face: Ints) -> tuple[Ints, Ints, Ints]:
    """Triangles beside edges, their vertices across, and edges (triangle · 3 + k) of too many.

    What is beside a face is not seen from it: its triangles must not depend on its company.
    """
    beside, across = np.full((2, vertex.size), -1)
    edges = np.flatnonzero(np.repeat(kept, 3))
    keys, owner = _pairs(vertex)[edges], np.repeat(face, 3)[edges]
    # One face after another first, for the second sort keeps what is equal in order.
    order = np.argsort(owner, kind="stable")
    order = order[np.argsort(keys[order], kind="stable")]
    keys, owner, edges = keys[order], owner[order], edges[order]
    together = _runs(keys)[1]
    crowd = np.repeat(together, together) > 2
    first, count = _runs(keys, owner)
    two = first[count == 2]
    one, other = edges[two], edges[two + 1]
    opposite = np.roll(vertex, 1, axis=1).ravel()
    across[one], across[other] = opposite[other], opposite[one]
    beside[one], beside[other] = other // 3, one // 3
    return beside.reshape(vertex.shape), across.reshape(vertex.shape), edges[crowd]


def _runs(*columns: Ints) -> tuple[Ints, Ints]:
    """Where runs of equal rows begin, and how long they are."""
    new = np.ones(len(columns[0]), dtype=bool)
    new[1:] = np.logical_or.reduce([column[1:] != column[:-1] for column in columns])
    first = np.flatnonzero(new)
    return first, np.diff(np.append(first, len(new)))


def _crossed(corners: Ints, crowd: Ints) -> Ints:
    """Of edges with more than two triangles, those that run through the inside of a face."""
    there, back = _edges(corners)
    inside = crowd[_among(back[crowd], there)]
    return np.stack([inside // 3, inside % 3], axis=1)
