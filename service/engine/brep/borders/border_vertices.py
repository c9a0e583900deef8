"""The corners of the polygons of all faces, numbered for triangulation."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Ints
from service.engine.brep.borders.border import Polygons


@dataclass(frozen=True, eq=False, slots=True)
class BorderVertices:
    """The corners of the polygons of all faces as numbered vertices, for triangulation.

    Vertices have one number over all faces, those of face after face. Pieces of one face that begin
    at one place share the vertex: a crossing test has made sure that they share the vertex of the
    mesh, too. A piece whose ends are one place has no segment.

    Attributes
    ----------
    places : ndarray of int, shape (n, 2)
    vertices : ndarray of int, shape (n,)
        Vertices of the mesh.
    faces : ndarray of int, shape (n,)
        In ascending order.
    offsets : ndarray of int, shape (F + 1,)
        The vertices of face f are those from `offsets[f]` to `offsets[f + 1] - 1`.
    segments : ndarray of int, shape (s, 2)
        The segments between vertices, in the order and direction of the pieces of the border.
    pieces : ndarray of int, shape (s,)
        The row in `Border` of each segment.
    segment_offsets : ndarray of int, shape (F + 1,)
        The segments of face f are those from `segment_offsets[f]` to `segment_offsets[f + 1] - 1`.
    """

    places: Ints
    vertices: Ints
    faces: Ints
    offsets: Ints
    segments: Ints
    pieces: Ints
    segment_offsets: Ints

    @classmethod
    def of(cls, polygons: Polygons, face_count: int) -> "BorderVertices":
        """Number the corners of polygons, in the order of sides."""
        places = polygons.number_places()
        count = int(places.max(initial=-1)) + 1
        first = np.full(count, len(places))
        np.minimum.at(first, places, np.arange(len(places)))
        order = first.argsort()
        rank = np.empty(count, np.intp)
        rank[order] = np.arange(count)
        number, rows = rank[places], first[order]
        segments = np.stack([number, number[polygons.nexts]], axis=1)
        pieces = (segments[:, 0] != segments[:, 1]).nonzero()[0]
        faces = np.arange(face_count + 1)
        return cls(
            polygons.begins[rows],
            polygons.begin_vertices[rows],
            polygons.faces[rows],
            np.searchsorted(polygons.faces[rows], faces),
            segments[pieces],
            pieces,
            np.searchsorted(polygons.faces[pieces], faces),
        )
