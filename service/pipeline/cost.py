"""The cost of a request, estimated from the shapes of its surface before memory is allocated.

Sizes and memory are upper bounds, coarse and safe; the time is approximate. `mesh_costs`,
`conversion_costs` and `query_costs` have the costs of larger products. The factors are measured;
`tests/pipeline/test_memory.py` compares the results with the memory in use.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from service.pipeline.brep_cost import prepared_bytes
from service.surface.sizes import SurfaceSize

Result = TypeVar("Result")

MAX_SCRATCH_BYTES, MIN_SCRATCH_BYTES = 16 << 20, 1 << 19
"""Temporary arrays take at most 4 times the bytes of the results plus `MIN_SCRATCH_BYTES`, and
never more than `MAX_SCRATCH_BYTES`."""

SEAM_BYTES = 600
"""Bytes for each patch while shared edges are found."""

MEMORY_SHARE = 3
"""The size of a mesh, a curve or a section by tolerance is known only after it is computed. Each of
these may take 1/`MEMORY_SHARE` of the memory that a request may take; a mesh may always take, in
addition to the memory of its lowered surface, as much again."""

POINT_BYTES = 700
"""Bytes for each point of a curve."""


@dataclass(frozen=True, slots=True)
class Cost:
    """The most memory that a piece of work takes, and its time.

    Attributes
    ----------
    memory : int
        The most bytes in use at one time, for patches, mesh and file; without the surface itself.
    seconds : float
        Approximate time of one processor.
    response : int
        The most bytes of the response, if the shapes show them; 0 if only the work shows them.
    least_seconds : float
        Time of one processor that the work surely takes: far less than `seconds`, and 0 unless the
        shapes show the size of the result, as for a mesh by resolution.
    """

    memory: int
    seconds: float
    response: int = 0
    least_seconds: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class Work(Generic[Result]):
    """A piece of work: its cost, and the function that does it and returns its result."""

    cost: Cost
    run: Callable[[], Result]


def lowering_memory(size: SurfaceSize, other_bytes: int = 0) -> int:
    """The most bytes in use while a surface is lowered, and afterwards.

    Afterwards the patches, the data of their shared edges and `other_bytes` bytes are in use.
    """
    patch_bytes = size.lowered_bytes + SEAM_BYTES * size.patches + 4 * size.side_bytes
    lowered = max(size.peak_bytes, patch_bytes + prepared_bytes(size) + other_bytes)
    return MIN_SCRATCH_BYTES + size.member_bytes + lowered


def compression_cost(length: int) -> Cost:
    """The cost of compressing a response of `length` bytes."""
    return Cost(with_scratch(2 * length), 1e-3 + length * 5e-8)


def fast_compression_cost(length: int, *, is_gzip: bool) -> Cost:
    """The cost of compressing a response of `length` bytes at a low level."""
    return Cost(with_scratch(length), 1e-4 + length * (2.5e-8 if is_gzip else 4e-9))


def definition_cost(size: SurfaceSize, max_bytes: int = sys.maxsize) -> Cost:
    """The cost of writing a surface as JSON of at most `max_bytes` bytes.

    8 bytes become at most 32 characters. `size` is `SurfaceKind.written_size`.
    """
    names = size.name_bytes + size.face_name_bytes
    byte_bound = min(max_bytes, 1000 + 600 * size.members + 4 * size.surface_bytes + 8 * names)
    seconds = 1e-4 * size.members + 5e-5 * size.faces + byte_bound * 1e-8
    return Cost(3 * byte_bound, seconds)


def curve_cost(points: int, degree: int, numbers: int, file_bytes: int) -> Cost:
    """The cost of sampling a curve of this degree at `points` points.

    Its Bézier pieces have together `numbers` numbers, and the file has `file_bytes` bytes.
    """
    memory = with_scratch(8 * numbers + POINT_BYTES * points + 2 * file_bytes)
    return Cost(memory, 5e-4 + points * degree * 2e-6)


def with_scratch(result_bytes: int) -> int:
    """`result_bytes`, plus the bytes of the temporary arrays for computing them."""
    return result_bytes + min(MAX_SCRATCH_BYTES, MIN_SCRATCH_BYTES + 4 * result_bytes)
