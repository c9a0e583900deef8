"""How much memory a step takes at most, from shapes alone: before anything is allocated.

Every number counts the bytes above what was there before the step, its result included, until the
step is over.
"""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from service.encoders import json_points
from service.errors import Issue, TooLarge
from service.pipeline.limits import Limits
from service.surface import Surface
from service.surface.convert.nets import width
from service.surface.convert.operations import Elevate, Operation, Split, ToTriangle
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import NUMBER, LoweredSize, lowered_size
from service.surface.sweeps import RibbonSurface, TubeSurface

if TYPE_CHECKING:
    from service.pipeline.mesh import Lowerable

SEAMS, SIDES = 600, 4
"""Bytes for each patch, and for each byte of its sides, that finding shared edges takes."""

SMALL = 1 << 19
"""Bytes that are taken whatever is computed."""

PLACE, POINT = 400, 700
"""Bytes that a place of a surface, and a point of a curve, take while they are computed."""

CONVERTED = 100
"""Bytes that each number of a control point takes while it is converted and written."""

MOST = 1 << 32
"""More points than any curve has."""

SCRATCH = 16 << 20
"""Bytes of work arrays at most: from some size on they do not grow with what is computed."""

LEAST, SHARE = 1 << 19, 4
"""Bytes that these take in any case, and how many times the rest they do where that is little."""


def lowering(surface: "Lowerable") -> int:
    """Lowering a surface to patches, and finding out how large its mesh becomes."""
    return _lowering(_size(surface))


def model_bytes(model: Model) -> int:
    """Bytes of the arrays of a model."""
    if isinstance(model, GroupModel):
        return sum(map(model_bytes, model.models))
    if not isinstance(model, PatchModel):
        pieces = model.pieces
        return pieces.points.nbytes + (0 if pieces.weights is None else pieces.weights.nbytes)
    arrays = [model.order, model.sequence, model.control_net]
    for batch in model.batches:
        arrays += [batch.points, batch.weights, *(channel.nets for channel in batch.channels)]
    return sum(int(array.nbytes) for array in arrays if array is not None)


def estimating(surface: "Lowerable") -> int:
    """What `service.pipeline.estimate.estimate` takes."""
    return _with_arrays(lowering(surface))


def compressing(length: int) -> int:
    """An answer of so many bytes in another coding."""
    return _with_arrays(2 * length)


def answering(model: int, places: int, order: int) -> int:
    """The answer to a query of so many places, from the `model` on, which has so many bytes."""
    return _with_arrays(model + PLACE * places + 2 * json_points.byte_bound(places, order))


def tracing(pieces: int, points: int, file: int) -> int:
    """A curve as a file of so many bytes at most, from its pieces on, which have so many bytes."""
    return _with_arrays(pieces + POINT * points + 2 * file)


def converting(surface: Surface, operations: Sequence[Operation], allowed: int) -> int:
    """A surface after some operations, none of which may lead to more control points than allowed.

    Every Bézier patch, or span, is counted with all of its points.
    """
    size = lowered_size(surface)
    p, q = _degree(surface)
    patches = max(1, size.patches)
    most = patches * (p + 1) * (q + 1)
    for operation in operations:
        if isinstance(operation, Elevate):
            p, q = max(p, operation.degree[0]), max(q, operation.degree[1])
        elif isinstance(operation, Split):
            patches *= 4
        elif isinstance(operation, ToTriangle):
            p = q = p + q
        most = max(most, patches * (p + 1) * (q + 1))
    return _with_arrays(size.peak + _converted(surface) * min(most, allowed))


def convertible(surface: Surface, memory: int) -> int:
    """Control points that so much memory allows a surface to have after a conversion."""
    return max(0, memory - SCRATCH - lowered_size(surface).peak) // _converted(surface)


def _converted(surface: Surface) -> int:
    """Bytes for each control point of a conversion, its weight and what it carries included."""
    return CONVERTED * (
        4
        + (
            0
            if isinstance(surface, GroupSurface | TubeSurface | RibbonSurface)
            else width(surface.channels)
        )
    )


def _with_arrays(other: int) -> int:
    """Bytes of something together with the work arrays in which it is computed."""
    return other + min(SCRATCH, LEAST + SHARE * other)


def check_lowering(surface: "Lowerable", limits: Limits) -> None:
    """Refuses a surface of too many patches, or one that takes too much memory as patches.

    Raises
    ------
    TooLarge
    """
    size = _size(surface)
    if size.patches > limits.max_patches:
        raise TooLarge(
            Issue(
                "too_many_patches",
                "The surface has too many Bézier patches: one for every span of its knots.",
                "/surface",
                f"{size.patches} patches",
                f"at most {limits.max_patches}",
            )
        )
    limits.check_memory(_lowering(size), "As patches the surface", "/surface", "a smaller surface")


def _degree(surface: Surface) -> tuple[int, int]:
    """The degree of a surface along u and along v."""
    if isinstance(surface, GroupSurface):
        return max(_degree(member.surface) for member in surface.members)
    degree = surface.degree
    return degree if isinstance(degree, tuple) else (degree, degree)


def _lowering(size: LoweredSize) -> int:
    seams = size.patches * SEAMS + SIDES * NUMBER * size.side_numbers
    return SMALL + max(size.peak, size.kept + seams)


def _size(surface: "Lowerable") -> LoweredSize:
    """What is known of a surface; nothing of one that is none of ours."""
    return lowered_size(surface) if isinstance(surface, Surface) else LoweredSize(0, 0, 0, 0)


def traceable(pieces: int, file: Callable[[int], int], memory: int) -> int:
    """Points of a curve for which so much memory does; `file` gives the bytes of so many."""

    def beyond(points: int) -> bool:
        return tracing(pieces, points, file(points)) > memory

    return bisect_left(range(MOST), True, key=beyond) - 1
