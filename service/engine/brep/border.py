"""The borders of all faces: loops as polygons of places, each side the image of a piece of an edge.

A *place* is a pair of whole numbers from 0 to 2^30 over the box of the parameter curves of a face.
"""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Polygons:
    """Closed polygons of places with M sides in all, in the order of faces and loops.

    Side i runs from place `begins[i]` to place `ends[i]`, with the material on its left; `ends[i]`
    is `begins[nexts[i]]`. In the mesh it runs from vertex `begin_vertices[i]` to vertex
    `end_vertices[i]`. They are equal in poles and in collapsed edges.

    Attributes
    ----------
    faces : ndarray of int, shape (M,)
        In ascending order.
    loops : ndarray of int, shape (M,)
        In ascending order.
    nexts : ndarray of int, shape (M,)
        The next side of the loop.
    begins, ends : ndarray of int, shape (M, 2)
        Places.
    begin_vertices, end_vertices : ndarray of int, shape (M,)
        Vertices of the mesh.
    """

    faces: Ints
    loops: Ints
    nexts: Ints
    begins: Ints
    ends: Ints
    begin_vertices: Ints
    end_vertices: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Border(Polygons):
    """The polygons of all loops: each side is the image of a piece of an edge, in its chord.

    Two sides with one `samples[i]` are the two images of one piece of an edge.

    Attributes
    ----------
    coedges : ndarray of int, shape (M,)
        In ascending order.
    samples : ndarray of int, shape (M,)
        The piece of the edge (the sample at which it begins, in the direction of the edge).
    segment_bounds : ndarray of float64, shape (M,)
        No point of the surface over the segment of places is further from the chord than this; NaN
        if it was not measured yet.
    sliver_bounds : ndarray of float64, shape (M,)
        The surface over the part of the trimmed region that is beyond the segment, outside of the
        polygon, is no further from the chord than this; NaN if it was not measured yet.
    rows : ndarray of int, shape (M,)
        The row of `places` at which each side begins.
    places : ndarray of float64, shape (C, 2)
        The places of all samples of all coedges before they are rounded and joined, coedge after
        coedge, each in the direction of its edge.
    shifts : ndarray of int, shape (C, 2)
        Units by which rounded places were moved, to keep loops apart: −1, 0 or 1.
    offsets : ndarray of int, shape (coedges + 1,)
        The rows of `places` of coedge c are those from `offsets[c]` to `offsets[c + 1] - 1`.
    """

    coedges: Ints
    samples: Ints
    segment_bounds: FloatArray
    sliver_bounds: FloatArray
    rows: Ints
    places: FloatArray
    shifts: Ints
    offsets: Ints


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
