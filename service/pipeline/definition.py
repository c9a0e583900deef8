"""A surface in, the JSON document out that other requests can begin with."""

from dataclasses import dataclass

from service.encoders.text import json_bound, json_document
from service.pipeline.cost import Cost, definition_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.schemas.surfaces import definition
from service.surface import Surface


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
        document = {"surface": definition(self.surface)}
        message = "The surface could become too large as JSON."
        self.limits.check_bytes(json_bound(document), message, "/id")
        return json_document(document)


def plan_definition(surface: Surface, limits: Limits = DEFAULT_LIMITS) -> DefinitionWork:
    """What writing a surface down costs."""
    return DefinitionWork(surface, limits, definition_cost(surface.stored_size(), limits))
