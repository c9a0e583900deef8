"""What a surface becomes when it is lowered, from shapes alone: before anything is allocated."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.surface.bezier import BezierSurface
from service.surface.bspline import BLOCK_POINTS, BsplineSurface
from service.surface.channels import Channels
from service.surface.group import GroupSurface, distinct
from service.surface.patches import PatchSurface
from service.surface.sides import along_sides
from service.surface.triangle import TriangleSurface

if TYPE_CHECKING:
    from service.surface import Surface

NUMBER = 8
"""Bytes of a number in double precision, and of an index."""

COMBINED = 5
"""Arrays as large as a block that are alive while points are combined: they, their weights, what
is added to them, and its two halves."""

CHUNK = 8 << 20
"""Bytes of the blocks in which a net is lowered along u; a span is never divided."""


@dataclass(frozen=True, slots=True)
class LoweredSize:
    """What a surface becomes.

    Attributes
    ----------
    patches : int
        Bézier patches.
    side_numbers : int
        Numbers of the control points on the four sides of all patches, weights included.
    kept : int
        Bytes of the arrays that the patches lie in.
    peak : int
        Bytes that lowering takes while it lasts, these included.
    """

    patches: int
    side_numbers: int
    kept: int
    peak: int


def lowered_size(surface: "Surface") -> LoweredSize:
    """What `surface.lower()` makes at most."""
    if isinstance(surface, GroupSurface):
        return _of_group(surface)
    if isinstance(surface, BsplineSurface):
        return _of_spline(surface)
    if isinstance(surface, PatchSurface):
        return _of_patches(surface)
    if isinstance(surface, BezierSurface):
        return _of_one(_on_sides(1, surface.degree, surface.weights), surface.channels)
    if isinstance(surface, TriangleSurface):
        n = surface.degree
        return _of_one(_on_sides(1, (n, n), surface.weights), surface.channels)
    # What is swept has been lowered when it was born, and has no patches.
    return LoweredSize(0, 0, 0, 0)


def _of_one(side_numbers: int, channels: Channels) -> LoweredSize:
    """One patch: its arrays are the surface's own."""
    return LoweredSize(1, side_numbers, 0, sum(net.nbytes for *_, net in channels.each()))


def _of_group(group: GroupSurface) -> LoweredSize:
    """The different members one after the other."""
    surfaces, _ = distinct(group.members)
    found = [lowered_size(surface) for surface in surfaces]
    kept = sum(size.kept for size in found)
    # Telling which are different copies one array at a time.
    copied = max(max(_arrays(surface), default=0) for surface in surfaces)
    return LoweredSize(
        sum(size.patches for size in found),
        sum(size.side_numbers for size in found),
        kept,
        kept + max(copied, *(size.peak - size.kept for size in found)),
    )


def _of_spline(surface: BsplineSurface) -> LoweredSize:
    p, q = surface.degree
    rows, columns = (
        len(knot.spans(vector, degree))
        for vector, degree in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    patches, each = rows * columns, (p + 1) * (q + 1)
    # A net that closes has its first lines once more at its end.
    height, width = (n + d for n, d in zip(surface.control_net.shape, (p, q), strict=False))
    weighted = surface.weights is not None

    def own(numbers: int) -> tuple[int, int]:
        """Bytes kept and beside them, of points of so many numbers."""
        kept = patches * each * numbers * NUMBER
        lines = (rows * (p + 1) + height) * width * numbers * NUMBER
        along_u = min(lines, max(CHUNK, (p + 1) * max(p + 1, width * numbers) * NUMBER))
        block = max(BLOCK_POINTS, (p + 1) * columns * (q + 1)) * numbers * NUMBER
        along_v = min(kept, max(block, CHUNK, (p + 1) * (q + 1) * numbers * NUMBER * height))
        return kept, lines + COMBINED * max(along_u, along_v)

    kept, beside = own(3 + weighted)
    for *_, net in surface.channels.each():
        if net.shape[:2] == surface.control_net.shape[:2]:
            more, working = own(net.shape[2])
        else:
            more = patches * net.size * NUMBER
            working = 2 * more + (rows * net.shape[0] ** 2 + columns * net.shape[1] ** 2) * NUMBER
        kept, beside = kept + more, max(beside, working)
    # The net as it closes is kept, for whoever draws it.
    kept += height * width * 3 * NUMBER
    return LoweredSize(patches, _on_sides(patches, (p, q), surface.weights), kept, kept + beside)


def _of_patches(surface: PatchSurface) -> LoweredSize:
    grids, triangles = len(surface.patches), len(surface.triangles)
    n = surface.triangle_degree
    sides = _on_sides(grids, surface.degree, surface.weights)
    sides += _on_sides(triangles, (n, n), surface.weights)
    numbers = 3 + (surface.weights is not None)
    numbers += sum(net.shape[-1] for *_, net in surface.channels.each())
    indices = surface.patches.size + surface.triangles.size
    kept = (indices * numbers + 2 * (grids + triangles)) * NUMBER
    # Indices in the order of the parts, and how that order is found.
    beside = (indices + 8 * (grids + triangles)) * NUMBER
    return LoweredSize(grids + triangles, sides, kept, kept + beside)


def _on_sides(patches: int, degree: tuple[int, int], weights: FloatArray | None) -> int:
    numbers = 3 if weights is None else 4
    return patches * numbers * sum(n + 1 for n in along_sides(*degree))


def _arrays(surface: "Surface") -> Iterator[int]:
    """Bytes of the surface's arrays."""
    for name in ("control_net", "vertices", "patches", "triangles", "weights"):
        array = getattr(surface, name, None)
        if array is not None:
            yield prod(array.shape) * NUMBER
    channels = getattr(surface, "channels", None)
    if channels is not None:
        yield from (net.nbytes for *_, net in channels.each())
