"""Reads many definitions of curves or of surfaces to one table.

The functions accept what the models of single curves and surfaces accept, and raise `Unreadable`
for anything else. They do not check what `service.surface.spline_checks` checks.
"""

from collections.abc import Mapping
from itertools import chain
from typing import Any, cast

import numpy as np
from pydantic import TypeAdapter, ValidationError

from service.bases import knots as knot
from service.bases.arrays import Bools, FloatArray, Ints
from service.schemas.batches import (
    Items,
    Objects,
    Unreadable,
    read_names,
    read_nets,
    require,
    require_keys,
    require_type,
    take,
)
from service.schemas.document import DocumentLimits
from service.surface.checks import MAX_DEGREE, Up
from service.surface.knot_tables import KnotTable, complete_knots, has_valid_form
from service.surface.knots import MIN_PERIODIC, NAMED, Knots, build_knot_vector
from service.surface.spline_tables import CurveTable, SurfaceTable, empty_curves

_UPS: TypeAdapter[list[Up]] = TypeAdapter(list[Up])

_SPLINE_KEYS = frozenset({"degree", "knots"})
_SURFACE_KEYS = _SPLINE_KEYS | {"type", "control_net", "weights"}
_CURVE_KEYS = _SPLINE_KEYS | {"type", "control_points", "weights", "up", "name"}

_UNIT_KNOTS = tuple([0.0] * (p + 1) + [1.0] * (p + 1) for p in range(MAX_DEGREE + 1))
"""For each degree, the knots of a Bézier curve."""


def read_curves(definitions: Objects, dimension: int, limits: DocumentLimits) -> CurveTable:
    """The table of curves whose control points have `dimension` coordinates.

    As everywhere, the `up` and the `name` of a curve that belongs to a surface have no effect.
    """
    used = require_keys(definitions, _CURVE_KEYS)
    if "name" in used:
        read_names([item["name"] for item in definitions if "name" in item])
    if "up" in used:
        try:
            _UPS.validate_python([item["up"] for item in definitions if "up" in item], strict=True)
        except ValidationError:
            raise Unreadable from None
    if not definitions:
        return empty_curves(dimension)
    points, weights, is_rational, knots = _read_splines(definitions, 1, dimension, limits)
    return CurveTable(knots.degrees, knots.counts, points, weights, is_rational, knots.knots)


def read_surfaces(definitions: Objects, limits: DocumentLimits) -> SurfaceTable:
    """The table of the surfaces of faces."""
    require_keys(definitions, _SURFACE_KEYS)
    points, weights, is_rational, knots = _read_splines(definitions, 2, 3, limits)
    degrees, counts = knots.degrees.reshape(-1, 2), knots.counts.reshape(-1, 2)
    return SurfaceTable(degrees, counts, points, weights, is_rational, knots.knots)


def _read_splines(
    definitions: Objects, axes: int, dimension: int, limits: DocumentLimits
) -> tuple[FloatArray, FloatArray, Bools, KnotTable]:
    """Control points, weights, whether there are weights, and knots, of curves or of surfaces."""
    kinds = [item.get("type", "bezier") for item in definitions]
    require_type(kinds, str)
    require(set(kinds) <= {"bezier", "bspline"})
    splines = [kind == "bspline" for kind in kinds]
    bezier = [item for item, is_spline in zip(definitions, splines, strict=True) if not is_spline]
    require(not frozenset().union(*bezier) & _SPLINE_KEYS)
    definitions = [
        _unroll(item, axes, dimension) if _has_periodic(item, axes) else item
        for item in definitions
    ]
    name = "control_points" if axes == 1 else "control_net"
    points, counts = read_nets(take(definitions, name), axes, dimension)
    degrees = counts - 1
    if len(bezier) < len(definitions):
        own = [item for item, is_spline in zip(definitions, splines, strict=True) if is_spline]
        degrees[splines] = _read_degrees(own, axes)
    require((degrees <= limits.max_degree).all() and (degrees <= MAX_DEGREE).all())
    require((degrees < counts).all() and (degrees >= 1).all())
    vectors: list[Any] = []
    for item, is_spline, numbers in zip(definitions, splines, degrees.tolist(), strict=True):
        if is_spline:
            vectors += _split_knots(item, axes)
        else:
            vectors += [_UNIT_KNOTS[degree] for degree in numbers]
    _replace_names(vectors, degrees, counts)
    knots, lengths = read_nets(vectors, 1, None)
    form = lengths[:, 0], degrees.ravel(), counts.ravel()
    require(has_valid_form(form[1], form[2], form[0]).all())
    weights, is_rational = _read_weights(definitions, counts)
    return points, weights, is_rational, complete_knots(knots, *form)


def _read_degrees(items: Objects, axes: int) -> list[list[int]]:
    """The degrees of B-splines, one for each axis."""
    values = [item.get("degree", 3) for item in items]
    degrees = [each if axes == 2 and type(each) is list else [each] * axes for each in values]
    require(set(map(len, degrees)) <= {axes})
    numbers = list(chain.from_iterable(degrees))
    require_type(numbers, int)
    require(min(numbers, default=1) >= 1 and max(numbers, default=1) <= MAX_DEGREE)
    return degrees


def _split_knots(item: Mapping[str, Any], axes: int) -> Items:
    """The knots of a B-spline, one value for each axis."""
    value = item.get("knots", "clamped")
    if axes == 1 or type(value) is str:
        return [value] * axes
    require(type(value) is list and len(value) == 2)
    return list(value)


def _replace_names(vectors: list[Any], degrees: Ints, counts: Ints) -> None:
    """Put numbers in place of the names of knot vectors."""
    for number, vector in enumerate(vectors):
        if type(vector) is str:
            require(vector in NAMED)
            count, degree = counts.item(number), degrees.item(number)
            vectors[number] = build_knot_vector(cast(Knots, vector), count, degree)


def _has_periodic(item: Mapping[str, Any], axes: int) -> bool:
    """Whether a direction of a B-spline is periodic."""
    value = item.get("knots")
    if type(value) is list and axes == 2:
        return any(type(knots) is str and knots == "periodic" for knots in value[:2])
    return type(value) is str and value == "periodic"


def _unroll(item: Mapping[str, Any], axes: int, dimension: int) -> Mapping[str, Any]:
    """A periodic B-spline, with its first control points repeated, and its knots as numbers."""
    name = "control_points" if axes == 1 else "control_net"
    nets = {name: take([item], name)[0]}
    if "weights" in item:
        nets["weights"] = item["weights"]
    degrees, knots = _read_degrees([item], axes)[0], list(_split_knots(item, axes))
    arrays = {}
    for key, net in nets.items():
        numbers, counts = read_nets([net], axes, dimension if key == name else None)
        arrays[key] = numbers.reshape(*counts[0].tolist(), *numbers.shape[1:])
    count = arrays[name].shape
    for axis, degree in enumerate(degrees):
        if type(knots[axis]) is str and knots[axis] == "periodic":
            require(count[axis] >= MIN_PERIODIC)
            knots[axis] = knot.periodic_knots(count[axis], degree)
            arrays = {key: knot.wrap_points(net, degree, axis) for key, net in arrays.items()}
    return {**item, **arrays, "knots": knots[0] if axes == 1 else knots}


def _read_weights(definitions: Objects, counts: Ints) -> tuple[FloatArray, Bools]:
    """One weight for each control point, 1 where none are given; and where they are given."""
    is_given = np.array(["weights" in item for item in definitions], bool)
    sizes = counts.prod(axis=1)
    weights = np.ones(sizes.sum())
    if is_given.any():
        nets = [item["weights"] for item in definitions if "weights" in item]
        numbers, shapes = read_nets(nets, counts.shape[1], None)
        require((shapes == counts[is_given]).all())
        weights[np.repeat(is_given, sizes)] = numbers
    return weights, is_given
