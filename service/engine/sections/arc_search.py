"""The search for the arcs of sections: from pairs of a plane and a net to arcs between points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_runs
from service.cancellation import checkpoint
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import QueryNets
from service.engine.sections.arcs import Arcs, find_arcs
from service.engine.sections.borders import ONE, BorderLines
from service.engine.sections.cells import EndedCells, LocalPlanes
from service.engine.sections.flatness import bound_sizes
from service.engine.sections.search import CellSearch
from service.engine.sections.segments import Segments, find_segments
from service.engine.sections.sides import find_sides
from service.engine.vectors import length

CHUNK_NODES = 1 << 14
"""How many points are computed at once."""


@dataclass(frozen=True, eq=False, slots=True)
class ArcNodes:
    """The arcs of some sections, with the points of their N nodes; crossings come last.

    Attributes
    ----------
    cells : EndedCells
    segments : Segments
    arcs : Arcs
    points : ndarray of float64, shape (N, 3)
        In the coordinates of the nets; projected onto the planes.
    plane : ndarray of int, shape (N,)
        The plane of each node.
    """

    cells: EndedCells
    segments: Segments
    arcs: Arcs
    points: FloatArray
    plane: Ints


@dataclass(eq=False, slots=True)
class ArcSearch:
    """The state of a search for arcs; lengths are in the coordinates of the nets.

    Attributes
    ----------
    nets : QueryNets
    borders : BorderLines
    local : LocalPlanes
    tolerance : float
    allow : callable
        As for `cut_surface`.
    is_lowered : bool
        Whether arcs are those for sections of solids (`arcs`).
    deviation : float
        The largest bound of the distance of a piece of a section from its arc.
    count : int
        The number of pieces so far.
    """

    nets: QueryNets
    borders: BorderLines
    local: LocalPlanes
    tolerance: float
    allow: Callable[[int], None]
    is_lowered: bool = False
    deviation: float = 0.0
    count: int = 0
    _earlier_count: int = 0
    """The number of pieces before the last call of `begin`."""
    _pairs: tuple[int, int] = 0, 0
    """The number of pairs of a plane and a net that `begin` announced, and the number that
    `find_cells` has begun."""

    def begin(self, pairs: int) -> None:
        """Prepare to cut a number of pairs of a plane and a net, in several calls."""
        self._earlier_count, self._pairs = self.count, (pairs, 0)

    def find_cells(self, plane: Ints, net: Ints) -> tuple[EndedCells | None, Ints]:
        """The cells that sections meet; `plane` and `net` are all pairs that may meet.

        The second result has a row (plane, net) for each net that lies in a plane, (c, 2).
        """
        pairs, begun_pairs = self._pairs
        self._pairs = pairs, begun_pairs + len(plane)
        parts: list[EndedCells] = []
        coplanar = [np.zeros((0, 2), np.intp)]
        width = 1 + max(max(group.degree) for group in self.nets.groups)
        for group, rows in self.nets.split(net):
            search = CellSearch(
                group, self.local, width, self.tolerance, self._allow, self.is_lowered
            )
            ended, is_coplanar = search.find(plane[rows], net[rows])
            self.deviation = max(self.deviation, search.deviation)
            in_plane = rows[is_coplanar]
            coplanar.append(np.stack([plane[in_plane], net[in_plane]], axis=1))
            self.count += sum(map(len, ended))
            parts += ended
        return EndedCells.join(parts) if parts else None, np.concatenate(coplanar)

    def find_nodes(self, cells: EndedCells) -> ArcNodes:
        """The arcs in cells that sections meet, and the points of their nodes."""
        sides = find_sides(cells, self.borders)
        segments = find_segments(cells, sides, self.borders)
        arcs = find_arcs(cells, sides, segments, is_lowered=self.is_lowered)
        checkpoint()
        points, plane = self._points(cells, segments, arcs)
        return ArcNodes(cells, segments, arcs, points, plane)

    def _allow(self, count: int, expected: float) -> None:
        """Call `allow` with a lower bound of the pieces, and with an estimate for all pairs."""
        self.allow(self.count + count)
        pairs, begun_pairs = self._pairs
        pieces = self.count - self._earlier_count + expected
        # The sections by the other planes may have fewer pieces: expect half as many.
        self.allow(int(self._earlier_count + pieces * max(1.0, pairs / begun_pairs / 2)))

    def _points(self, cells: EndedCells, segments: Segments, arcs: Arcs) -> tuple[FloatArray, Ints]:
        """The points (N, 3) of all nodes, and the number of the plane of each node, (N,).

        Points are in the coordinates of the nets, and are projected onto their planes. Crossings
        come last.
        """
        plane = segments.node_plane
        points = np.zeros((len(plane), 3))
        used_nodes = np.unique(np.concatenate([arcs.ends.ravel(), arcs.touching]))
        used_nodes = used_nodes[used_nodes < len(plane)]
        for first, last in row_runs(len(used_nodes), CHUNK_NODES):
            nodes = used_nodes[first:last]
            partials = net_partials(
                self.nets, segments.node_net[nodes], segments.node_parameters[:, nodes]
            )
            points[nodes] = partials[0].T  # the partial of order 0 is the point itself
        # A crossing, a group of singular cells, is one node: the mean of the middles of its cells.
        rows = np.flatnonzero(arcs.crossing >= 0)
        if len(rows):
            crossing = arcs.crossing[rows]
            middle = (cells.rectangle[::2, rows] + cells.rectangle[1::2, rows]) / (2 * ONE)
            positions = net_partials(self.nets, cells.net[rows], middle)[0].T
            sums = np.stack([np.bincount(crossing, positions[:, k]) for k in range(3)], axis=1)
            means = sums / np.bincount(crossing)[:, np.newaxis]
            points = np.concatenate([points, means])
            first_rows = rows[np.unique(crossing, return_index=True)[1]]
            plane = np.concatenate([plane, cells.plane[first_rows]])
            distances = length(positions - means[crossing], -1)
            self._note_crossings(cells, rows, distances)
        checkpoint()
        height = self.local.heights(plane, points)
        return points - height[:, np.newaxis] * self.local.normals[plane], plane

    def _note_crossings(self, cells: EndedCells, rows: Ints, distances: FloatArray) -> None:
        """Include in the deviation the distance of the section from the arcs at crossings.

        `rows` (k,) are the singular cells; `distances` (k,) are those of their middles from their
        crossings.

        The point of a crossing is the mean of the middles of a group of singular cells. The section
        in such a cell, and the ends of arcs on its border, are at most r = distance + size from
        this point. So the distance of the section from the arcs is at most 2 max r.
        """
        net, rectangle = cells.net[rows], cells.rectangle[:, rows] / ONE
        size = np.zeros(len(rows))
        for group, own in self.nets.split(net):
            size[own] = bound_sizes(group, net[own], rectangle[:, own])
        self.deviation = max(self.deviation, float(2 * (distances + size).max()))
