"""The JSON language of jobs: a list of parts, each of which is a request of its own."""

from typing import Annotated, Any

from pydantic import Field

from service.schemas.accuracy import MAX_COUNT
from service.schemas.fields import Name, Omittable, RequestModel, StrictModel, optional

MAX_PATH = 8000
"""The most characters of the path and the query of a part (RFC 9110, section 4.1)."""


class PartDefinition(StrictModel):
    """One part of a job: a request that this service would also answer at once.

    With a body the part is a POST of one of the calls that compute, without a body a GET of a mesh
    by URL.
    """

    name: Annotated[Name | None, Omittable()] = optional(
        "A name for the part, which results repeat; the default is its index.", "lid"
    )
    path: Annotated[str, Field(max_length=MAX_PATH)] = Field(
        description="Path and query of the request, without the host.",
        examples=["/v1/mesh?format=glb", "/v1/surfaces/utah-teapot/mesh.glb?resolution=8"],
    )
    body: Annotated[dict[str, Any] | None, Omittable()] = optional(
        "The JSON body of a POST.",
        {"surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}},
    )


class JobRequest(RequestModel):
    """A job: its parts are computed independently of each other, in any order."""

    parts: Annotated[tuple[PartDefinition, ...], Field(strict=False, min_length=1)] = Field(
        description="The parts. Results list them in this order, by index."
    )


MAX_LISTED = 1000
"""The most results in one list."""


class ResultsRange(StrictModel):
    """The query of a list of results: which parts it has."""

    first: Annotated[int, Field(alias="from", ge=0, le=MAX_COUNT)] = 0
    limit: Annotated[int, Field(ge=1, le=MAX_LISTED)] = MAX_LISTED
