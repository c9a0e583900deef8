"""Requests for one surface: to store it, to mesh it with options, to sign its URL."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.errors import InvalidRequest
from service.schemas.accuracy import MAX_PIXELS, CameraDefinition
from service.schemas.fields import Omittable, RequestModel, conflict_error, optional
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import SurfaceDefinition
from service.schemas.validation import to_invalid
from service.surface import Surface

MAX_SECONDS = 7 * 24 * 3600
"""The longest time for which a URL is signed: a person whose key is revoked must lose access."""

MAX_MOMENT = 10**12 - 1

MAX_URL = 8000


class SurfaceRequest(RequestModel):
    """A surface to store."""

    surface: SurfaceDefinition = Field(description="The surface, by its control points.")

    def build(self) -> None:
        """Builds the surface, which `to_surface` returns from then on."""
        self.to_surface()

    def to_surface(self) -> Surface:
        """The surface itself, built once; `InvalidRequest` points into the whole request."""
        built: Surface | None = self.__dict__.get("_built")
        if built is None:
            try:
                built = self.__dict__["_built"] = self.surface.to_surface()
            except InvalidRequest as error:
                raise error.within("/surface") from None
        return built


class MeshRequest(SurfaceRequest, MeshOptionFields):
    """A surface, and the options of its mesh."""

    camera: Annotated[CameraDefinition | None, Omittable()] = optional(
        "The camera that will see the mesh; needs `pixel_tolerance`. In bodies only, not in "
        "queries.",
        {"position": [4, 3, 9], "field_of_view": 0.8, "height": 1080},
    )
    pixel_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_PIXELS)] = optional(
        "The largest error in pixels, as the `camera` sees it; needs `camera`. The tolerance of "
        "each part follows from its least distance from the camera; a `tolerance` holds in "
        "addition.",
        0.5,
    )


class SignRequest(RequestModel):
    """A URL to be signed: until it expires, any client may read it without a key."""

    url: Annotated[str, Field(max_length=MAX_URL)] = Field(
        description="URL of a surface or of a mesh, without the host, as in the `links` of a "
        "stored surface; options of a mesh may follow as a query.",
        examples=["/v1/surfaces/utah-teapot/mesh.glb?resolution=16"],
    )
    expires: Annotated[int | None, Omittable(), Field(ge=0, le=MAX_MOMENT)] = optional(
        "The time when the URL expires, in seconds since 1970 (Unix time); at most seven days from "
        "now. The same time always gives the same URL, which browsers can cache.",
        1800000000,
    )
    seconds: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_SECONDS)] = optional(
        "Seconds from now until the URL expires, in place of `expires`.", 3600
    )

    @model_validator(mode="after")
    def _check_end(self) -> Self:
        if (self.expires is None) == (self.seconds is None):
            message = "A request has either `expires` or `seconds`."
            issue = conflict_error("expires", "expires", message, is_neither=self.expires is None)
            raise to_invalid(issue)
        return self
