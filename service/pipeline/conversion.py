"""Surface and operations in, the surface in another form out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from service.encoders.text import json_bound, json_document
from service.engine.models import NOT_PATCHES
from service.errors import InvalidRequest
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.memory import convertible, converting
from service.pipeline.parametric import NOT_PARAMETRIC
from service.schemas.surfaces import definition
from service.surface import Surface
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.sweeps import RibbonSurface, TubeSurface


@dataclass(frozen=True, eq=False, slots=True)
class ConversionWork:
    """A conversion that may be made; that every step of it can be made is seen on the way."""

    surface: Surface
    operations: Sequence[Operation]
    allowed: Allowed
    limits: Limits

    @property
    def memory(self) -> int:
        """Bytes that the work takes at most, the answer included."""
        return converting(self.surface, self.operations, self.allowed.control_points)

    def run(self) -> bytes:
        """The surface after the operations, as a JSON document that other requests can begin with.

        Raises
        ------
        InvalidRequest, TooLarge
            With pointers into the request for it, `/operations/…`.
        """
        document = {"surface": definition(convert(self.surface, self.operations, self.allowed))}
        message = "The surface could become too large as JSON."
        self.limits.check_bytes(json_bound(document), message, "/operations")
        return json_document(document)


def plan_conversion(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: Allowed,
    limits: Limits = DEFAULT_LIMITS,
) -> ConversionWork:
    """What is to be made of a surface, after it was found affordable from its shapes.

    Raises
    ------
    InvalidRequest
        `not_parametric`.
    """
    if isinstance(surface, GroupSurface):
        raise InvalidRequest(NOT_PARAMETRIC)
    if isinstance(surface, TubeSurface | RibbonSurface):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/surface"))
    # Too large is then what more than the memory would be needed for, at whichever step.
    most = min(allowed.control_points, convertible(surface, limits.max_memory))
    return ConversionWork(surface, operations, replace(allowed, control_points=most), limits)


def converted(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: Allowed,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface after the operations; raises what `plan_conversion` and the work raise."""
    return plan_conversion(surface, operations, allowed, limits).run()
