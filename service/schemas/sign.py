"""What shall be signed, as a document says it: an address, and until when."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.errors import Issue
from service.schemas.fields import Omittable, StrictModel
from service.schemas.validation import refusal

MAX_SECONDS = 7 * 24 * 3600
"""For so long an address is signed at most: who leaves with one, does not stay in for ever."""

MAX_MOMENT = 10**12 - 1

MAX_URL = 8000


class SignRequest(StrictModel):
    """An address that shall be readable by whoever has it, until a moment."""

    url: Annotated[str, Field(max_length=MAX_URL)] = Field(
        description="Address of a surface or of a mesh here, without the host: as `links` of a "
        "stored surface have it, and with any options of a mesh in its query.",
        examples=["/v1/surfaces/utah-teapot/mesh.glb?resolution=16"],
    )
    expires: Annotated[int | None, Omittable(), Field(ge=0, le=MAX_MOMENT)] = Field(
        default=None,
        description="Until when, in seconds since 1970 (Unix time); at most seven days from now. "
        "The same moment makes the same address each time, which browsers can keep.",
        examples=[1800000000],
    )
    seconds: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_SECONDS)] = Field(
        default=None, description="Instead: for how long from now.", examples=[3600]
    )

    @model_validator(mode="after")
    def _ends_once(self) -> Self:
        if (self.expires is None) == (self.seconds is None):
            given = "neither" if self.expires is None else "both"
            code = "missing_field" if self.expires is None else "conflicting_options"
            message = "There must be one end: `expires`, or `seconds`."
            raise refusal([(("expires",), Issue(code, message, "", given, "one of the two"))])
        return self
