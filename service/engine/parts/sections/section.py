"""Sections of parts by planes: closed polylines for closed solids.

The sections of the surfaces of all faces are arcs (`service.engine.sections`). They are cut at the
borders of the regions (`face_arcs`), and the arcs of different faces are joined at edges (`links`).

Proof in docs/proofs.md: "Sections of parts".
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.curves.polyline import Polyline
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.clusters import CLUSTER
from service.engine.parts.sections.edge_sides import EdgeSides, find_edge_sides
from service.engine.parts.sections.ends import find_ends
from service.engine.parts.sections.face_arcs import ArcsOfFaces, FaceArcs
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.parts.sections.flat import FlatDrawing, FlatFaces
from service.engine.parts.sections.graph import Graph, build_graph
from service.engine.parts.sections.links import find_links
from service.engine.parts.sections.unclear import UnclearCells
from service.engine.sections.arc_search import ArcNodes, ArcSearch
from service.engine.sections.cells import LocalPlanes
from service.engine.sections.cut_pieces import bound_parts
from service.engine.sections.flatness import bound_rounding
from service.engine.sections.section import (
    MIN_TOLERANCE,
    TOLERANCE_FACTOR,
    keep_separate,
    list_chunks,
)
from service.engine.sections.sides import is_change
from service.engine.sections.trace import join_arcs
from service.engine.sections.values import Planes, Section
from service.engine.trims.inside import OUTSIDE
from service.engine.vectors import dot, length

CHUNK_NUMBERS = 1 << 19
"""How many heights of control points of borders are computed at once."""

MERGED = 2.0**-12
"""Ends of arcs are moved to joints that are nearer than this share of the tolerance."""

SMALL = 2.0**-36
"""A line that is smaller than this, in the coordinates of the nets, is a point."""


@dataclass(eq=False, slots=True)
class FaceSections:
    """Cuts the faces of breps by planes; lengths are in the coordinates of the nets."""

    faces: FaceNets
    borders: Borders
    planes: Planes
    search: ArcSearch
    extent: FloatArray
    moved: float = 0.0
    unclear: float = 0.0

    @classmethod
    def of(
        cls,
        faces: FaceNets,
        borders: Borders,
        planes: Planes,
        tolerance: float,
        allow: Callable[[int], None],
    ) -> "FaceSections":
        """The sections of faces; `tolerance` is in model units."""
        local = LocalPlanes.of(planes, faces.nets)
        local_tolerance = max(TOLERANCE_FACTOR * tolerance / faces.nets.scale, MIN_TOLERANCE)
        search = ArcSearch(faces.nets, faces.find_lines(), local, local_tolerance, allow, True)
        count = len(borders.is_reversed)
        low, high = np.full((2, count, 2), [[[np.inf]], [[-np.inf]]])
        np.minimum.at(low, faces.face, faces.low)
        np.maximum.at(high, faces.face, faces.high)
        return cls(faces, borders, planes, search, np.maximum(high - low, 1e-300))

    @property
    def deviation(self) -> float:
        """No point of a section is further than this from the polylines. Model units."""
        nets = self.faces.nets
        slack = max(bound_rounding(group.nets) for group in nets.groups)
        return (max(self.search.deviation + self.moved, self.unclear) + slack) * nets.scale

    def cut(self) -> list[Section]:
        """The section by each plane."""
        sections: list[Section] = []
        for numbers, plane, net in self._list_runs():
            sections += self._cut(numbers, plane, net)
        return sections

    def _list_runs(self) -> Iterator[tuple[range, Ints, Ints]]:
        """The runs of `list_chunks`, so short that borders take a limited memory."""
        numbers = self.borders.edges.numbers + self.borders.images.numbers
        most = max(1, CHUNK_NUMBERS // max(1, numbers))
        for planes, plane, net in list_chunks(self.search):
            for first in range(planes.start, planes.stop, most):
                run = range(first, min(first + most, planes.stop))
                rows = np.arange(*np.searchsorted(plane, [run.start, run.stop]))
                rows = rows[self.faces.is_face[net[rows]]]
                yield run, plane[rows], net[rows]

    def _cut(self, run: range, plane: Ints, net: Ints) -> list[Section]:
        """The sections by a run of planes; `plane` and `net` are all pairs that may meet."""
        lines: list[list[FloatArray]] = [[] for _ in run]
        touching = [np.zeros((0, 3))] * len(run)
        cells, coplanar = self.search.find_cells(plane, net)
        flat = FlatFaces.of(self.faces, self.borders, coplanar, run)
        numbers = np.arange(run.start, run.stop)
        sides = find_edge_sides(self.borders, self.search.local, numbers)
        checkpoint()
        if cells is not None:
            found = self.search.find_nodes(cells)
            checkpoint()
            points, column = self._draw(found, sides, flat, numbers, lines)
            touching = [points[column == k] for k in range(len(run))]
            unclear = UnclearCells.of(self.faces, found, run.start)
        for k in range(len(run)):
            faces, edges = flat.list_faces(k), sides.flat_edges[sides.flat_columns == k]
            if len(faces) or len(edges):
                axes = np.array([each[run[k]] for each in self.planes.axes])
                drawing = FlatDrawing(self.borders, axes, self.search.tolerance)
                lines[k] += drawing.draw(faces, edges, lines[k])
            if cells is not None and unclear.has(k):
                added, deviation = unclear.cover(k, [*lines[k], touching[k]], self.search.tolerance)
                touching[k] = np.concatenate([touching[k], added])
                self.unclear = max(self.unclear, deviation)
        return [
            Section(
                tuple(Polyline(*self._finish(line, run[k])) for line in lines[k]),
                self._to_model(touching[k], run[k]),
                flat.list_faces(k),
            )
            for k in range(len(run))
        ]

    def _finish(self, line: FloatArray, plane: int) -> tuple[FloatArray, bool]:
        """The points of a line in model coordinates, without repetition; whether it is closed."""
        is_closed = bool((line[0] == line[-1]).all())
        points = self._to_model(line, plane)
        if is_closed:
            points[-1] = points[0]
        return points[is_change(*points.T)], is_closed

    def _to_model(self, points: FloatArray, plane: int) -> FloatArray:
        """Points (m, 3) in model coordinates, after projection onto a plane."""
        local = self.search.local
        height = local.heights(np.full(len(points), plane), points)
        points = points - height[:, np.newaxis] * local.normals[plane]
        model: FloatArray = self.faces.nets.origin + points * self.faces.nets.scale
        return model

    def _draw(
        self,
        found: ArcNodes,
        sides: EdgeSides,
        flat: "FlatFaces",
        numbers: Ints,
        lines: list[list[FloatArray]],
    ) -> tuple[FloatArray, Ints]:
        """Add lines to those of each plane; return touching points, and their planes."""
        borders, search = self.borders, self.search
        ends, begins_below = find_ends(borders, search.local, numbers)
        whole = ArcsOfFaces.of(self.faces, found, int(numbers[0]))
        is_left_out = flat.contain(whole.face, whole.column)
        arcs, places = whole.cut(borders, ends, is_left_out, self.extent)
        end_points = borders.images.evaluate(ends.piece, self._find_share(ends.piece, ends.t))
        self._note_cut(found, arcs, whole, (places, end_points))
        links = find_links(borders, sides, ends, begins_below)
        joints = sides.joints
        piece, joint_share = borders.edges.find(joints.edge, joints.t)
        points = np.concatenate(
            [
                found.points,
                end_points,
                borders.edges.evaluate(piece, joint_share),
            ]
        )
        column = np.concatenate([found.plane - numbers[0], ends.column, joints.column])
        face = np.concatenate(
            [whole.node_face, borders.coedge_faces[ends.coedge], np.full(len(joints), -1)]
        )
        inner = len(found.points)
        graph = build_graph(
            borders,
            arcs,
            links,
            (points, column, face),
            (inner, len(ends), search.tolerance, MERGED * search.tolerance),
        )
        self.moved = max(self.moved, graph.moved)
        free = self._join(graph, numbers, lines)
        touched = found.arcs.touching
        is_inside = borders.find_inside(whole.node_face[touched], whole.parameters[touched])
        is_left_out = flat.contain(whole.node_face[touched], column[touched])
        touched = touched[(is_inside != OUTSIDE) & ~is_left_out]
        count = len(graph.points)
        points = np.concatenate([graph.points, sides.touching])
        columns = np.concatenate([graph.column, sides.touching_columns])
        chosen = np.concatenate([touched, free, np.arange(count, len(points))])
        # Points of different planes are apart, but they may be near each other.
        kept = [chosen[columns[chosen] == k] for k in range(len(numbers))]
        none = np.zeros(0, np.intp)
        separate = np.concatenate([keep_separate(points, each, none) for each in kept])
        return points[separate], columns[separate]

    def _find_share(self, piece: Ints, t: FloatArray) -> FloatArray:
        """The shares (m,) of pieces of images at parameters t (m,)."""
        images = self.borders.images
        width = images.high[piece] - images.low[piece]
        share = (t - images.low[piece]) / np.where(width > 0, width, 1.0)
        return np.clip(share, 0.0, 1.0)

    def _join(self, graph: Graph, numbers: Ints, lines: list[list[FloatArray]]) -> Ints:
        """Add the lines of a graph; return nodes of lines that are only a point."""
        x, y = (axes[numbers[graph.column]] for axes in self.planes.axes)
        positions = np.stack([dot(graph.points, x, -1), dot(graph.points, y, -1)], axis=1)
        free: list[int] = []
        checkpoint()
        tolerance = self.search.tolerance
        for nodes in join_arcs(graph.lines, graph.sense, positions, tolerance, turns=True):
            line = graph.points[nodes]
            if (line.max(axis=0) - line.min(axis=0)).max() <= SMALL:
                free.append(int(nodes[0]))
            else:
                lines[graph.column[nodes[0]]].append(line)
        return np.array(free, np.intp)

    def _note_cut(
        self,
        found: ArcNodes,
        arcs: FaceArcs,
        whole: ArcsOfFaces,
        ends: tuple[FloatArray, FloatArray],
    ) -> None:
        """Include in the deviation the parts of arcs that were cut.

        `ends` are the parameters (k, 2) and the points (k, 3) of the ends.
        """
        rows = (arcs.cell >= 0).nonzero()[0]
        if not len(rows):
            return
        places, points = ends
        everywhere = np.concatenate([whole.parameters, places])
        begin, end = (everywhere[arcs.nodes[k, rows]] for k in range(2))
        step = np.abs(end - begin) / self.extent[arcs.face[rows]]
        is_short = step.max(axis=1) <= CLUSTER
        positions = np.concatenate([found.points, points])
        one, two = (positions[arcs.nodes[k, rows[is_short]]] for k in range(2))
        self.moved = max(self.moved, float(length(one - two, -1).max(initial=0.0)))
        rows = rows[~is_short]
        if not len(rows):
            return
        cells = found.cells.take(arcs.cell[rows])
        low, high = self.faces.low[cells.net], self.faces.high[cells.net]
        begin, end = (
            np.clip((x[~is_short] - low) / (high - low), 0.0, 1.0).T for x in (begin, end)
        )
        bounds = bound_parts(self.faces.nets, self.search.local, cells, begin, end)
        self.search.deviation = max(self.search.deviation, float(bounds.max()))
