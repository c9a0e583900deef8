"""The result of the engine: a mesh."""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.engine.mesh.report import MeshReport
from service.surface.checks import Up
from service.surface.lowered import Color


@dataclass(frozen=True, slots=True)
class MeshPart:
    """A named run of faces: rows [first, last) of `Mesh.triangles` and of `Mesh.quads`.

    `color` is the base colour of these faces, or None. `deviation_bound` is as in `MeshReport`, for
    the surface of this part.
    """

    name: str
    triangles: tuple[int, int]
    quads: tuple[int, int]
    color: Color | None = None
    deviation_bound: float | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Overlay:
    """Lines drawn beside the faces: a control net, the patch boundaries.

    Attributes
    ----------
    positions : ndarray, shape (K, 3)
        In the dtype of the positions of the mesh, and relative to its origin.
    segments : ndarray of uint32, shape (L, 2)
        Pairs of rows of `positions`.
    cells : ndarray of uint32, shape (C, 4), or None
        The quads of a control net, (i,j) (i,j+1) (i+1,j+1) (i+1,j), which are drawn as closed
        lines; None for other overlays, and for nets of triangles.
    """

    name: str
    positions: RealArray
    segments: IndexArray
    cells: IndexArray | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Vertices and faces.

    A vertex is a position with its normal, its colour, its (u, v) and so on. Where two patches
    meet at a crease, or at the apex of a cone, several vertices share one position (see `welds`).

    Attributes
    ----------
    positions : ndarray, shape (V, 3)
        float64 in model coordinates; or float32 relative to `origin`.
    normals : ndarray, shape (V, 3), or None
        Unit normals du × dv / |du × dv|, never zero and never NaN.
    uvs : ndarray, shape (V, 2), or None
        Texture coordinates; parameters (u, v) if the surface has none.
    triangles : ndarray of uint32, shape (T, 3)
        Counter-clockwise seen from the tip of the normal.
    quads : ndarray of uint32, shape (Q, 4)
        (i,j) (i+1,j) (i+1,j+1) (i,j+1). Empty unless quads are requested; then `triangles` has the
        triangles at poles, between unequal divisions, and on triangular patches.
    parts : tuple of MeshPart
        Consecutive runs of faces that together contain all faces.
    grids : tuple of ndarray of uint32, each of shape (P, Ru+1, Rv+1)
        The vertex at every sample of every patch, batch by batch, for formats that store grids.
        Empty if a side has other divisions than its patch, or if a patch is a triangle.
    welds : ndarray of uint32, shape (V,), or None
        The first vertex with the same position; None if all positions differ.
    origin : ndarray of float64, shape (3,)
        Model coordinates of the point (0, 0, 0) of `positions`.
    colors : ndarray, shape (V, 3) or (V, 4), or None
        sRGB, or sRGB and alpha, from 0 to 1.
    attributes : tuple of (name, ndarray of shape (V, d))
        The other channels of the surface.
    step : float
        A power of two: all positions, also those of overlays, and the origin are multiples of it. 0
        if positions are not rounded to a grid.
    """

    name: str
    positions: RealArray
    normals: RealArray | None
    uvs: RealArray | None
    triangles: IndexArray
    quads: IndexArray
    parts: tuple[MeshPart, ...]
    grids: tuple[IndexArray, ...]
    welds: IndexArray | None
    overlays: tuple[Overlay, ...]
    origin: FloatArray
    up: Up
    report: MeshReport
    colors: RealArray | None = None
    attributes: tuple[tuple[str, RealArray], ...] = ()
    step: float = 0.0
