"""Responses, headers, links and computed examples for the OpenAPI document."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel

from service.api.caching.cached_response import FOR_AN_HOUR, FOR_EVER
from service.api.openapi.parameters import Json
from service.api.responses import (
    BOUND_HEADER,
    GAP_HEADER,
    READING_HEADER,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
    WRITING_HEADER,
)
from service.api.stored import content_id, mesh_url, picture_url, surface_url
from service.encoders.format import FileFormat
from service.schemas.validation import validate_document


def error(name: str) -> Json:
    """A reference to an error response, by the name of its component."""
    return {"$ref": f"#/components/responses/{name}"}


POST_ERRORS: dict[int | str, Json] = {
    400: error("MalformedJson"),
    408: error("BodyTooSlow"),
    413: error("BodyTooLarge"),
    415: error("UnsupportedMediaType"),
    422: error("InvalidRequest"),
    429: error("Busy"),
    500: error("InternalError"),
    503: error("OutOfTime"),
}
"""Errors that every POST may return."""


def header(description: str, example: Any, *, is_required: bool = True, **schema: Any) -> Json:
    """A response header."""
    about = {"description": description, "required": is_required, "example": example}
    return about | {"schema": {"type": "string"} | schema}


def _count(noun: str, example: int) -> Json:
    text = f"Number of {noun}, as in the report. Not sent with a file of exact patches."
    return header(text, example, is_required=False, type="integer", minimum=0)


TIMED: Json = {
    "Server-Timing": header(
        "Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. "
        "`cache;desc=hit` if nothing was computed for this request.",
        "cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200",
    )
}
CODED: Json = {
    "Content-Encoding": header(
        "The coding. Not sent if the body is not compressed.", "zstd", is_required=False
    )
}
FILE_HEADERS: Json = (
    TIMED
    | CODED
    | {
        "Content-Disposition": header(
            "A name to save the file under. Not sent with JSON.",
            'attachment; filename="sail.glb"',
            is_required=False,
        )
    }
)
WRITTEN_HEADERS: Json = FILE_HEADERS | {
    WRITING_HEADER: header(
        "What a file of definitions has: faces, definitions, instances, and the length of a unit "
        "in metres; `unit=assumed` if the surface has no unit, so that one unit is 1 mm. Not sent "
        "with JSON.",
        "faces=6; definitions=1; instances=1; metres_per_unit=0.001; unit=assumed",
        is_required=False,
    )
}
MESH_HEADERS: Json = FILE_HEADERS | {
    VERTICES_HEADER: _count("vertices", 8257),
    TRIANGLES_HEADER: _count("triangles", 16256),
    BOUND_HEADER: header(
        "The `deviation_bound` of the report, in model units. Sent with every format, because "
        "some cannot store a report; OBJ and PLY have it in a comment too. Not sent with a file "
        "of exact patches, or if the report has no bound.",
        0.0005,
        is_required=False,
        type="number",
        minimum=0,
    ),
    GAP_HEADER: header(
        "The `gap_bound` of the report, in model units. Sent for breps, with every format.",
        1e-7,
        is_required=False,
        type="number",
        minimum=0,
    ),
}
READING: Json = {
    READING_HEADER: header(
        "Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC "
        "8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` "
        "returns the whole report.",
        "faces=300; skipped=2",
        is_required=False,
    )
}
_CACHE_HEADERS: Json = {
    "ETag": header("Strong tag of the bytes in this coding.", '"3q2-7wEAAAAAAAAAAAAAAA"'),
    "Cache-Control": header(
        f"`{FOR_EVER}` for canonical URLs of surfaces whose id is a hash; else `{FOR_AN_HOUR}`.",
        FOR_AN_HOUR,
    ),
    "Vary": header("Request headers that the response depends on.", "Accept-Encoding"),
}
UNCHANGED_MESH: Json = {
    "description": "The client has the mesh already: `If-None-Match` lists its tag in a coding "
    "that the client accepts.",
    "headers": _CACHE_HEADERS | TIMED,
}
URL_HEADERS: Json = (
    MESH_HEADERS
    | _CACHE_HEADERS
    | {
        "Content-Disposition": header(
            "A name to save the file under.", 'inline; filename="sail.glb"'
        ),
        "Link": header(
            "The canonical URL.", f'<{mesh_url("", "utah-teapot", "glb")}>; rel="canonical"'
        ),
    }
)
UNCHANGED_IMAGE: Json = UNCHANGED_MESH | {
    "description": "The client has the picture already: `If-None-Match` lists its tag."
}
IMAGE_HEADERS: Json = (
    FILE_HEADERS
    | _CACHE_HEADERS
    | {"Link": header("The canonical URL.", f'<{picture_url("", "utah-teapot")}>; rel="canonical"')}
)
DEFINITION_HEADERS: Json = {
    "ETag": header("The hash of the content, in quotes.", f'"{content_id("saddle")}"'),
    "Cache-Control": header(f"`{FOR_EVER}` if the id is a hash; else `{FOR_AN_HOUR}`.", FOR_EVER),
}
UNCHANGED_DEFINITION: Json = {
    "description": "The client has the definition already: `If-None-Match` lists its tag.",
    "headers": DEFINITION_HEADERS,
}
LOCATION: Json = {
    "Location": header(
        "URL of the definition, without the host.", surface_url("", content_id("saddle"))
    )
}

_LINKS = {
    "Definition": ("getSurface", "The definition of the surface."),
    "Mesh": ("getSurfaceMesh", "Its mesh, in the format of a suffix."),
    "Removal": ("deleteSurface", "Its removal, if the service allows it."),
}


def links(id_expression: str, *names: str) -> Json:
    """Links to operations on a surface, whose id an OpenAPI runtime expression finds."""
    return {
        name: {"operationId": operation, "description": text, "parameters": {"id": id_expression}}
        for name, (operation, text) in _LINKS.items()
        if name in names
    }


def success(
    headers: Json = TIMED | CODED, formats: Sequence[FileFormat] = (), **fields: Any
) -> Json:
    """The 200 response, in JSON or one of `formats`; `fields`: further fields such as `links`."""
    content = {f.media_type: {"schema": file_schema(f)} for f in formats if f.name != "json"}
    return {"headers": headers, "content": content} | fields


def file_schema(fmt: FileFormat) -> Json:
    """The schema of a file in a format other than our JSON: an object, a text or bytes."""
    about: Json = {"description": f"{fmt.title}."}
    if fmt.media_type.endswith("json"):
        return about | {"type": "object", "additionalProperties": True}
    return about | {"type": "string"} | ({"format": "binary"} if "binary" in fmt.title else {})


Model = TypeVar("Model", bound=BaseModel)

EXAMPLE_RESPONSES: dict[str, Callable[[], Json]] = {}
"""Functions that compute the examples of JSON responses, by the id of the operation.

They run when the document is built, not before.
"""


def show_responses(
    operation: str, examples: Json, model: type[Model], respond: Callable[[Model], bytes]
) -> None:
    """Adds the responses to these examples of requests to the OpenAPI document.

    Parameters
    ----------
    operation : str
        Id of the operation.
    examples : dict
        For each name a summary and the value of a request's body.
    model : type
        The model of the body.
    respond : callable
        Computes the JSON response to a body.
    """

    def compute() -> Json:
        return {
            name: {
                "summary": example["summary"],
                "value": orjson.loads(respond(validate_document(model, example["value"]))),
            }
            for name, example in examples.items()
        }

    EXAMPLE_RESPONSES[operation] = cache(compute)
