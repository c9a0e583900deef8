"""Sections of a surface by planes, in four steps: cells, segments, arcs, polylines.

The arrays of one step are computed for several planes at once. The section by one plane does not
depend on the other planes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_runs
from service.cancellation import checkpoint
from service.engine.connectivity.incidence import triangular_patches
from service.engine.connectivity.seams import Seams
from service.engine.curves.polyline import Polyline
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import QueryNets, surface_nets
from service.engine.sections.arcs import Arcs, find_arcs
from service.engine.sections.borders import ONE, BorderLines, find_border_lines
from service.engine.sections.cells import EndedCells, LocalPlanes, find_boxes, find_pairs
from service.engine.sections.flatness import bound_rounding, bound_sizes
from service.engine.sections.search import CellSearch
from service.engine.sections.segments import Segments, find_segments
from service.engine.sections.sides import find_sides, is_change
from service.engine.sections.trace import join_arcs
from service.engine.sections.values import Planes, Section, Sections
from service.engine.vectors import dot, length
from service.surface.lowered import PatchModel

CHUNK_NUMBERS = 1 << 16
"""How many coefficients of the polynomials f (`cells`) one chunk of pairs of a plane and a net
has, before halving; more only if one plane alone has more."""

MIN_TOLERANCE = 2.0**-38
"""The least tolerance in the coordinates of the nets, for a surface that is one point."""

MAX_DISTANCE = 2.0**-14
"""Touching points nearer than this to each other, in the coordinates of the nets, count as one
point, because several cells around one point may touch the plane."""

CHUNK_NODES = 1 << 14
"""How many points are computed at once."""

CHUNK_PAIRS = 1 << 20
"""How many pairs of a plane and a net have their boxes compared at once."""

TOLERANCE_FACTOR = 0.999
"""Sections are refined to this multiple of the tolerance. Formats round the bound up to four
digits, and the rounded bound must still be within the tolerance."""


def cut_surface(
    model: PatchModel,
    seams: Seams,
    planes: Planes,
    tolerance: float,
    allow: Callable[[int], None],
) -> Sections:
    """Cut a model with these seams by planes.

    Parameters
    ----------
    tolerance : float
        Model units.
    allow : callable
        Is called with lower bounds of the number of pieces, which are the cells that a section
        meets; raises an error if the number is too large. It is also called with estimates that the
        number will probably exceed, so that a refusal comes before the work.
    """
    nets = surface_nets(model.batches)
    borders = find_border_lines(nets, seams, triangular_patches(model.batches))
    local = LocalPlanes.of(planes, nets)
    local_tolerance = max(TOLERANCE_FACTOR * tolerance / nets.scale, MIN_TOLERANCE)
    search = _Search(nets, borders, local, planes, local_tolerance, allow)
    boxes = find_boxes(nets)
    sections: list[Section] = []
    planes_at_once = max(1, CHUNK_PAIRS // len(nets.patch))
    max_coefficients = max(group.nets[0, ..., 0].size for group in nets.groups)
    for first in range(0, len(planes), planes_at_once):
        last = min(first + planes_at_once, len(planes))
        plane, net = find_pairs(boxes, local, first, last)
        counts = np.bincount(plane - first, minlength=last - first)
        search.begin(len(plane))
        for low, high in _split_planes(counts, CHUNK_NUMBERS // max_coefficients):
            checkpoint()
            rows = slice(*np.searchsorted(plane, [first + low, first + high]))
            sections += search.cut(range(first + low, first + high), plane[rows], net[rows])
    slack = max(bound_rounding(group.nets) for group in nets.groups)
    bound = (search.deviation + slack) * nets.scale
    return Sections(model.name, model.up, planes, tuple(sections), bound)


def _split_planes(counts: Ints, max_pairs: int) -> Iterator[tuple[int, int]]:
    """Split planes into runs [first, last) that have together at most `max_pairs` pairs.

    `counts` has the number of pairs of each plane. A run has at least one plane.
    """
    first, totals = 0, np.cumsum(counts)
    while first < len(counts):
        most = totals[first] - counts[first] + max_pairs
        last = max(first + 1, int(np.searchsorted(totals, most, side="right")))
        yield first, last
        first = last


@dataclass(eq=False, slots=True)
class _Search:
    """The state of cutting a surface; lengths are in the coordinates of the nets."""

    nets: QueryNets
    borders: BorderLines
    local: LocalPlanes
    planes: Planes
    tolerance: float
    allow: Callable[[int], None]
    deviation: float = 0.0
    count: int = 0
    """The number of pieces so far."""
    _earlier_count: int = 0
    """The number of pieces before the last call of `begin`."""
    _pairs: tuple[int, int] = 0, 0
    """The number of pairs of a plane and a net that `begin` announced, and the number that `cut`
    has begun."""

    def begin(self, pairs: int) -> None:
        """Prepare to cut a number of pairs of a plane and a net, in several calls."""
        self._earlier_count, self._pairs = self.count, (pairs, 0)

    def cut(self, numbers: range, plane: Ints, net: Ints) -> list[Section]:
        """The sections by planes `numbers`; `plane` and `net` are all pairs that may meet."""
        pairs, begun_pairs = self._pairs
        self._pairs = pairs, begun_pairs + len(plane)
        parts: list[EndedCells] = []
        coplanar = [np.zeros((0, 2), np.intp)]
        width = 1 + max(max(group.degree) for group in self.nets.groups)
        for group, rows in self.nets.split(net):
            search = CellSearch(group, self.local, width, self.tolerance, self._allow)
            ended, is_coplanar = search.find(plane[rows], net[rows])
            self.deviation = max(self.deviation, search.deviation)
            in_plane = rows[is_coplanar]
            coplanar.append(np.stack([plane[in_plane], self.nets.patch[net[in_plane]]], axis=1))
            self.count += sum(map(len, ended))
            parts += ended
        coplanar_patches = np.unique(np.concatenate(coplanar), axis=0)
        polylines: list[list[Polyline]] = [[] for _ in numbers]
        touching = np.zeros((0, 3))
        plane_of_point = np.zeros(0, np.intp)
        if parts:
            touching, plane_of_point = self._draw(EndedCells.join(parts), numbers.start, polylines)
        return [
            Section(
                tuple(polylines[k - numbers.start]),
                touching[plane_of_point == k],
                coplanar_patches[coplanar_patches[:, 0] == k, 1],
            )
            for k in numbers
        ]

    def _allow(self, count: int, expected: float) -> None:
        """Call `allow` with a lower bound of the pieces, and with an estimate for all pairs."""
        self.allow(self.count + count)
        pairs, begun_pairs = self._pairs
        pieces = self.count - self._earlier_count + expected
        # The sections by the other planes may have fewer pieces: expect half as many.
        self.allow(int(self._earlier_count + pieces * max(1.0, pairs / begun_pairs / 2)))

    def _draw(
        self, cells: EndedCells, first: int, polylines: list[list[Polyline]]
    ) -> tuple[FloatArray, Ints]:
        """Add polylines to those of each plane; return touching points, and their planes.

        `polylines[k]` belongs to the plane with the number `first` + k.
        """
        sides = find_sides(cells, self.borders)
        segments = find_segments(cells, sides, self.borders)
        arcs = find_arcs(cells, sides, segments)
        checkpoint()
        points, plane = self._points(cells, segments, arcs)
        x, y = (axes[plane] for axes in self.planes.axes)
        positions_in_plane = np.stack([dot(points, x, -1), dot(points, y, -1)], axis=1)
        model_points = self.nets.origin + points * self.nets.scale
        checkpoint()
        touching = [arcs.touching]
        for nodes in join_arcs(arcs.ends, arcs.sense, positions_in_plane, self.tolerance):
            rows = model_points[nodes]
            rows = rows[is_change(*rows.T)]
            if len(rows) > 1:
                is_closed = bool(nodes[0] == nodes[-1])
                polylines[plane[nodes[0]] - first].append(Polyline(rows, is_closed))
            else:
                # All points are equal: a patch that is only a curve passes through the plane.
                touching.append(nodes[:1])
        arc_counts = np.bincount(arcs.ends.ravel(), minlength=len(points))
        crossings = np.flatnonzero(arc_counts > 2)
        separate = _keep_separate(points, np.concatenate(touching), crossings)
        return model_points[separate], plane[separate]

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


def _keep_separate(points: FloatArray, nodes: Ints, crossings: Ints) -> Ints:
    """The `nodes` that are not near a crossing, and not near an earlier node."""
    separate: list[int] = []
    crossing_points = points[crossings]
    for k in nodes.tolist():
        checkpoint()
        is_near = (
            np.abs(np.concatenate([crossing_points, points[separate]]) - points[k]).max(axis=1)
            <= MAX_DISTANCE
        )
        if not is_near.any():
            separate.append(k)
    return np.array(separate, np.intp)
