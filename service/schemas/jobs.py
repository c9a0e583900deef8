"""The JSON language of jobs: a list of parts, each of which is a request of its own."""

import re
from typing import Annotated, Any, Self, TypeAlias

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator

from service.errors import Issue
from service.schemas.accuracy import MAX_COUNT
from service.schemas.fields import (
    Name,
    Omittable,
    RequestModel,
    StrictModel,
    conflict_issue,
    optional,
)
from service.schemas.validation import to_invalid

MAX_PATH = 8000
"""The most characters of the path and the query of a part (RFC 9110, section 4.1)."""

FILE_ID = re.compile(r"[0-9a-f]{64}\.[0-9a-z]{1,16}", re.ASCII)
"""The id of a file: the SHA-256 of its bytes, and the name of the format that its sender said."""

FILE_ID_PATTERN = f"^{FILE_ID.pattern}$"
"""The pattern of `FILE_ID` as JSON Schema has it."""


def _check_file_id(id: str) -> str:
    if FILE_ID.fullmatch(id) is None:
        message, needed = "This is not the id of a file.", "an id from a response of POST /v1/files"
        raise to_invalid(Issue("wrong_value", message, got="another string", needed=needed))
    return id


FileId: TypeAlias = Annotated[
    str,
    AfterValidator(_check_file_id),
    WithJsonSchema({"type": "string", "pattern": FILE_ID_PATTERN}),
]


class PartDefinition(StrictModel):
    """One part of a job: a request that this service would also answer at once.

    With a body the part is a POST of one of the calls that compute; with a file a POST of
    `/v1/mesh`, `/v1/measure` or `/v1/convert` that has this file as its body, and all other fields
    in the query; with neither a GET of a mesh by URL.
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
    file: Annotated[FileId | None, Omittable()] = optional(
        "The id of a file that `POST /v1/files` has stored: the body of the POST, in place of a "
        "JSON body.",
        f"{'0' * 64}.step",
    )

    @model_validator(mode="after")
    def _check_body(self) -> Self:
        if self.file is not None and self.body is not None:
            message = "A part has a body, or a file in its place."
            raise to_invalid(conflict_issue("body", "file", message, is_neither=False))
        return self


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
