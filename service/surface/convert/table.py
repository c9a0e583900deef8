"""Which conversion is done by which function, and one after the other."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, SurfaceError, pointer
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.cut import (
    restrict_bezier,
    restrict_patches,
    split_patch,
    split_patches,
    split_triangle,
    triangle_of_patch,
)
from service.surface.convert.elevate import elevate_bezier, elevate_patches, elevate_triangle
from service.surface.convert.multipatch import bezier_of_multipatch, each_surface
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
from service.surface.convert.spline import (
    bezier_of_spline,
    elevate_spline,
    restrict_spline,
    reverse_spline,
    split_spline,
    transpose_spline,
)
from service.surface.convert.turn import (
    reverse_bezier,
    reverse_patches,
    reverse_triangle,
    transpose_bezier,
    transpose_patches,
    transpose_triangle,
)
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface

Conversion: TypeAlias = Callable[[Any, Any, Allowed], Surface]
"""Of a surface, an operation, and how large the outcome may be."""


ANY = Allowed()


def unchanged(surface: Surface, _operation: ToBezier, _allowed: Allowed) -> Surface:
    """What is made of Bézier patches already."""
    return surface


def _each(surface: MultipatchSurface, operation: Operation, allowed: Allowed) -> Surface:
    return each_surface(surface, CONVERSIONS[type(operation)], operation, allowed)


NAMES: Mapping[type[Surface], str] = MappingProxyType(
    {
        BezierSurface: "bezier",
        PatchSurface: "patches",
        MultipatchSurface: "multipatch",
        BsplineSurface: "bspline",
        TriangleSurface: "triangle",
    }
)
"""Kinds of surface that have parameters, as requests call them."""

CONVERSIONS: Mapping[type[Operation], Mapping[type[Surface], Conversion]] = MappingProxyType(
    {
        Elevate: {
            BezierSurface: elevate_bezier,
            PatchSurface: elevate_patches,
            MultipatchSurface: _each,
            BsplineSurface: elevate_spline,
            TriangleSurface: elevate_triangle,
        },
        Split: {
            BezierSurface: split_patch,
            PatchSurface: split_patches,
            BsplineSurface: split_spline,
            TriangleSurface: split_triangle,
        },
        Restrict: {
            BezierSurface: restrict_bezier,
            PatchSurface: restrict_patches,
            BsplineSurface: restrict_spline,
        },
        Transpose: {
            BezierSurface: transpose_bezier,
            PatchSurface: transpose_patches,
            MultipatchSurface: _each,
            BsplineSurface: transpose_spline,
            TriangleSurface: transpose_triangle,
        },
        Reverse: {
            BezierSurface: reverse_bezier,
            PatchSurface: reverse_patches,
            MultipatchSurface: _each,
            BsplineSurface: reverse_spline,
            TriangleSurface: reverse_triangle,
        },
        ToBezier: {
            BezierSurface: unchanged,
            PatchSurface: unchanged,
            BsplineSurface: bezier_of_spline,
            TriangleSurface: unchanged,
            MultipatchSurface: bezier_of_multipatch,
        },
        ToTriangle: {BezierSurface: triangle_of_patch, PatchSurface: triangle_of_patch},
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
        raise InvalidRequest(_refused(surface, operation))
    return conversion(surface, operation, allowed)


def _refused(surface: Surface, operation: Operation) -> Issue:
    """Why nothing is done with a surface: it has no parameters, or not the right ones."""
    kinds = CONVERSIONS[type(operation)]
    needed = "one of " + ", ".join(name for kind, name in NAMES.items() if kind in kinds)
    if type(surface) not in NAMES:
        message = "Parameters mean nothing on the whole of it; each of its pieces has its own."
        return Issue("not_parametric", message, "", "a group, a tube or a ribbon", needed)
    message = "This kind of surface cannot be converted in this way."
    got = f"the kind {NAMES[type(surface)]}"
    return Issue("unsupported_operation", message, "", got, needed)
