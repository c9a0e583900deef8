"""The cost of conversions, and how large a surface may become by one."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from service.pipeline.cost import MAX_SCRATCH_BYTES, Cost, with_scratch
from service.pipeline.limits import Limits
from service.surface.convert.operations import Elevate, Insert, Operation, Split, ToTriangle
from service.surface.sizes import SurfaceSize

CONVERSION_BYTES = 100
"""Bytes for each number of the surfaces of a conversion."""


def conversion_points(size: SurfaceSize, operations: Sequence[Operation]) -> int:
    """Upper bound of the control points that a surface has before or after any of the operations.

    Control points that patches share are counted for each patch.
    """
    return max(_count_points(each) for each in _list_sizes(size, operations))


def grown_size(size: SurfaceSize, operations: Sequence[Operation]) -> SurfaceSize:
    """The size of a surface with as many patches, of as high degrees, as operations may make.

    A triangle counts as a patch.
    """
    points = conversion_points(size, operations)
    *_, (degree, patches) = _list_sizes(size, operations)
    return replace(
        size,
        degree=degree,
        grids=patches,
        triangles=0,
        lowered_bytes=max(size.lowered_bytes, 64 * points),
        peak_bytes=max(size.peak_bytes, 96 * points),
    )


def conversion_cost(size: SurfaceSize, points: int) -> Cost:
    """The cost of a conversion whose surfaces have at most `points` control points at each step.

    A brep of some faces is written as very many objects: measured, 5 times the bytes of the brep,
    and 80 µs for each face.
    """
    numbers = (4 + size.width) * points  # x, y, z, a weight, and the channels
    written_bytes = 8 * size.surface_bytes if size.faces else 0
    memory = with_scratch(size.peak_bytes + CONVERSION_BYTES * numbers + written_bytes)
    return Cost(memory, 3e-3 + numbers * 1e-6 + size.faces * 8e-5)


def max_converted_points(size: SurfaceSize, limits: Limits) -> int:
    """The most control points that a surface can have after a conversion, by the memory limit."""
    return max(0, limits.max_memory - MAX_SCRATCH_BYTES - size.peak_bytes) // (
        CONVERSION_BYTES * (4 + size.width)
    )


def _count_points(size: tuple[tuple[int, int], int]) -> int:
    (p, q), patches = size
    return patches * (p + 1) * (q + 1)


def _list_sizes(
    size: SurfaceSize, operations: Sequence[Operation]
) -> Iterator[tuple[tuple[int, int], int]]:
    """Degrees and number of patches before the first operation, and after each."""
    (p, q), patches = size.degree, max(1, size.patches + size.face_patches)
    uncut, inserted = patches, 0  # patches before the last `inserted` knots along u and along v
    yield (p, q), patches
    for operation in operations:
        if isinstance(operation, Elevate):
            p, q = max(p, operation.degree[0]), max(q, operation.degree[1])
        elif isinstance(operation, Split):
            patches *= 4
            uncut, inserted = patches, 0
        elif isinstance(operation, Insert):
            # (a + k)(b + k) ≤ a b + k (a b + 1) + k² for a, b ≥ 1 spans along u and v.
            inserted += 1
            patches = uncut + inserted * (uncut + 1 + inserted)
        elif isinstance(operation, ToTriangle):
            p = q = p + q
        yield (p, q), patches
