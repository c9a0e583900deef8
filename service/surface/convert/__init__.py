"""Surfaces in another form with the same points: degrees, pieces, directions, kinds."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, SurfaceError, pointer
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.convert.cut import restrict_bezier, restrict_patches, split_patch
from service.surface.convert.elevate import elevate_bezier, elevate_patches
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import (
    Elevate,
    Operation,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    ToTriangle,
    Transpose,
)
from service.surface.convert.turn import (
    reverse_bezier,
    reverse_patches,
    transpose_bezier,
    transpose_patches,
)
from service.surface.patches import PatchSurface

Conversion: TypeAlias = Callable[[Any, Any, Allowed], Surface]
"""Of a surface, an operation, and how large the outcome may be."""


ANY = Allowed()


def unchanged(surface: Surface, _operation: ToBezier, _allowed: Allowed) -> Surface:
    """What is made of Bézier patches already."""
    return surface


CONVERSIONS: Mapping[type[Operation], Mapping[type[Surface], Conversion]] = MappingProxyType(
    {
        Elevate: {BezierSurface: elevate_bezier, PatchSurface: elevate_patches},
        Split: {BezierSurface: split_patch, PatchSurface: split_patch},
        Restrict: {BezierSurface: restrict_bezier, PatchSurface: restrict_patches},
        Transpose: {BezierSurface: transpose_bezier, PatchSurface: transpose_patches},
        Reverse: {BezierSurface: reverse_bezier, PatchSurface: reverse_patches},
        ToBezier: {BezierSurface: unchanged, PatchSurface: unchanged},
        ToTriangle: {},
    }
)
"""What is done for each operation and each kind of surface; the others are refused."""


def convert(surface: Surface, operations: Sequence[Operation], allowed: Allowed = ANY) -> Surface:
    """The surface after all operations, one after the other.

    Raises
    ------
    InvalidRequest, TooLarge
        With pointers `/operations/k`; what would be too large is refused from the shapes alone.
    """
    for number, operation in enumerate(operations):
        try:
            surface = _converted(surface, operation, allowed)
        except SurfaceError as error:
            raise error.within(pointer(("operations", number))) from None
    return surface


def _converted(surface: Surface, operation: Operation, allowed: Allowed) -> Surface:
    conversion = CONVERSIONS[type(operation)].get(type(surface))
    if conversion is None:
        raise InvalidRequest(
            Issue(
                "unsupported_operation",
                "This kind of surface cannot be converted in this way.",
                "",
                "another kind of surface",
                "a kind that the operation is documented for",
            )
        )
    return conversion(surface, operation, allowed)
