"""A mesh under way: its leaves, their polygons, triangles, and what is proved of each of them.

Where leaves are cut only their surroundings change. So everything keeps its number: what is cut
or replaced is marked as gone, and what is new is put behind what there is. The outline is computed
of the new leaves and of those around them alone, and what comes out of it as it was before stays.
"""

from collections.abc import Callable

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import Cells, Leaves
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.polygons.cell_boundaries import (
    BorderPlaces,
    CellBoundaries,
    trace_boundaries,
)
from service.engine.adaptive.polygons.triangles import (
    INDEX,
    TriangleRows,
    assign_hosts,
    build_triangles,
    find_crossed_edges,
    find_neighbours,
    is_among,
    number_directed_edges,
    number_edges,
)
from service.engine.adaptive.triangulation import Triangulation

Store = Callable[[FloatArray], FloatArray]

CROWD = 64
"""A leaf with more corners is cut, whatever its triangles are like;"""

MANY, BENT = 7, 4
"""one with so many, if one of its sides is so many times further from its chord than is allowed, as
at the rim of a disc. Its triangles would be narrow, and the surface over them beside them."""

OVERHEAD = 4000
"""What it takes to make triangles of a leaf, in multiplications, about."""

NONE = np.empty(0, dtype=np.intp)


class Draft:
    """Leaves, samples and triangles; what is gone keeps its number.

    Attributes
    ----------
    leaves : Leaves
        All that there were.
    face, u, v, vertex : ndarray of int, shape (N,)
        Samples: a vertex as a face sees it.
    positions, places : ndarray of float64, shape (V, 3)
        Vertices as they are stored, and as they were evaluated; those of the border first.
    corners : ndarray of int, shape (T, 3)
        Samples at the corners of triangles, counter-clockwise.
    vertices : ndarray of int, shape (T, 3)
        Vertices there.
    vanished : ndarray of bool, shape (T,)
        Whether two of them are one.
    leaf, segment, base : ndarray of int, shape (T,)
        See `TriangleRows`.
    host : ndarray of int, shape (T,)
        The triangle to which the surface over this one falls: itself, unless two of its vertices
        are one; then one beside it, or −1 if the whole face has none.
    beside : ndarray of int, shape (T, 3)
        The triangle beyond edge k, k+1 in the same face, if there is just one, or else −1;
    across : ndarray of int, shape (T, 3)
        the vertex opposite to the edge there.
    alive : ndarray of bool, shape (T,)
        Which triangles of places there are still.
    dirty : ndarray of bool, shape (T,)
        Which have changed, with what is across their edges, or are gone, since the last round.
    bare : ndarray of int
        Leaves with a piece of the border that no triangle has for an edge.
    crossed : ndarray of int, shape (X, 2)
        Triangles, and which of their edges, where more than two meet that are not all borders.
    """

    def __init__(self, task: Task, border: Border, stored: Store) -> None:
        self.task, self.border, self.stored = task, border, stored
        self.rim = BorderPlaces.of(task.faces, border)
        self.halvings = np.zeros(len(border.at), dtype=np.intp)
        self.leaves: Leaves | None = None
        self.present = np.zeros(0, dtype=bool)
        self.first = self.size = self.owner = self.polygon = NONE
        self.touching = np.empty((2, 0), dtype=np.intp)
        self.face = self.u = self.v = self.vertex = self.entry = NONE
        self.places, self.positions = border.points, stored(border.points)
        self.corners = self.vertices = np.empty((0, 3), dtype=np.intp)
        self.beside = self.across = self.corners
        self.leaf = self.segment = self.base = self.host = self.bare = NONE
        self.alive = self.dirty = self.vanished = np.zeros(0, dtype=bool)
        self.crossed = np.empty((0, 2), dtype=np.intp)

    @property
    def kept(self) -> Bools:
        """Which triangles are part of the mesh, shape (T,)."""
        kept: Bools = self.alive & (self.host == np.arange(len(self.host)))
        return kept

    def renew(self, fresh: Leaves, cut: Ints = NONE, flat: Ints = NONE) -> None:
        """Put leaves in the place of those that were cut; and strips over these segments anew."""
        while True:
            near, far = self._around(cut, flat)
            old = np.concatenate([near, far])
            parts = [fresh] if self.leaves is None else [fresh, self.leaves.take(old)]
            some = Leaves.concatenate(parts)
            self.task.budget.spend(OVERHEAD * len(some))
            outline = trace_boundaries(self.rim, some.cells, self.halvings)
            size = outline.start[1:] - outline.start[:-1]
            crowd = self._crowded(size[: len(fresh) + len(near)], some)
            if not len(crowd):
                break
            along_v = _crowded_along_v(outline, some.cells, crowd)
            halves = some.cells.take(crowd).halve(along_v)
            mine = crowd < len(fresh)
            rest = np.delete(np.arange(len(fresh)), crowd[mine])
            fresh = Leaves.concatenate(
                [fresh.take(rest), divide_cells(self.task, Cells.concatenate([*halves]))]
            )
            cut = np.concatenate([cut, near[crowd[~mine] - len(fresh.take(rest)) - mine.sum()]])
        found = [self._replace(outline, some, len(fresh), near, (cut, far))]
        # What is beside triangles takes memory of its own.
        del outline, some, parts, fresh
        self._add(*found.pop())

    def _crowded(self, size: Ints, leaves: Leaves) -> Ints:
        """Leaves with too many corners, of the first ones, whose numbers of corners are known."""
        many = (size >= MANY).nonzero()[0]
        if not len(many):
            return many
        # Corners, each with the middle of the side after it.
        u0, u1, v0, v1 = leaves.cells.box[:, many]
        u, v = (u0 + u1) // 2, (v0 + v1) // 2
        us, vs = np.array([u0, u, u1, u1, u1, u, u0, u0]), np.array([v0, v0, v0, v, v1, v1, v1, v])
        face = np.concatenate([leaves.cells.face[many]] * 8)
        at = self.task.evaluate_points(face, us.ravel(), vs.ravel()).reshape(8, -1, 3)
        away, along = at[1::2] - at[::2], at[[2, 4, 6, 0]] - at[::2]
        square = np.maximum((along * along).sum(axis=2), np.finfo(float).tiny)
        away -= ((away * along).sum(axis=2) / square)[..., np.newaxis] * along
        stray = np.sqrt((away * away).sum(axis=2)).max(axis=0)
        crowd: Ints = many[(stray > BENT * leaves.form[6, many]) | (size[many] > CROWD)]
        return crowd

    def _around(self, cut: Ints, flat: Ints) -> tuple[Ints, Ints]:
        """Leaves that may change with those that are cut, and those that tell how they look."""
        if self.leaves is None:
            return NONE, NONE
        gone = np.zeros(len(self.present), dtype=bool)
        gone[cut] = True
        near = gone.copy()
        self._spread(near, flat)
        far = near.copy()
        self._spread(far, NONE)
        return (near & ~gone).nonzero()[0], (far & ~near).nonzero()[0]

    def _spread(self, leaves: Bools, segments: Ints) -> None:
        """Adds leaves that have a sample, or a segment of the border, in common with these."""
        mark = np.zeros(len(self.face), dtype=bool)
        mark[self.polygon[leaves[self.owner]]] = True
        together = np.zeros(len(self.border.at), dtype=bool)
        segment, leaf = self.touching
        together[segment[leaves[leaf]]] = True
        together[segments] = True
        leaves[self.owner[mark[self.polygon]]] = True
        leaves[leaf[together[segment]]] = True
        leaves &= self.present

    def _replace(
        self,
        outline: CellBoundaries,
        some: Leaves,
        count: int,
        near: Ints,
        others: tuple[Ints, Ints],
    ) -> tuple[TriangleRows, Bools]:
        """Take over what is new of an outline, the first leaves of which are new, others near.

        Returns
        -------
        Rows and ndarray of bool, shape (T,)
            New triangles, and which of the old ones are gone.
        """
        cut, far = others
        begin = len(self.present)
        number = np.concatenate([begin + np.arange(count), near, far])
        sample = self._samples(outline, np.concatenate([cut, near, far]))
        polygon = sample[outline.corner]
        changed = np.zeros(len(number), dtype=bool)
        changed[:count] = True
        changed[count : count + len(near)] = self._differs(outline, polygon, count, near)
        mine = changed.nonzero()[0]
        self._store(outline, some, count, (cut, number, mine), polygon)
        segments = np.zeros(len(self.border.at), dtype=bool)
        segments[outline.touching[0, changed[outline.touching[1]]]] = True
        points = self.places[self.vertex[sample]]
        rows = build_triangles(outline, some, points, changed, segments)
        gone = np.zeros(begin + count + 1, dtype=bool)
        gone[cut], gone[number[mine]] = True, True
        gone[-1] = False
        dead = self.alive & (gone[self.leaf] | ((self.leaf < 0) & segments[self.segment]))
        leaf = np.where(rows.leaf < 0, -1, number[rows.leaf])
        return TriangleRows(sample[rows.corners], leaf, rows.segment, rows.base), dead

    def _samples(self, outline: CellBoundaries, leaves: Ints) -> Ints:
        """The samples of an outline among all; those that are new are added."""
        known = NONE
        number = np.full(len(outline.face), -1)
        if len(self.face):
            mark = np.zeros(len(self.face), dtype=bool)
            here = np.zeros(len(self.present), dtype=bool)
            here[leaves] = True
            mark[self.polygon[here[self.owner]]] = True
            mark[self.entry] = True
            known = mark.nonzero()[0]
            columns = [
                np.concatenate(pair)
                for pair in (
                    (outline.face, self.face[known]),
                    (outline.u, self.u[known]),
                    (outline.v, self.v[known]),
                )
            ]
            order = np.lexsort(columns[::-1])
            same = np.logical_and.reduce([c[order[1:]] == c[order[:-1]] for c in columns])
            hits = same.nonzero()[0]
            number[order[hits]] = known[order[hits + 1] - len(number)]
        fresh = (number < 0).nonzero()[0]
        number[fresh] = len(self.face) + np.arange(len(fresh))
        vertex = outline.vertex[fresh]
        inner = (vertex >= len(self.border.points)).nonzero()[0]
        vertex[inner] = len(self.places) + np.arange(len(inner))
        row = fresh[inner]
        if len(row):
            points = self.task.evaluate_points(outline.face[row], outline.u[row], outline.v[row])
            self.places = np.concatenate([self.places, points])
            self.positions = np.concatenate([self.positions, self.stored(points)])
        self.face = np.concatenate([self.face, outline.face[fresh]])
        self.u = np.concatenate([self.u, outline.u[fresh]])
        self.v = np.concatenate([self.v, outline.v[fresh]])
        self.vertex = np.concatenate([self.vertex, vertex])
        self.entry = number[outline.entry]
        return number

    def _differs(self, outline: CellBoundaries, polygon: Ints, count: int, near: Ints) -> Bools:
        """Which leaves have another polygon than before: of those after the first ones."""
        start = outline.start[count : count + len(near) + 1]
        size = start[1:] - start[:-1]
        differs: Bools = size != self.size[near]
        same = (~differs).nonzero()[0]
        if len(same):
            row = np.repeat(same, size[same])
            step = np.arange(len(row)) - np.repeat(np.cumsum(size[same]) - size[same], size[same])
            other = polygon[start[row] + step] != self.polygon[self.first[near[row]] + step]
            differs[row[other]] = True
        return differs

    def _store(
        self,
        outline: CellBoundaries,
        some: Leaves,
        count: int,
        which: tuple[Ints, Ints, Ints],
        polygon: Ints,
    ) -> None:
        """New leaves and new polygons; those that are gone have no owner any more."""
        cut, number, mine = which
        size = outline.start[1:] - outline.start[:-1]
        if self.leaves is None:
            self.leaves, self.present = some, np.ones(count, dtype=bool)
            self.first, self.size, self.polygon = outline.start[:-1], size, polygon
            self.owner, self.touching = np.repeat(np.arange(count), size), outline.touching
            return
        self.leaves = Leaves.concatenate([self.leaves, some.take(np.arange(count))])
        self.present[cut] = False
        self.present = np.concatenate([self.present, np.ones(count, dtype=bool)])
        more = np.zeros(count, dtype=np.intp)
        self.first, self.size = (
            np.concatenate([values, more]) for values in (self.first, self.size)
        )
        gone = ~self.present
        gone[number[mine]] = True
        left = (~gone[self.owner]).nonzero()[0]
        # Polygons are where they were, but for those that are gone.
        place = np.cumsum(~gone[self.owner]) - 1
        keep = (~gone[: len(gone) - count]).nonzero()[0]
        self.first[keep] = place[self.first[keep]]
        row = np.repeat(mine, size[mine])
        offset = np.cumsum(size[mine]) - size[mine]
        step = np.arange(len(row)) - np.repeat(offset, size[mine])
        self.first[number[mine]], self.size[number[mine]] = offset + len(left), size[mine]
        self.polygon = np.concatenate([self.polygon[left], polygon[outline.start[row] + step]])
        self.owner = np.concatenate([self.owner[left], number[row]])
        here = (outline.touching[1] < count).nonzero()[0]
        added = outline.touching[:, here].copy()
        added[1] = number[added[1]]
        before = self.touching[:, self.present[self.touching[1]]]
        self.touching = np.concatenate([before, added], axis=1)

    def _add(self, rows: TriangleRows, dead: Bools) -> None:
        """Add triangles, and find out again what is beside them and those around."""
        begin, count = len(self.alive), len(rows.leaf)
        self.corners = _more(self.corners, rows.corners)
        self.leaf = _more(self.leaf, rows.leaf)
        self.segment = _more(self.segment, rows.segment)
        self.base = _more(self.base, np.where(rows.base < 0, -1, rows.base + begin))
        fresh = self.vertex[rows.corners].astype(INDEX)
        del rows
        a, b, c = fresh.T
        lost = (a == b) | (b == c) | (c == a)
        self.vertices = _more(self.vertices, fresh)
        self.vanished = np.concatenate([self.vanished, lost])
        self.host = _more(self.host, np.where(lost, -1, begin + np.arange(count)))
        none = np.full((count, 3), -1, dtype=INDEX)
        self.beside, self.across = _more(self.beside, none), _more(self.across, none.copy())
        del fresh, none
        self.alive = np.concatenate([self.alive & ~dead, np.ones(count, dtype=bool)])
        self.dirty = np.concatenate([dead, np.ones(count, dtype=bool)])
        if not begin:
            self._join(slice(None), np.ones((count, 3), dtype=bool))
            return
        # An edge may have changed if both of its ends are vertices of what is new or gone.
        mark = np.zeros(len(self.places), dtype=bool)
        mark[self.vertices[self.dirty]] = True
        one, two, three = (mark[self.vertices[:, k]] & self.alive for k in range(3))
        edge = np.stack([one & two, two & three, three & one], axis=1)
        some = (edge[:, 0] | edge[:, 1] | edge[:, 2]).nonzero()[0]
        self._join(some, edge[some])
        # ReferenceTriangles that are gone had all their vertices marked; who has one still is cut.
        lost = (self.vanished & self.alive).nonzero()[0]
        orphans = lost[(self.host[lost] >= 0) & ~self.alive[self.host[lost]]]
        self.host[orphans] = -1

    def _join(self, some: Ints | slice, both: Bools) -> None:
        """Hosts and neighbours of some triangles, at those edges of which `both` ends changed."""
        number = np.arange(len(self.host))[some]
        kept = ~self.vanished[some]
        self.bare = NONE
        if not kept.all():
            self._find_hosts(number, kept, both)
        vertex, corners = self.vertices[some], self.corners[some]
        beside, across, crowd = find_neighbours(vertex, kept, self.face[corners[:, 0]])
        if not isinstance(some, slice):
            beside = np.where(beside >= 0, number[beside], -1)
        changed = both & (self.across[some] != across)
        self.dirty[number[changed.any(axis=1)]] = True
        self.across[some] = np.where(both, across, self.across[some])
        del across
        self.beside[some] = np.where(both, beside, self.beside[some])
        crowd = crowd[both.ravel()[crowd]]
        self.crossed = (
            find_crossed_edges(corners, crowd) if len(crowd) else np.empty((0, 2), dtype=np.intp)
        )
        self.crossed[:, 0] = number[self.crossed[:, 0]]

    def _find_hosts(self, some: Ints, kept: Bools, both: Bools) -> None:
        """Hosts of those of some triangles that are not kept; and leaves that are bare."""
        corners, host = self.corners[some], self.host[some]
        lost = ~kept & (host >= 0)
        host[lost] = np.where(self.alive[host[lost]], host[lost], -1)
        moved = host < 0
        if moved.any():
            assign_hosts(corners, self.leaf[some], host)
        self.host[some] = host
        self.dirty[some[moved]] = True
        del host
        side = ((~kept[:, np.newaxis] & both).ravel()).nonzero()[0]
        there, back = number_directed_edges(corners)
        back = back[side]
        del corners
        side = side[~is_among(back, there)]
        del there, back
        vertex = self.vertices[some]
        keys = number_edges(vertex)
        ends = vertex.ravel()[side], vertex[side // 3, (side + 1) % 3]
        del vertex
        open_ = (ends[0] != ends[1]) & ~is_among(keys[side], keys[np.repeat(kept, 3)])
        self.bare = np.unique(self.leaf[some[side[open_] // 3]])

    def finish(self, deviation: FloatArray, mesh: FloatArray | None) -> Triangulation:
        """The mesh, with the greatest bound of all that falls to each triangle."""
        # What was found beside triangles is not looked up any more.
        self.beside = self.across = self.vertices = np.empty((0, 3), dtype=np.intp)
        rows = self.kept.nonzero()[0]
        lost = (self.alive & ~self.kept).nonzero()[0]
        for values in (deviation, mesh):
            if values is not None and len(lost):
                np.maximum.at(values, self.host[lost], values[lost])
        corners = self.corners[rows]
        used = np.zeros(len(self.face), dtype=bool)
        used[self.polygon] = True
        used[self.entry] = True
        samples = used.nonzero()[0]
        samples = samples[np.lexsort((self.v[samples], self.u[samples], self.face[samples]))]
        number = np.empty(len(self.face), dtype=np.intp)
        number[samples] = np.arange(len(samples))
        vertex = self.vertex[samples]
        inner = (vertex >= len(self.border.points)).nonzero()[0]
        places = np.concatenate([self.border.points, self.places[vertex[inner]]])
        vertex[inner] = len(self.border.points) + np.arange(len(inner))
        order = np.argsort(self.face[corners[:, 0]], kind="stable")
        rows = rows[order]
        return Triangulation(
            self.face[samples],
            self.u[samples],
            self.v[samples],
            vertex,
            places,
            number[corners[order]],
            deviation[rows],
            None if mesh is None else mesh[rows],
        )


def _more(rows: Ints, new: Ints) -> Ints:
    """Rows and what is new behind them; what is new itself, if there is nothing yet."""
    return np.concatenate([rows, new]) if len(rows) else new


def _crowded_along_v(outline: CellBoundaries, cells: Cells, crowd: Ints) -> Bools:
    """Which leaves with too many corners have more of them along v."""
    along_v = np.empty(len(crowd), dtype=bool)
    for row, leaf in enumerate(crowd.tolist()):
        corner = outline.corner[outline.start[leaf] : outline.start[leaf + 1]]
        u, v, box = outline.u[corner], outline.v[corner], cells.box[:, leaf]
        on_u, on_v = np.isin(u, box[:2]).sum(), np.isin(v, box[2:]).sum()
        along_v[row] = on_u > on_v
    return along_v
