"""The samples and the triangles of a draft.

A sample is a place of a face and its vertex. Samples are only added. A sample keeps its number as
long as a leaf or the border uses it; if it is needed again after a round in which it was not used,
it gets a new number.

Triangles are only added, too. A triangle whose leaf or strip was replaced stays in the arrays but
is no longer alive. After each round `is_changed` marks the triangles that must be proved again.
"""

from collections.abc import Callable

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import NO_NUMBERS, Task
from service.engine.adaptive.drafts.cell_boundaries import CellBoundaries
from service.engine.adaptive.drafts.triangles import (
    INDEX,
    TriangleRows,
    assign_references,
    find_neighbours,
    is_among,
    number_directed_edges,
    number_edges,
)

Store = Callable[[FloatArray], FloatArray]
"""Rounds positions (V, 3) as a format stores them, and returns them as float64."""


class DraftSamples:
    """N samples and V vertices.

    Attributes
    ----------
    face, u, v, vertex : ndarray of int, shape (N,)
        A sample is a vertex at a place (u, v) of one face.
    entry : ndarray of int, shape (M,)
        The sample of each entry of the border.
    points, positions : ndarray of float64, shape (V, 3)
        Vertices before and after the rounding for storage; those on sides of faces come first.
    """

    def __init__(self, task: Task, border: Border, store: Store) -> None:
        self._task, self._store = task, store
        self._border_count = len(border.points)
        self.face = self.u = self.v = self.vertex = self.entry = NO_NUMBERS
        self.points, self.positions = border.points, store(border.points)

    def __len__(self) -> int:
        return len(self.face)

    def number(self, boundaries: CellBoundaries, is_used: Bools) -> Ints:
        """The numbers of the samples of boundaries; new samples are added.

        `is_used` (N,) marks samples that the boundaries may have. The samples of the border are
        marked here.
        """
        number = np.full(len(boundaries.face), -1)
        if len(self.face):
            is_used[self.entry] = True
            old = is_used.nonzero()[0]
            columns = [
                np.concatenate([getattr(boundaries, name), getattr(self, name)[old]])
                for name in ("face", "u", "v")
            ]
            order = np.lexsort(columns[::-1])
            # In this order an old sample follows the sample of the boundaries that is equal.
            same = np.logical_and.reduce([c[order[1:]] == c[order[:-1]] for c in columns])
            hits = same.nonzero()[0]
            number[order[hits]] = old[order[hits + 1] - len(number)]
        fresh = (number < 0).nonzero()[0]
        number[fresh] = len(self.face) + np.arange(len(fresh))
        self._add(boundaries, fresh)
        self.entry = number[boundaries.entry]
        return number

    def _add(self, boundaries: CellBoundaries, fresh: Ints) -> None:
        """Append the samples `fresh` of boundaries, and those of their vertices that are inside."""
        vertex = boundaries.vertex[fresh]
        inner = (vertex >= self._border_count).nonzero()[0]
        vertex[inner] = len(self.points) + np.arange(len(inner))
        row = fresh[inner]
        if len(row):
            points = self._task.evaluate_points(
                boundaries.face[row], boundaries.u[row], boundaries.v[row]
            )
            self.points = np.concatenate([self.points, points])
            self.positions = np.concatenate([self.positions, self._store(points)])
        self.face = np.concatenate([self.face, boundaries.face[fresh]])
        self.u = np.concatenate([self.u, boundaries.u[fresh]])
        self.v = np.concatenate([self.v, boundaries.v[fresh]])
        self.vertex = np.concatenate([self.vertex, vertex])

    def sort(self, is_used: Bools) -> tuple[Ints, Ints, FloatArray]:
        """The samples in use (n,), in the order of face, u, v; their vertices (n,), numbered anew.

        Also returns the points (v, 3) of these vertices, those on sides of faces first.
        """
        is_used[self.entry] = True
        samples = is_used.nonzero()[0]
        samples = samples[np.lexsort((self.v[samples], self.u[samples], self.face[samples]))]
        vertex, count = self.vertex[samples], self._border_count
        inner = (vertex >= count).nonzero()[0]
        points = np.concatenate([self.points[:count], self.points[vertex[inner]]])
        vertex[inner] = count + np.arange(len(inner))
        return samples, vertex, points


class DraftTriangles:
    """T triangles of places.

    Attributes
    ----------
    corners : ndarray of int, shape (T, 3)
        Samples at the corners, counter-clockwise.
    vertices : ndarray of int, shape (T, 3)
        Vertices at the corners.
    is_flat : ndarray of bool, shape (T,)
        Whether two of the vertices are one.
    leaf, segment, base : ndarray of int, shape (T,)
        See `TriangleRows`.
    reference : ndarray of int, shape (T,)
        The reference triangle of the part of the surface over this triangle: the triangle itself,
        but for a flat triangle one near it that is not flat, or −1 if none is found.
    across : ndarray of int, shape (T, 3)
        Column k: the opposite vertex of the triangle beyond edge (k, k+1), if exactly one other
        triangle of the same face has this edge; otherwise −1.
    is_alive : ndarray of bool, shape (T,)
        Whether the triangle is part of the draft now.
    is_changed : ndarray of bool, shape (T,)
        Whether the triangle was added or removed in the last round, or a vertex across one of its
        edges, or its reference triangle, changed.
    bare : ndarray of int
        Leaves with an edge on the border of their face that is an edge of flat triangles only.
    crossed : ndarray of int, shape (X, 2)
        Pairs (triangle, edge k) for edges inside a face that more than two triangles have.
    """

    def __init__(self) -> None:
        self.corners = self.vertices = np.empty((0, 3), dtype=np.intp)
        self.across = self.corners
        self.leaf = self.segment = self.base = self.reference = self.bare = NO_NUMBERS
        self.is_alive = self.is_changed = self.is_flat = np.zeros(0, dtype=bool)
        self.crossed = np.empty((0, 2), dtype=np.intp)

    def __len__(self) -> int:
        return len(self.reference)

    @property
    def is_written(self) -> Bools:
        """Which triangles are part of the mesh, shape (T,)."""
        is_written: Bools = self.is_alive & (self.reference == np.arange(len(self.reference)))
        return is_written

    def find_replaced(self, leaves: Bools, segments: Bools) -> Bools:
        """Which triangles belong to these leaves (L,), or to strips over these segments (M,)."""
        # Triangles of strips have leaf −1, which selects the appended entry.
        of_leaves = np.append(leaves, False)
        is_replaced: Bools = of_leaves[self.leaf] | ((self.leaf < 0) & segments[self.segment])
        return self.is_alive & is_replaced

    def add(self, rows: TriangleRows, is_removed: Bools, samples: DraftSamples) -> None:
        """Remove and append triangles; find neighbours of the new triangles and of those around."""
        begin, count = len(self.is_alive), len(rows.leaf)
        self.corners = _append(self.corners, rows.corners)
        self.leaf = _append(self.leaf, rows.leaf)
        self.segment = _append(self.segment, rows.segment)
        self.base = _append(self.base, np.where(rows.base < 0, -1, rows.base + begin))
        fresh = samples.vertex[rows.corners].astype(INDEX)
        del rows
        a, b, c = fresh.T
        flat = (a == b) | (b == c) | (c == a)
        self.vertices = _append(self.vertices, fresh)
        self.is_flat = np.concatenate([self.is_flat, flat])
        self.reference = _append(self.reference, np.where(flat, -1, begin + np.arange(count)))
        self.across = _append(self.across, np.full((count, 3), -1, dtype=INDEX))
        del fresh
        self.is_alive = np.concatenate([self.is_alive & ~is_removed, np.ones(count, dtype=bool)])
        self.is_changed = np.concatenate([is_removed, np.ones(count, dtype=bool)])
        if not begin:
            self._find_neighbours(slice(None), np.ones((count, 3), dtype=bool), samples)
            return
        # An edge may have changed if both of its ends are vertices of new or removed triangles.
        mark = np.zeros(len(samples.points), dtype=bool)
        mark[self.vertices[self.is_changed]] = True
        at_a, at_b, at_c = (mark[self.vertices[:, k]] & self.is_alive for k in range(3))
        edge = np.stack([at_a & at_b, at_b & at_c, at_c & at_a], axis=1)
        touched = (edge[:, 0] | edge[:, 1] | edge[:, 2]).nonzero()[0]
        self._find_neighbours(touched, edge[touched], samples)
        # A flat triangle whose reference triangle was removed is not always `touched`; it loses
        # its reference triangle here.
        flat = (self.is_flat & self.is_alive).nonzero()[0]
        orphans = flat[(self.reference[flat] >= 0) & ~self.is_alive[self.reference[flat]]]
        self.reference[orphans] = -1

    def _find_neighbours(self, rows: Ints | slice, edges: Bools, samples: DraftSamples) -> None:
        """Find reference triangles and neighbours of these triangles.

        Neighbours change only at the marked edges (m, 3).
        """
        number = np.arange(len(self.reference))[rows]
        has_area = ~self.is_flat[rows]
        self.bare = NO_NUMBERS
        if not has_area.all():
            self._find_references(number, has_area, edges)
        vertex, corners = self.vertices[rows], self.corners[rows]
        across, nonmanifold = find_neighbours(vertex, has_area, samples.face[corners[:, 0]])
        self.is_changed[number[(edges & (self.across[rows] != across)).any(axis=1)]] = True
        self.across[rows] = np.where(edges, across, self.across[rows])
        del across
        nonmanifold = nonmanifold[edges.ravel()[nonmanifold]]
        if len(nonmanifold):
            # Inside a face, some triangle has the reverse of an edge, with the same two samples; on
            # the border of the face, no triangle has it.
            forth, back = number_directed_edges(corners)
            nonmanifold = nonmanifold[is_among(back[nonmanifold], forth)]
        self.crossed = np.stack([number[nonmanifold // 3], nonmanifold % 3], axis=1)

    def _find_references(self, rows: Ints, has_area: Bools, edges: Bools) -> None:
        """Find reference triangles for the flat triangles, and the leaves that are bare.

        `has_area` (m,) marks triangles that are not flat, `edges` (m, 3) the edges that may have
        changed.
        """
        corners, reference = self.corners[rows], self.reference[rows]
        flat = ~has_area & (reference >= 0)
        reference[flat] = np.where(self.is_alive[reference[flat]], reference[flat], -1)
        is_missing = reference < 0
        if is_missing.any():
            assign_references(corners, self.leaf[rows], reference)
        self.reference[rows] = reference
        self.is_changed[rows[is_missing]] = True
        del reference
        # Edges (3 · row + k) of flat triangles, on the border of the face: no triangle has the
        # reverse.
        edge = ((~has_area[:, np.newaxis] & edges).ravel()).nonzero()[0]
        forth, back = number_directed_edges(corners)
        back = back[edge]
        del corners
        edge = edge[~is_among(back, forth)]
        del forth, back
        # Of these, edges that are not one vertex and that no triangle with an area has, compared by
        # vertices.
        vertex = self.vertices[rows]
        keys = number_edges(vertex)
        ends = vertex.ravel()[edge], vertex[edge // 3, (edge + 1) % 3]
        del vertex
        is_bare = (ends[0] != ends[1]) & ~is_among(keys[edge], keys[np.repeat(has_area, 3)])
        self.bare = np.unique(self.leaf[rows[edge[is_bare] // 3]])

    def drop_neighbours(self) -> None:
        """Free the memory of neighbours and vertices, which are no longer needed."""
        self.across = self.vertices = np.empty((0, 3), dtype=np.intp)


def _append(rows: Ints, new: Ints) -> Ints:
    """The rows followed by the new rows; if there are no rows, `new` itself to save memory."""
    return np.concatenate([rows, new]) if len(rows) else new
