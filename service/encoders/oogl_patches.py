"""The exact OOGL form: the Bézier patches themselves, from which Geomview makes a mesh.

A BEZ object of Geomview has tensor-product patches of degree up to 12, polynomial or rational. A
B-spline is written as its Bézier patches. A triangle of degree n is written as an equal patch of
degree (n, n), one side of which is a point. Among control points, u varies fastest; rational points
are homogeneous, (wx, wy, wz, w). BEZ stores texture coordinates and colours only at the four
corners of a patch, and Geomview interpolates between the corners. This is exact if they are
polynomials of degree (1, 1).

References
----------
Geomview manual, "OOGL File Formats": BEZ.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import RealArray
from service.encoders.content import find_nonempty
from service.encoders.oogl import skeleton
from service.encoders.text import rows
from service.engine.mesh.mesh import Overlay
from service.errors import Issue, UnsupportedByFormat
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel
from service.surface.sides import take_corners

HIGHEST_DEGREE = 12
"""The highest degree of BEZ patches that Geomview reads."""


def encode_patches(model: PatchModel, overlays: tuple[Overlay, ...] = ()) -> bytes:
    """The exact surface as an OOGL list with one BEZ member for each batch, ASCII.

    Parameters
    ----------
    model : PatchModel
        The patches. Numbers are written with the fewest digits that read back as the same float64.
    overlays : tuple of Overlay
        In model coordinates.

    Raises
    ------
    UnsupportedByFormat
        A patch has a degree above 12.
    """
    members = (chunk for batch in model.batches for chunk in _bez(batch))
    return b"".join((b"LIST\n", *members, *map(skeleton, find_nonempty(overlays))))


def _bez(batch: Patches) -> Iterator[bytes]:
    """One BEZ member with all patches of a batch."""
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
        batch = batch.to_tensor()
    p, q = batch.degree
    points = to_homogeneous(batch.points, batch.weights)
    dimension = points.shape[-1]
    nets = points.swapaxes(1, 2).reshape(batch.count, -1, dimension)
    prefix, corners = _corners(batch)
    yield f"{{ = {prefix}BEZ {p} {q} {dimension}\n".encode()
    if corners:
        for k, net in enumerate(nets):
            yield rows(net)
            yield from (rows(values[k]) for values in corners)
    else:
        yield rows(nets.reshape(-1, dimension))
    yield b"}\n"


def _corners(batch: TensorPatches) -> tuple[str, list[RealArray]]:
    """The prefix of the keyword, and the values at the corners of P patches.

    The values are texture coordinates and colours, each of shape (P, 4, d), at the corners (u, v) =
    (0, 0), (1, 0), (0, 1) and (1, 1).
    """
    # `take_corners` has v fastest, OOGL has u fastest.
    channels = {
        channel.kind: take_corners(channel.nets)[:, [0, 2, 1, 3]] for channel in batch.channels
    }
    prefix, corners = "", list[RealArray]()
    if "uvs" in channels:
        prefix += "ST"
        corners.append(channels["uvs"])
    if "colors" in channels:
        prefix += "C"
        colors = channels["colors"]
        opacity = np.ones((batch.count, 4, 4 - colors.shape[-1]))
        corners.append(np.concatenate((colors, opacity), axis=-1))
    return prefix, corners
