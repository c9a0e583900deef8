"""Surfaces as JSON documents: after a conversion, or unchanged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from service.encoders.text import json_bound, json_document
from service.engine.models import NOT_PATCHES
from service.errors import InvalidRequest
from service.pipeline.checks import NOT_PARAMETRIC
from service.pipeline.cost import (
    Cost,
    conversion_cost,
    conversion_points,
    definition_cost,
    most_converted_points,
)
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.schemas.surfaces import definition
from service.surface import Surface
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.group import GroupSurface


@dataclass(frozen=True, eq=False, slots=True)
class ConversionWork:
    """The work of a conversion within the limits; `run` checks each step before it makes it."""

    surface: Surface
    operations: Sequence[Operation]
    allowed: SizeLimits
    limits: Limits
    cost: Cost

    def run(self) -> bytes:
        """The surface after the operations, as a JSON document that is a body for other requests.

        Raises
        ------
        InvalidRequest, TooLarge
            The pointers, `/operations/…`, point into the request.
        """
        converted = convert(self.surface, self.operations, self.allowed)
        return _write_document(converted, self.limits, "/operations")


def plan_conversion(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: SizeLimits,
    limits: Limits = DEFAULT_LIMITS,
) -> ConversionWork:
    """Plans a conversion; checks limits by the shapes of the surface.

    Raises
    ------
    InvalidRequest
        `not_parametric`.
    """
    if isinstance(surface, GroupSurface):
        raise InvalidRequest(NOT_PARAMETRIC)
    size = surface.size()
    if size.curves:
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/surface"))
    # A step with more control points than the memory holds is refused as too large.
    most = min(allowed.control_points, most_converted_points(size, limits))
    cost = conversion_cost(size, min(most, conversion_points(size, operations)), limits)
    allowed = replace(allowed, control_points=most)
    return ConversionWork(surface, operations, allowed, limits, cost)


@dataclass(frozen=True, eq=False, slots=True)
class DefinitionWork:
    """The work of writing a surface as JSON, and its cost."""

    surface: Surface
    limits: Limits
    cost: Cost

    def run(self) -> bytes:
        """The document.

        Raises
        ------
        TooLarge
        """
        return _write_document(self.surface, self.limits, "/id")


def plan_definition(surface: Surface, limits: Limits = DEFAULT_LIMITS) -> DefinitionWork:
    """Plans the JSON document of a surface."""
    return DefinitionWork(surface, limits, definition_cost(surface.stored_size(), limits))


def _write_document(surface: Surface, limits: Limits, where: str) -> bytes:
    """The surface as a JSON document; raises `TooLarge`, pointing at `where`."""
    document = {"surface": definition(surface)}
    message = "The surface could become too large as JSON."
    limits.check_bytes(json_bound(document), message, where)
    return json_document(document)
