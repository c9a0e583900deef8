"""Computes the surface or curve that fields of other programs mean, in the fields of this service.

It is used for refusals only, so it gives up (None) wherever the fields leave a doubt: about the
order of the points, or about whether they are multiplied by their weights.
"""

from collections.abc import Mapping
from itertools import chain
from math import prod
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray
from service.schemas.program_fields import ROLES, Convention, find_program, fold_name

MAX_NUMBERS = 400
"""The most numbers of fields that are translated."""


def translate_surface(fields: Mapping[str, Any]) -> dict[str, Any] | None:
    """The document of the surface that fields of another program mean; None in doubt."""
    return _translate(fields, 2)


def translate_curve(fields: Mapping[str, Any]) -> dict[str, Any] | None:
    """The document of the curve that fields of another program mean; None in doubt."""
    return _translate(fields, 1)


def is_flat_list(value: object, depth: int) -> bool:
    """Whether a value is a list of numbers or, up to a depth of 2, a list of lists of numbers."""
    items: list[Any] = value if isinstance(value, list) else []
    if depth == 2 and items and all(isinstance(item, list) for item in items):
        items = [*chain.from_iterable(items)]
    return bool(items) and all(type(item) in (int, float) for item in items)


def find_sizes(fields: Mapping[str, Any]) -> list[int] | None:
    """The numbers of rows and columns of a net, by fields for sizes, or by degrees and knots.

    None if they are not known, or the list of points has another number of these.
    """
    roles = _sort_by_role(fields)
    try:
        points = roles["points"][0]
        if isinstance(points[0], list) and isinstance(points[0][0], list):
            return [len(points), len(points[0])]
        count = len(points) if isinstance(points[0], list) else len(points) // 3
        if "size" in roles:
            sizes = _pair(roles["size"], 2)
        else:
            degrees, knots = _find_degrees(roles, 2), _find_knots(roles, 2)
            sizes = _fit_sizes(degrees, knots, count)
        is_right = all(type(size) is int and size > 0 for size in sizes) and prod(sizes) == count
    except (_Doubt, LookupError, TypeError, ValueError, OverflowError):
        return None
    return sizes if is_right else None


def _translate(fields: Mapping[str, Any], directions: int) -> dict[str, Any] | None:
    """The document of a surface (2 directions) or of a curve (1)."""
    wrapped = [
        value
        for name, value in fields.items()
        if isinstance(value, dict) and ROLES.get(fold_name(name)) == "wrapper"
    ]
    fields = wrapped[0] if len(wrapped) == 1 else fields
    roles = _sort_by_role(fields)
    if _count_values([*roles.values()]) > MAX_NUMBERS:
        return None
    try:
        return _build(roles, find_program(fields), directions)
    except (_Doubt, LookupError, TypeError, ValueError, OverflowError):
        return None


class _Doubt(Exception):
    """The fields do not say what is meant."""


def _sort_by_role(fields: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The values of the fields by role, u before v."""
    roles: dict[str, list[Any]] = {}
    for name in sorted(fields, key=fold_name):
        role = "points" if name in ("control_net", "control_points") else ROLES.get(fold_name(name))
        if role is not None:
            roles.setdefault(role, []).append(fields[name])
    return roles


def _count_values(value: Any) -> int:
    """The number of values in nested lists, empty lists included; or one beyond the limit."""
    count, stack = 0, [value]
    while stack and count <= MAX_NUMBERS:
        item = stack.pop()
        if isinstance(item, list) and item:
            stack += item[: MAX_NUMBERS + 1]
        else:
            count += 1
    return count


def _build(
    roles: Mapping[str, list[Any]], convention: Convention | None, directions: int
) -> dict[str, Any]:
    """The document of values by role; raises an error if they leave a doubt."""
    field = "points" if "points" in roles else "homogeneous"
    points = np.array(roles[field][0], np.float64)
    knots = _find_knots(roles, directions)
    degrees = _find_degrees(roles, directions)
    sizes = _find_sizes(roles, degrees, knots, points, directions)
    if knots is not None and not all(map(_are_knots, knots, degrees, sizes)):
        raise _Doubt
    is_flat = points.ndim <= directions
    if is_flat and directions == 2 and convention is None:
        raise _Doubt
    is_u_fastest = is_flat and convention is not None and convention.is_u_fastest
    net = _arrange(points, sizes, is_u_fastest=is_u_fastest)
    weights = None
    if "weights" in roles:
        numbers = np.array(roles["weights"][0], np.float64)
        weights = _arrange(numbers, sizes, is_u_fastest=is_u_fastest)[..., 0]
    fourth = "homogeneous" if field == "homogeneous" else convention.fourth if convention else ""
    if net.shape[-1] == 4 and fourth != "homogeneous":
        if fourth != "weight" or weights is not None:
            raise _Doubt
        net, weights = net[..., :3], net[..., 3]
    if weights is not None and weights.min() < 0:
        raise _Doubt
    document: dict[str, Any] = {"type": "bspline"}
    if knots is not None:
        document["degree"] = degrees if directions == 2 else degrees[0]
        document["knots"] = knots if directions == 2 else knots[0]
    elif sizes == [degree + 1 for degree in degrees]:
        document["type"] = "bezier"
    else:
        raise _Doubt
    document["control_net" if directions == 2 else "control_points"] = _shorten(net.tolist())
    if net.shape[-1] == 4:
        document["homogeneous"] = True
    elif weights is not None:
        document["weights"] = _shorten(weights.tolist())
    return document


def _pair(values: list[Any], directions: int) -> list[Any]:
    """One value for each direction, of one field for each, or of one field for all."""
    if len(values) == 1 and directions == 2:
        values = values[0] if isinstance(values[0], list) else values * 2
    if len(values) != directions:
        raise _Doubt
    return values


def _find_degrees(roles: Mapping[str, list[Any]], directions: int) -> list[int]:
    values = roles["degree"] if "degree" in roles else roles["order"]
    degrees = [_first(value) - ("degree" not in roles) for value in _pair(values, directions)]
    if not all(type(degree) is int and degree > 0 for degree in degrees):
        raise _Doubt
    return degrees


def _first(value: Any) -> Any:
    """The item of a list of one, such as splinepy's `degrees` of a curve."""
    return value[0] if isinstance(value, list) and len(value) == 1 else value


def _find_knots(roles: Mapping[str, list[Any]], directions: int) -> list[list[float]] | None:
    """The knots of each direction, as often as their multiplicities; None if there are none."""
    if "knots" not in roles:
        return None
    knots = [_first(value) for value in _pair(roles["knots"], directions)]
    if "multiplicities" in roles:
        counts = [_first(value) for value in _pair(roles["multiplicities"], directions)]
        if sum(map(sum, counts)) > MAX_NUMBERS:
            raise _Doubt
        knots = [np.repeat(*pair).tolist() for pair in zip(knots, counts, strict=True)]
    return knots


def _find_sizes(
    roles: Mapping[str, list[Any]],
    degrees: list[int],
    knots: list[list[float]] | None,
    points: FloatArray,
    directions: int,
) -> list[int]:
    """The number of control points along each direction."""
    if points.ndim == directions + 1:
        return [*points.shape[:-1]]
    if "size" in roles:
        return _pair(roles["size"], directions)
    return _fit_sizes(degrees, knots, len(points))


def _fit_sizes(degrees: list[int], knots: list[list[float]] | None, count: int) -> list[int]:
    """The number of control points along each direction, of `count` together."""
    if knots is None:
        return [degree + 1 for degree in degrees]
    sizes = [len(each) - degree - 1 for each, degree in zip(knots, degrees, strict=True)]
    # Rhino's knot vectors lack the first and the last knot.
    return sizes if prod(sizes) == count else [size + 2 for size in sizes]


def _are_knots(knots: list[float], degree: int, size: int) -> bool:
    """Whether a direction has as many knots as it needs, which ascend; all, or all but the ends."""
    missing = size + degree + 1 - len(knots)
    return size > degree and missing in (0, 2) and bool((np.diff(knots) >= 0).all())


def _arrange(values: FloatArray, sizes: list[int], *, is_u_fastest: bool) -> FloatArray:
    """Values as rows along u, (r, c, k), of such rows or of a flat list; of a curve (n, k)."""
    if is_u_fastest and values.shape[:-1] != tuple(sizes):
        return values.reshape(*sizes[::-1], -1).swapaxes(0, 1)
    return values.reshape(*sizes, -1)


def _shorten(values: Any) -> Any:
    """Nested lists of numbers, in which whole numbers have no fraction."""
    if isinstance(values, list):
        return [*map(_shorten, values)]
    return int(values) if values == int(values) else values
