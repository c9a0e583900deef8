"""Constrained Delaunay triangulations of faces, by the library pythoncdt.

Every face has a triangulation of its own: the segments of its loops, then points inside. The
library's predicates are exact, it adds no points, and it keeps the order of those it gets. Before
the Delaunay test v is multiplied by a power of two (`scales`), so places stay exact.

Segments of one face must not cross, and none may have a vertex inside it (`crossings`).
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pythoncdt

from service.bases.arrays import AnyArray, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.cancellation import checkpoint
from service.engine.brep.borders.border_vertices import BorderVertices
from service.surface.spline_tables import find_starts

SUPER = 3
"""Vertices that the library puts around all others; they belong to no triangle inside."""


class FaceTriangulations:
    """The triangulations of F faces, which grow by points inside.

    Corners have one number over all faces: first those of `BorderVertices`, then inner ones in the
    order in which they are inserted.

    Parameters
    ----------
    border : BorderVertices
    scales : ndarray of float64, shape (F,)
        Powers of two by which v is multiplied.
    """

    def __init__(self, border: BorderVertices, scales: FloatArray) -> None:
        self._scales, self._count = scales, len(border.places)
        self._triangulations: dict[int, pythoncdt.Triangulation] = {}
        self._numbers: dict[int, Ints] = {}
        self._seen: dict[int, tuple[Ints, Ints]] = {}
        points = self._scale(border.faces, border.places)
        starts, segment_starts = border.offsets, border.segment_offsets
        owners = border.faces[border.segments[:, 0]]
        segments = (border.segments - starts[owners][:, np.newaxis]).astype(np.uint32)
        with_segments = np.flatnonzero(np.diff(segment_starts))
        for face, first, last, begin, end in zip(
            with_segments.tolist(),
            *(starts[with_segments + k].tolist() for k in (0, 1)),
            *(segment_starts[with_segments + k].tolist() for k in (0, 1)),
            strict=True,
        ):
            checkpoint()
            triangulation = pythoncdt.Triangulation(
                pythoncdt.VertexInsertionOrder.AUTO,
                pythoncdt.IntersectingConstraintEdges.NOT_ALLOWED,
                0.0,
            )
            triangulation.insert_vertices(_to_buffer(points[first:last]))
            triangulation.insert_edges(_to_buffer(segments[begin:end]))
            self._triangulations[face] = triangulation
            self._numbers[face] = np.arange(first - SUPER, last)

    @property
    def faces(self) -> list[int]:
        """The faces that have a triangulation, ascending; others have no segments."""
        return list(self._triangulations)

    def insert(self, faces: Ints, places: Ints, first: int | None = None) -> None:
        """Insert points inside faces, (m,) ascending and (m, 2); no two at one place.

        They get the next numbers, or those from `first` on.
        """
        if not len(faces):
            return
        first = self._count if first is None else first
        self._count = first + len(faces)
        points = self._scale(faces, places)
        begins = find_begins(faces)
        ends = np.append(begins[1:], len(faces))
        for face, begin, end in zip(
            faces[begins].tolist(), begins.tolist(), ends.tolist(), strict=True
        ):
            checkpoint()
            self._triangulations[face].insert_vertices(_to_buffer(points[begin:end]))
            numbers = np.arange(first + begin, first + end)
            self._numbers[face] = np.concatenate([self._numbers[face], numbers])

    def read(self, faces: Iterable[int]) -> tuple[Ints, Ints]:
        """The triangles inside of these faces, face after face.

        Inside are the triangles that an odd number of segments separates from the outside.

        Returns
        -------
        corners : ndarray of int, shape (3, T)
            Counter-clockwise in places.
        previous : ndarray of int, shape (T,)
            The number of the same triangle among those of its face when this face was last read;
            −1 for new triangles.
        """
        chosen = list(faces)
        if not chosen:
            return np.empty((3, 0), np.intp), np.empty(0, np.intp)
        read = [self._triangulations[face] for face in chosen]
        parts = [each.triangles_array()["vertices"] for each in read]
        depths = np.concatenate([each.calculate_triangle_depths() for each in read])
        vertices = np.concatenate(parts).astype(np.intp)
        starts = find_starts(np.array([len(part) for part in parts]))
        tables = [self._numbers[face] for face in chosen]
        table_starts = find_starts(np.array([len(table) for table in tables]))
        inside = np.flatnonzero(depths & 1)
        owners = np.searchsorted(starts, inside, side="right") - 1
        at = vertices[inside] + table_starts[owners][:, np.newaxis]
        corners = np.concatenate(tables).take(at.T)
        # The number of each triangle inside among those of its face.
        rows = np.full(len(vertices), -1)
        rows[inside] = np.arange(len(inside)) - np.searchsorted(inside, starts)[owners]
        previous = np.full(len(vertices), -1)
        for face, begin, end in zip(chosen, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
            if face in self._seen:
                # The library keeps a triangle at its place until it changes.
                old_vertices, old_rows = self._seen[face]
                known = slice(begin, begin + len(old_rows))
                same = (vertices[known] == old_vertices).all(axis=1)
                previous[known] = np.where(same, old_rows, -1)
            self._seen[face] = vertices[begin:end], rows[begin:end]
        return corners, previous[inside]

    def _scale(self, faces: Ints, places: Ints) -> FloatArray:
        """Places (m, 2) as the library gets them."""
        points = places.astype(np.float64)
        points[:, 1] *= self._scales[faces]
        return points


def _to_buffer(array: AnyArray) -> Any:
    """The array as an argument of the library; NumPy has types for this from Python 3.12 on."""
    return array
