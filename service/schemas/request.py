"""A whole request: a surface and, beside it, the options of its mesh."""

from collections.abc import Mapping

from pydantic import Field

from service.errors import InvalidRequest
from service.schemas.accuracy import CameraField, PixelTolerance
from service.schemas.fields import StrictModel
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import SurfaceDefinition
from service.schemas.validation import validate_document
from service.surface import Surface


class SurfaceRequest(StrictModel):
    """A surface and nothing else: to store it."""

    surface: SurfaceDefinition = Field(description="The surface, by its control points.")

    def to_surface(self) -> Surface:
        """The surface itself; raises `InvalidRequest` with pointers into the whole request."""
        return surface_of(self.surface)


class MeshRequest(MeshOptionFields):
    """A surface to mesh, and how."""

    surface: SurfaceDefinition = Field(
        description="The surface, by its control points.",
    )
    camera: CameraField = None
    pixel_tolerance: PixelTolerance = None

    def to_surface(self) -> Surface:
        """The surface itself.

        Raises
        ------
        InvalidRequest
            With pointers into the whole request.
        """
        return surface_of(self.surface)


def surface_of(definition: SurfaceDefinition) -> Surface:
    """The surface that stands at `/surface` of a request.

    Raises
    ------
    InvalidRequest
        With pointers into the whole request.
    """
    try:
        return definition.to_surface()
    except InvalidRequest as error:
        raise error.within("/surface") from None


def mesh_options(values: Mapping[str, object]) -> MeshOptionFields:
    """The options alone, as a query or a command line gives them.

    Raises
    ------
    InvalidRequest
        With pointers `/name of the option`.
    """
    return validate_document(MeshOptionFields, dict(values))
