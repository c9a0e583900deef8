"""Memory, work and triangles of breps, estimated from their shapes; the factors are measured."""

from service.surface.sizes import SurfaceSize

PREPARING_FACTOR, SCRATCH_BYTES, PROVED_BYTES = 12, 40 << 20, 1000
"""Bytes for each byte of a lowered brep, while it is prepared and afterwards; for temporary arrays;
and for each triangle of a brep, a tube or a ribbon, while its bound is proved."""

SWEPT_TRIANGLES = 64
"""The most triangles of the coarsest mesh by tolerance for each Bézier piece of the curve of a
tube or ribbon, times the degree: three sides, and a few cells, frames of corners and caps."""

COEDGE_EFFORT = 5_000
"""Multiplications for each coedge, and for each span of curves, while a brep is prepared."""

FACE_SECONDS = 3e-3
"""Time to mesh a face, at a thousandth of the size of a part: measured 0.7 to 17 ms, most often 3
to 7 ms. A request with more faces than it has time for is refused before it begins."""

PATCH_TRIANGLES, EDGE_TRIANGLES = 64, 8
"""The most triangles that the coarsest mesh by tolerance has for each patch, and, in addition, for
each edge of a brep."""


def prepared_bytes(size: SurfaceSize) -> int:
    """The most bytes of prepared breps, and of the arrays with which they are prepared."""
    return PREPARING_FACTOR * size.lowered_bytes if size.faces else 0


def estimate_preparation(size: SurfaceSize) -> int:
    """The multiplications before breps can be meshed: to check or to make parameter curves."""
    return COEDGE_EFFORT * (size.coedges + size.edge_pieces)


def count_coarsest(size: SurfaceSize) -> int:
    """The most triangles that the coarsest mesh by tolerance has."""
    patches = size.patches + size.face_patches
    swept = SWEPT_TRIANGLES * max(size.degree) * size.curves
    return PATCH_TRIANGLES * patches + EDGE_TRIANGLES * size.edges + swept
