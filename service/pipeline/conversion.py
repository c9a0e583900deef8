"""Surface and operations in, the surface in another form out."""

from collections.abc import Sequence
from dataclasses import replace

from service.encoders.text import json_bound, json_text
from service.engine.models import NOT_PATCHES
from service.errors import InvalidRequest
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.parametric import NOT_PARAMETRIC
from service.schemas.surfaces import definition
from service.surface import Surface
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.sweeps import RibbonSurface, TubeSurface


def converted(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: Allowed,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface after the operations, as a JSON document that other requests can begin with.

    Raises
    ------
    InvalidRequest, TooLarge
        With pointers into the request for it, `/operations/…`.
    """
    if isinstance(surface, GroupSurface):
        raise InvalidRequest(NOT_PARAMETRIC)
    if isinstance(surface, TubeSurface | RibbonSurface):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/surface"))
    document = {"surface": definition(convert(surface, operations, allowed))}
    message = "The surface could become too large as JSON."
    limits.check_bytes(json_bound(document), message, "/operations")
    return json_text(document)
