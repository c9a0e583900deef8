"""The exact OOGL form: the Bézier patches themselves, to be diced by the program that draws them.

Geomview's BEZ takes tensor-product patches of degree up to 12, polynomial or rational. A B-spline
comes lowered; a triangle of degree n as the patch of degree (n, n) that it is, one side of it a
point. Control points run u fastest; rational ones are homogeneous, (wx, wy, wz, w).

References
----------
Geomview manual, "OOGL File Formats": BEZ.
"""

from collections.abc import Iterator

import numpy as np

from service.encoders.content import drawn
from service.encoders.oogl import skeleton
from service.encoders.text import rows
from service.engine.mesh import Overlay
from service.errors import Issue, UnsupportedByFormat
from service.surface.lowered import Patches, PatchModel, TrianglePatches

HIGHEST_DEGREE = 12
"""What Geomview's BEZ reads."""


def encode_patches(model: PatchModel, overlays: tuple[Overlay, ...] = ()) -> bytes:
    """The exact surface as an OOGL list of BEZ members, one a batch, ASCII.

    Parameters
    ----------
    model : PatchModel
        All numbers are written with the fewest digits that read back as the same float64.
    overlays : tuple of Overlay
        In model coordinates.

    Raises
    ------
    UnsupportedByFormat
        If a patch has a degree above 12.
    """
    members = (chunk for batch in model.batches for chunk in _bez(batch))
    return b"".join((b"LIST\n", *members, *map(skeleton, drawn(overlays))))


def _bez(batch: Patches) -> Iterator[bytes]:
    """One BEZ member holding every patch of a batch."""
    if max(batch.side_degrees) > HIGHEST_DEGREE:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"The exact OOGL form holds patches of degree {HIGHEST_DEGREE} at most.",
                "/oogl",
                f"degree {batch.degree}",
                f"degrees up to {HIGHEST_DEGREE}, or another form",
            )
        )
    if isinstance(batch, TrianglePatches):
        batch = batch.tensor()
    p, q = batch.degree
    points = batch.points
    if batch.weights is not None:
        weights = batch.weights[..., np.newaxis]
        points = np.concatenate((points * weights, weights), axis=-1)
    dimension = points.shape[-1]
    yield f"{{ = BEZ {p} {q} {dimension}\n".encode()
    yield rows(points.swapaxes(1, 2).reshape(-1, dimension))
    yield b"}\n"
