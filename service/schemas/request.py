"""Requests for one surface: to store the surface, to mesh it, or to sign its URL."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from service.errors import InvalidRequest
from service.schemas.accuracy import MAX_PIXELS, CameraDefinition
from service.schemas.fields import (
    IgnoredOrientation,
    IgnoredReading,
    Omittable,
    RequestModel,
    conflict_issue,
    optional,
)
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import SurfaceDefinition
from service.schemas.validation import to_invalid
from service.surface.kinds import Surface

MAX_SECONDS = 7 * 24 * 3600
"""The longest time for which a URL is signed, in seconds. After this time, a person whose key was
revoked has no access any more."""

MAX_MOMENT = 10**12 - 1
"""The latest time that a request may name, in seconds since 1970: signed URLs have at most 12
digits for it."""

MAX_URL = 8000
"""The most characters of a URL to sign. RFC 9110, section 4.1, recommends that all programs support
URLs of 8,000 bytes."""


class SurfaceRequest(RequestModel):
    """A surface to store."""

    surface: SurfaceDefinition = Field(description="The surface, by its control points.")
    reading: IgnoredReading = None
    orientation: IgnoredOrientation = None

    def keep_reading(self, reading: Mapping[str, Any] | None) -> None:
        """Sets `reading`, which clients cannot: the report of the file that has the surface."""
        self.__dict__["reading"] = reading

    def to_surface(self) -> Surface:
        """The surface as a value; the first call builds it.

        Raises `InvalidRequest` with pointers into the whole request.
        """
        surface: Surface | None = self.__dict__.get("_surface")
        if surface is None:
            try:
                surface = self.__dict__["_surface"] = self.surface.to_surface()
            except InvalidRequest as error:
                raise error.within("/surface") from None
        return surface

    build = to_surface


class MeshRequest(SurfaceRequest, MeshOptionFields):
    """A surface, and the options of its mesh."""

    camera: Annotated[CameraDefinition | None, Omittable()] = optional(
        "The camera that will see the mesh; requires `pixel_tolerance`. A query cannot have it.",
        {"position": [4, 3, 9], "field_of_view": 0.8, "height": 1080},
    )
    pixel_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_PIXELS)] = optional(
        "The largest error in the picture of the `camera`, in pixels; requires `camera`. It holds "
        "in the middle of the picture: at the angle θ from there an error appears up to 1 / cos² θ "
        "times as large. The tolerance of each part of the surface follows from its least distance "
        "from the camera. A `tolerance` in the same request applies, too.",
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
            # The issue points to `expires` in both cases: if there is neither, and if both are.
            issue = conflict_issue("expires", "expires", message, is_neither=self.expires is None)
            raise to_invalid(issue)
        return self
