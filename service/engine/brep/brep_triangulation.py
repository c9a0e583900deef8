"""The triangles of all faces of a brep, before they become a mesh."""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, Ints
from service.surface.brep_model import SkippedFace


@dataclass(frozen=True, eq=False, slots=True)
class BrepTriangulation:
    """T triangles over the F faces of a brep, with proved bounds.

    A *corner* is a place of one face at which triangles of this face meet. A vertex of the mesh has
    one corner for each of its faces, and one more where a face has it twice: at seams and poles.

    Attributes
    ----------
    positions : ndarray of float64, shape (N, 3)
        Points of the mesh, in model coordinates: the vertices of the brep come first, then the
        samples inside edges, then points inside faces. Some may belong to no triangle.
    triangles : ndarray of int, shape (T, 3)
        Corners, counter-clockwise about the outer normal of the face: `reversed` is applied. Sorted
        by face. No triangle has two equal points.
    faces : ndarray of int, shape (T,)
        The face of each triangle, ascending.
    points : ndarray of int, shape (K,)
        The point of each corner: row of `positions`.
    corner_faces : ndarray of int, shape (K,)
    places : ndarray of int, shape (K, 2)
        The place of each corner, of its face (`PreparedBrep.places`).
    face_bounds : ndarray of float64, shape (F,)
        No point of the trimmed face is further than this from the triangles of this face. It does
        not contain the gap of the edges. Infinite where no bound was proved.
    edge_bounds : ndarray of float64, shape (E,)
        No point of the edge is further than this from its polyline; 0 without a curve.
    mesh_bounds : ndarray of float64, shape (F,), or None
        No point of the triangles of a face is further than this from the trimmed face or its edges;
        infinite where no bound was proved. None unless `goal.two_sided`.
    edge_starts : ndarray of int, shape (E + 1,)
        The samples of edge e are rows `edge_starts[e]` to `edge_starts[e + 1]` of `edge_points`.
    edge_points : ndarray of int
        The points of the samples of edges, from the first vertex of an edge to its last.
    rounds : int
        How often triangles were measured.
    skipped_faces : tuple of SkippedFace
        Faces without triangles because the polygons of their loops cross or touch at this
        tolerance, or are reversed, although the loops are valid.
    """

    positions: FloatArray
    triangles: Ints
    faces: Ints
    points: Ints
    corner_faces: Ints
    places: Ints
    face_bounds: FloatArray
    edge_bounds: FloatArray
    mesh_bounds: FloatArray | None
    edge_starts: Ints
    edge_points: Ints
    rounds: int
    skipped_faces: tuple[SkippedFace, ...] = ()

    @property
    def bound(self) -> float:
        """The largest bound of faces and edges."""
        return max(float(self.face_bounds.max(initial=0.0)), float(self.edge_bounds.max(initial=0)))
