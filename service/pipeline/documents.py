"""A surface in, a JSON document out: converted, or as it is."""

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
    """A conversion that may be made; that every step of it can be made is seen on the way."""

    surface: Surface
    operations: Sequence[Operation]
    allowed: SizeLimits
    limits: Limits
    cost: Cost

    def run(self) -> bytes:
        """The surface after the operations, as a JSON document that other requests can begin with.

        Raises
        ------
        InvalidRequest, TooLarge
            With pointers into the request for it, `/operations/…`.
        """
        converted = convert(self.surface, self.operations, self.allowed)
        return _write_document(converted, self.limits, "/operations")


def plan_conversion(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: SizeLimits,
    limits: Limits = DEFAULT_LIMITS,
) -> ConversionWork:
    """Plan a conversion, which is checked against the limits by the shapes alone.

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
    # A step that leads to more than the memory holds is refused as too large.
    most = min(allowed.control_points, most_converted_points(size, limits))
    cost = conversion_cost(size, min(most, conversion_points(size, operations)), limits)
    allowed = replace(allowed, control_points=most)
    return ConversionWork(surface, operations, allowed, limits, cost)


@dataclass(frozen=True, eq=False, slots=True)
class DefinitionWork:
    """A surface that is to be written down."""

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
    """Plan the JSON document of a surface."""
    return DefinitionWork(surface, limits, definition_cost(surface.stored_size(), limits))


def _write_document(surface: Surface, limits: Limits, where: str) -> bytes:
    """The surface as a JSON document; raises `TooLarge`, pointing at `where`."""
    document = {"surface": definition(surface)}
    message = "The surface could become too large as JSON."
    limits.check_bytes(json_bound(document), message, where)
    return json_document(document)
