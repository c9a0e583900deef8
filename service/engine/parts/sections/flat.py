"""Faces and edges that lie in planes.

Sections are those by planes that are a little lower (`edge_sides`). So the border of a face in the
plane is part of them if its material is below it. Otherwise the border is added here: the area of
the face belongs to the section of the closed solid. Edges in the plane that no polyline covers are
added, too: as closed lines, there and back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.parts.sections.paths import measure_to_lines, sample_edges
from service.engine.sections.trace import join_arcs

SAMPLES = 8
"""Points of an edge that tell whether polylines cover it: at least this many, less two."""


@dataclass(frozen=True, eq=False)
class FlatFaces:
    """Which faces lie in which planes: `is_flat` (F, m)."""

    is_flat: Bools

    @classmethod
    def of(cls, faces: FaceNets, borders: Borders, coplanar: Ints, run: range) -> "FlatFaces":
        """From pairs (k, 2) of a plane of the run and a net in it: faces all of whose nets are."""
        count = len(borders.is_reversed)
        nets = np.bincount(faces.face, minlength=count)
        flat = np.zeros((count, len(run)), np.intp)
        np.add.at(flat, (faces.face[coplanar[:, 1]], coplanar[:, 0] - run.start), 1)
        return cls((flat == nets[:, np.newaxis]) & (nets[:, np.newaxis] > 0))

    def contain(self, face: Ints, column: Ints) -> Bools:
        """Whether faces (k,) lie in planes (k,)."""
        is_flat: Bools = self.is_flat[face, column]
        return is_flat

    def list_faces(self, column: int) -> Ints:
        """The faces in a plane."""
        return self.is_flat[:, column].nonzero()[0]


@dataclass(frozen=True, eq=False)
class FlatDrawing:
    """Draws what lies in one plane.

    Attributes
    ----------
    borders : Borders
    axes : ndarray of float64, shape (2, 3)
        Unit vectors x and y of the plane; seen from the tip of its normal, y is to the left of x.
    tolerance : float
    """

    borders: Borders
    axes: FloatArray
    tolerance: float

    def draw(self, faces: Ints, edges: Ints, lines: Sequence[FloatArray]) -> list[FloatArray]:
        """The lines, as points (k, 3), that are to be added to `lines`.

        Parameters
        ----------
        faces, edges : ndarray of int, shapes (f,) and (e,)
            Faces and edges that lie in the plane.
        lines : sequence of ndarray of float64, shape (k, 3)
            The other polylines in the plane.
        """
        borders = self.borders
        uses = np.bincount(borders.coedge_edges, minlength=len(borders.edge_vertices))
        coedges = np.isin(borders.coedge_faces, faces).nonzero()[0]
        coedges = coedges[~borders.is_point[borders.coedge_edges[coedges]]]
        added: list[FloatArray] = []
        if len(coedges):
            added += self._draw_faces(coedges, uses)
        inner = np.bincount(borders.coedge_edges[coedges], minlength=len(uses)) == uses
        edges = edges[~inner[edges]]
        if len(edges):
            added += self._draw_edges(edges, uses, [*lines, *added])
        return added

    def _draw_faces(self, coedges: Ints, uses: Ints) -> list[FloatArray]:
        """The borders of faces that are not those of other faces; `coedges` are those of all."""
        borders = self.borders
        edge, face = borders.coedge_edges[coedges], borders.coedge_faces[coedges]
        is_back = borders.coedge_reversed[coedges]
        low, high = borders.edge_ranges[edge].T
        start, stop = np.where(is_back, high, low), np.where(is_back, low, high)
        row, points = sample_edges(borders, edge, start, stop, self.tolerance)
        flat = points @ self.axes.T
        step = (row[1:] == row[:-1]).nonzero()[0]
        # Twice the areas of faces, from the left of loops: negative if du × dv points down.
        turn = flat[step, 0] * flat[step + 1, 1] - flat[step, 1] * flat[step + 1, 0]
        area = np.bincount(face[row[step]], turn, minlength=len(borders.is_reversed))
        is_down = (area < 0) ^ borders.is_reversed
        is_down[face[uses[edge] == 1]] = True  # the border of a sheet has no other face
        is_drawn = is_down[face]
        # An edge between two such faces is no border.
        is_drawn &= np.bincount(edge[is_drawn], minlength=len(uses))[edge] == 1
        is_kept = is_drawn[row]
        row, points = row[is_kept], points[is_kept]
        if not len(row):
            return []
        # Samples are nodes; the first and the last of an edge are its vertices.
        count = len(borders.vertices)
        is_first, is_last = np.ones((2, len(row)), bool)
        is_first[1:] = row[1:] != row[:-1]
        is_last[:-1] = is_first[1:]
        ends = borders.edge_vertices[edge[row]]
        node = count + np.arange(len(row))
        back = is_back[row].astype(np.intp)
        rows = np.arange(len(row))
        node = np.where(is_first, ends[rows, back], np.where(is_last, ends[rows, 1 - back], node))
        step = (~is_last).nonzero()[0]
        lines = np.stack([node[step], node[step + 1]], axis=1)
        everywhere = np.concatenate([borders.vertices, points])
        sense = np.where(area[face[row[step]]] < 0, -1.0, 1.0)
        positions = everywhere @ self.axes.T
        joined = join_arcs(lines, sense, positions, self.tolerance, turns=True)
        return [everywhere[nodes] for nodes in joined]

    def _draw_edges(self, edges: Ints, uses: Ints, lines: Sequence[FloatArray]) -> list[FloatArray]:
        """Edges that are not covered by lines."""
        borders = self.borders
        low, high = borders.edge_ranges[edges].T
        row, points = sample_edges(borders, edges, low, high, self.tolerance)
        share = np.arange(1, SAMPLES) / SAMPLES
        each = np.arange(len(edges)).repeat(len(share))
        t = (low + np.outer(share, high - low)).T.ravel()
        tests = borders.edges.evaluate(*borders.edges.find(edges[each], t))
        is_near = measure_to_lines(tests, lines) <= 2 * self.tolerance
        is_covered = np.logical_and.reduceat(is_near, np.arange(0, len(each), len(share)))
        added = []
        for number in (~is_covered).nonzero()[0].tolist():
            line = points[row == number]
            is_open = uses[edges[number]] < 2
            added.append(line if is_open else np.concatenate([line, line[-2::-1]]))
        return added
