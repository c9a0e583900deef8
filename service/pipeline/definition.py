"""A surface in, a document out: as JSON for other requests, or in the form that is stored."""

from dataclasses import dataclass

from service.encoders.text import json_bound, json_document
from service.pipeline.cost import Cost, definition_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.schemas.canonical import canonical, surface_id
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


@dataclass(frozen=True, eq=False, slots=True)
class ContentWork:
    """A surface that is to be stored."""

    surface: Surface
    cost: Cost

    def run(self) -> tuple[str, bytes]:
        """The id of the surface, and its canonical content."""
        content = canonical(self.surface)
        return surface_id(content), content


def plan_content(surface: Surface) -> ContentWork:
    """What the canonical content of a surface costs."""
    return ContentWork(surface, definition_cost(surface.stored_size(), DEFAULT_LIMITS))
