"""Which function converts which kind of surface, and conversions by several operations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, SurfaceError, pointer
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.chosen import convert_patch, convert_surface_of
from service.surface.convert.cut import (
    restrict_bezier,
    restrict_patches,
    split_patch,
    split_patches,
    split_triangle,
    triangle_of_patch,
)
from service.surface.convert.elevate import elevate_bezier, elevate_patches, elevate_triangle
from service.surface.convert.faces import select, select_of_member, untrim, untrim_member
from service.surface.convert.members import convert_group
from service.surface.convert.multipatch import bezier_of_multipatch, convert_each
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
    Insert,
    Operation,
    Orient,
    PatchOperation,
    Restrict,
    Reverse,
    Select,
    Split,
    SurfaceOperation,
    ToBezier,
    ToTriangle,
    Transpose,
    Untrim,
)
from service.surface.convert.spline import (
    bezier_of_spline,
    elevate_spline,
    insert_knots,
    restrict_spline,
    reverse_spline,
    split_spline,
    transpose_spline,
)
from service.surface.convert.turn import turn_bezier, turn_patches, turn_triangle
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface

Conversion: TypeAlias = Callable[[Any, Any, SizeLimits], Surface]
"""A function of a surface, an operation and the limits of the result."""


DEFAULT_LIMITS = SizeLimits()


def keep_surface(surface: Surface, _operation: ToBezier, _allowed: SizeLimits) -> Surface:
    """The surface itself, which already consists of Bézier patches."""
    return surface


def _convert_each(
    surface: MultipatchSurface, operation: PatchOperation, allowed: SizeLimits
) -> Surface:
    return convert_each(surface, CONVERSIONS[type(operation)], operation, allowed)


NAMES: Mapping[type[Surface], str] = MappingProxyType(
    {
        BezierSurface: "bezier",
        PatchSurface: "patches",
        MultipatchSurface: "multipatch",
        BsplineSurface: "bspline",
        TriangleSurface: "triangle",
        BrepSurface: "brep",
    }
)
"""The names, in requests, of the kinds of surface that can be converted."""

CONVERSIONS: Mapping[type[SurfaceOperation], Mapping[type[Surface], Conversion]] = MappingProxyType(
    {
        Elevate: {
            BezierSurface: elevate_bezier,
            PatchSurface: elevate_patches,
            MultipatchSurface: _convert_each,
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
        Insert: {BsplineSurface: insert_knots},
        Transpose: {
            BezierSurface: turn_bezier,
            PatchSurface: turn_patches,
            MultipatchSurface: _convert_each,
            BsplineSurface: transpose_spline,
            TriangleSurface: turn_triangle,
        },
        Reverse: {
            BezierSurface: turn_bezier,
            PatchSurface: turn_patches,
            MultipatchSurface: _convert_each,
            BsplineSurface: reverse_spline,
            TriangleSurface: turn_triangle,
        },
        ToBezier: {
            BezierSurface: keep_surface,
            PatchSurface: keep_surface,
            BsplineSurface: bezier_of_spline,
            TriangleSurface: keep_surface,
            MultipatchSurface: bezier_of_multipatch,
        },
        ToTriangle: {BezierSurface: triangle_of_patch, PatchSurface: triangle_of_patch},
        Untrim: {BrepSurface: untrim, GroupSurface: untrim_member},
        Select: {BrepSurface: select, GroupSurface: select_of_member},
    }
)
"""For each operation, the function for each kind of surface. Kinds that are missing are refused;
groups, and operations on one of several patches, have functions for all operations (`apply`)."""


Orienter: TypeAlias = Callable[[Surface, Orient], Surface]
"""Turns patches; it needs the engine, which finds neighbours and volumes."""


def _refuse_to_orient(_surface: Surface, _operation: Orient) -> Surface:
    raise AssertionError("this conversion was called without an orienter")


def convert(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: SizeLimits = DEFAULT_LIMITS,
    orient: Orienter = _refuse_to_orient,
) -> Surface:
    """The surface after all operations in sequence; `orient` does the operation `Orient`.

    Raises
    ------
    InvalidRequest, TooLarge
        With pointers `/operations/k`. A result that would be too large is refused before it is
        computed.
    """
    for number, operation in enumerate(operations):
        try:
            if isinstance(operation, Orient):
                surface = orient(surface, operation)
            else:
                surface = apply(surface, operation, allowed)
        except SurfaceError as error:
            raise error.within(pointer(("operations", number))) from None
    return surface


def apply(surface: Surface, operation: SurfaceOperation, allowed: SizeLimits) -> Surface:
    """The surface after one operation; pointers of errors are relative to the operation."""
    if isinstance(operation, Untrim | Select):
        return _find_conversion(surface, operation)(surface, operation, allowed)
    if isinstance(surface, GroupSurface):
        return convert_group(surface, operation, allowed, apply)
    number = operation.patch
    if number is None:
        return _find_conversion(surface, operation)(surface, operation, allowed)
    operation = replace(operation, patch=None)
    if isinstance(surface, PatchSurface):
        return convert_patch(surface, number, operation, allowed, apply)
    if isinstance(surface, MultipatchSurface):
        return convert_surface_of(surface, number, operation, allowed, apply)
    _find_conversion(surface, operation)
    raise InvalidRequest(
        Issue(
            "unexpected_patch",
            "The surface is one patch or one B-spline, which the operation changes as a whole.",
            "/patch",
            "a patch number",
            "none for this kind of surface",
        )
    )


def _find_conversion(surface: Surface, operation: SurfaceOperation) -> Conversion:
    """The function of the operation for this kind of surface."""
    conversion = CONVERSIONS[type(operation)].get(type(surface))
    if conversion is None:
        raise InvalidRequest(_refusal(surface, operation))
    return conversion


def _refusal(surface: Surface, operation: SurfaceOperation) -> Issue:
    """The issue for an operation that this kind of surface does not support."""
    kinds = CONVERSIONS[type(operation)]
    if isinstance(surface, BrepSurface):
        return Issue(
            "not_parametric",
            "A brep has no control net of its own; each of its faces is a part of a surface.",
            "",
            "a brep",
            "`untrim` before this operation: it answers with the surface of one face",
        )
    needed = "one of " + ", ".join(name for kind, name in NAMES.items() if kind in kinds)
    if type(surface) not in NAMES:
        return Issue(
            "not_parametric",
            "The surface as a whole has no parameters; each of its pieces has its own.",
            "",
            "a tube or a ribbon",
            needed,
        )
    return Issue(
        "unsupported_operation",
        "This kind of surface cannot be converted in this way.",
        "",
        f"the kind {NAMES[type(surface)]}",
        needed,
    )
