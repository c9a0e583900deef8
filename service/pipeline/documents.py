"""Surfaces as JSON documents: after a conversion, or without change."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from service.encoders.text import json_bound, json_document
from service.engine.mesh.mesh import Orientation
from service.engine.models import NOT_PATCHES
from service.errors import InvalidRequest
from service.pipeline.conversion_costs import (
    conversion_cost,
    conversion_points,
    grown_size,
    max_converted_points,
)
from service.pipeline.cost import Cost, Work, definition_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.orienting import Orienter, plan_orientation
from service.schemas.surfaces import definition
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Operation, Orient
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.kinds import Surface


def plan_conversion(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: SizeLimits,
    limits: Limits = DEFAULT_LIMITS,
    reading: Mapping[str, Any] | None = None,
) -> Work[bytes]:
    """Plan a conversion: estimate its cost from the shapes of the surface, and check the limits.

    Without operations, the surface is written as it is. The work checks the size of the surface
    after each operation, which `allowed` limits, before it computes this surface; and the bytes of
    the document, which `limits` limits. The document also has the report of reading, if there is
    one.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon.
    """
    if not operations:
        return _plan_document(surface, limits, "/surface", reading)
    allowed, cost = limit_conversion(surface, operations, allowed, limits)

    def run() -> bytes:
        # The document can be the body of a request.
        orienter = Orienter(limits)
        converted = convert(surface, operations, allowed, orienter.orient)
        return _write_document(converted, limits, "/operations", reading, orienter.orientation)

    return Work(cost, run)


def limit_conversion(
    surface: Surface, operations: Sequence[Operation], allowed: SizeLimits, limits: Limits
) -> tuple[SizeLimits, Cost]:
    """The limits of the surfaces of a conversion with operations, and its cost.

    Raises
    ------
    InvalidRequest
        `not_parametric`, as `plan_conversion`.
    """
    size = surface.written_size()
    if size.curves and not isinstance(surface, GroupSurface):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/surface"))
    # A result with more control points than fit into memory is refused as too large.
    max_points = min(allowed.control_points, max_converted_points(size, limits))
    cost = conversion_cost(size, min(max_points, conversion_points(size, operations)))
    if any(isinstance(operation, Orient) for operation in operations):
        # All copies of equal members are oriented, each in its place.
        orientation = plan_orientation(
            grown_size(surface.size(), operations), limits, "/operations"
        )
        cost = Cost(cost.memory + orientation.memory, cost.seconds + orientation.seconds)
    return replace(allowed, control_points=max_points), cost


def plan_definition(surface: Surface, limits: Limits = DEFAULT_LIMITS) -> Work[bytes]:
    """Plan writing a stored or built-in surface as a JSON document: estimate the cost."""
    # A request names the surface in its URL, by the parameter `id`.
    return _plan_document(surface, limits, "/id")


def _plan_document(
    surface: Surface, limits: Limits, where: str, reading: Mapping[str, Any] | None = None
) -> Work[bytes]:
    cost = definition_cost(surface.written_size(), limits.max_bytes)
    return Work(cost, partial(_write_document, surface, limits, where, reading))


def _write_document(
    surface: Surface,
    limits: Limits,
    where: str,
    reading: Mapping[str, Any] | None = None,
    orientation: Orientation | None = None,
) -> bytes:
    """The surface as a JSON document; raises `TooLarge` with the pointer `where`."""
    document: dict[str, Any] = {"surface": definition(surface)}
    if reading is not None:
        document["reading"] = reading
    if orientation is not None:
        document["orientation"] = {
            "turned": list(orientation.turned),
            "not_orientable": list(orientation.not_orientable),
        }
    limits.check_bytes(json_bound(document), where, "The surface could become too large as JSON.")
    return json_document(document)
