"""What the refinement ends with: samples, the vertices they are, triangles and their bounds."""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Triangulation:
    """A certified mesh of all faces, before it has normals.

    A sample is a vertex as one face sees it: faces that meet have samples of their own at the
    vertices they share, for normals and channels may differ there.

    Attributes
    ----------
    face, u, v : ndarray of int, shape (N,)
        Face and place of every sample (see `Faces`), face after face.
    vertex : ndarray of int, shape (N,)
        The vertex of every sample.
    positions : ndarray of float64, shape (V, 3)
        Vertices in model coordinates, not yet rounded. The first are those of the border.
    triangles : ndarray of int, shape (T, 3)
        Samples, counter-clockwise in (u, v); face after face. Their three vertices differ.
    bounds : ndarray of float64, shape (T,)
        No point of the part of the surface that falls to the triangle is further than this from
        the mesh as it is stored.
    mesh_bounds : ndarray of float64, shape (T,), or None
        No point of the stored triangle is further than this from the surface.
    """

    face: Ints
    u: Ints
    v: Ints
    vertex: Ints
    positions: FloatArray
    triangles: Ints
    bounds: FloatArray
    mesh_bounds: FloatArray | None
