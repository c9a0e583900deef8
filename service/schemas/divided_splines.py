"""Splines of a brep with homogeneous points or weights of 0, before all are read in batches.

They are rare, so each is read by its own model, which raises it. The others pass as they are.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from pydantic import ValidationError

from service.cancellation import checkpoint
from service.errors import Issue, count_nouns
from service.schemas.batches import Objects, Unreadable
from service.schemas.bezier import BezierNet
from service.schemas.bspline import BsplineNet
from service.schemas.curves import BezierCurveDefinition, BsplineCurveDefinition
from service.schemas.document import DocumentLimits
from service.schemas.homogeneous import RationalModel
from service.schemas.validation import to_invalid

Models: TypeAlias = Mapping[str, type[RationalModel]]

NETS: Models = MappingProxyType({"bezier": BezierNet, "bspline": BsplineNet})
CURVES: Models = MappingProxyType(
    {"bezier": BezierCurveDefinition, "bspline": BsplineCurveDefinition}
)
"""The models of the surfaces of faces, and of curves, by their `type`."""

_FIELDS = ("type", "control_net", "control_points", "weights", "degree", "knots")


def divide_splines(items: Objects, models: Models, limits: DocumentLimits) -> Objects:
    """The definitions of splines, all with points and positive weights or none.

    Raises
    ------
    Unreadable
        One of those with homogeneous points or weights of 0 is wrong.
    PydanticCustomError
        After raising, they have more control points together than the limit.
    """
    rare = [number for number, item in enumerate(items) if _is_rare(item)]
    if not rare:
        return items
    divided, total = list(items), 0
    for number in rare:
        checkpoint()
        try:
            item = items[number]
            model = models[item.get("type", "bezier")].model_validate(item, context=limits)
        except (KeyError, TypeError, ValidationError):
            raise Unreadable from None
        total += model.point_count or 0
        if total > limits.max_control_points:
            raise to_invalid(_size_issue(total, limits))
        spline = model.divided()
        values = {name: getattr(spline, name, None) for name in _FIELDS}
        divided[number] = {
            name: _write(value) for name, value in values.items() if value is not None
        }
    return divided


def _is_rare(item: Any) -> bool:
    """Whether a definition has homogeneous points, or a weight of 0."""
    if not isinstance(item, dict):
        return False
    if "homogeneous" in item:
        return True
    weights = item.get("weights", ())
    if isinstance(weights, np.ndarray):
        return bool((weights == 0).any())
    if not isinstance(weights, list) or not weights:
        return False
    rows = weights if isinstance(weights[0], list) else [weights]
    return any(isinstance(row, list) and 0 in row for row in rows)


def _write(value: Any) -> Any:
    """The value of a field as `service.schemas.spline_batches` reads it."""
    return list(value) if isinstance(value, tuple) else value


def _size_issue(total: int, limits: DocumentLimits) -> Issue:
    return Issue(
        "too_many_control_points",
        "Until all their weights are positive, the splines would have more control points than "
        "this service takes.",
        "",
        f"more than {count_nouns(total - 1, 'control points')}",
        f"at most {limits.max_control_points}",
    )
