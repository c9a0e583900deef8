"""Headers in the OpenAPI document: what answers say of themselves, and conditions on requests."""

from service.api.answers import TRIANGLES_HEADER, VERTICES_HEADER
from service.api.caching.codings import CODINGS
from service.api.caching.entries import FOR_AN_HOUR, FOR_EVER
from service.api.links import mesh_address
from service.api.openapi.references import Json


def _header(description: str, example: str, *, is_sure: bool = True) -> Json:
    schema = {"type": "string"}
    return {"description": description, "required": is_sure, "schema": schema, "example": example}


def _count(what: str, example: int) -> Json:
    return {
        "description": f"Number of {what}, as in the report. Not with the exact patches.",
        "schema": {"type": "integer", "minimum": 0},
        "example": example,
    }


COUNT_HEADERS: Json = {
    VERTICES_HEADER: _count("vertices", 8257),
    TRIANGLES_HEADER: _count("triangles", 16256),
}

SERVER_TIMING = _header(
    "Where the time went, in milliseconds: steps by name, `wait` being that for others. "
    "`cache;desc=hit` where nothing was computed for this request.",
    "cache;desc=miss, surface;dur=0.310, wait;dur=0.020, plan;dur=0.240, mesh;dur=1.920, "
    "compress;dur=4.200",
)


def timed(answer: Json) -> Json:
    """An answer that says where its time went."""
    return answer | {"headers": answer.get("headers", {}) | {"Server-Timing": SERVER_TIMING}}


_TAG = '"3q2-7wEAAAAAAAAAAAAAAA"'

URL_HEADERS: Json = {
    "ETag": _header("Strong tag of these very bytes, in this coding.", _TAG),
    "Cache-Control": _header(
        f"`{FOR_EVER}` under canonical addresses of surfaces whose id is a hash; else "
        f"`{FOR_AN_HOUR}`.",
        FOR_AN_HOUR,
    ),
    "Vary": _header("What else the answer depends on.", "Accept-Encoding"),
    "Content-Encoding": _header(
        "The coding; not there where the body is sent as it is.", "zstd", is_sure=False
    ),
    "Content-Disposition": _header("A name to save the file under.", 'inline; filename="sail.glb"'),
    "Link": _header(
        "The canonical address.",
        f'<{mesh_address("", "utah-teapot", "glb")}>; rel="canonical"',
    ),
    "Server-Timing": SERVER_TIMING,
}


def unchanged_headers() -> Json:
    """The headers of a 304."""
    return {name: URL_HEADERS[name] for name in ("ETag", "Cache-Control", "Vary", "Server-Timing")}


IF_NONE_MATCH: Json = {
    "name": "If-None-Match",
    "in": "header",
    "required": False,
    "description": "Tags of answers that the client has, or `*`.",
    "schema": {"type": "string"},
    "example": _TAG,
}

ACCEPT_ENCODING: Json = {
    "name": "Accept-Encoding",
    "in": "header",
    "required": False,
    "description": "Codings that the client takes, with weights if it likes: "
    + ", ".join(f"`{coding}`" for coding in CODINGS)
    + ". Small bodies, and those that would not become smaller, are sent as they are.",
    "schema": {"type": "string"},
    "example": "zstd, gzip",
}

RATE_HEADERS: Json = {
    "RateLimit-Policy": _header(
        "There where requests are limited (`SURFACE_RATE_LIMIT`): `q`, how many may be made in "
        "`w` seconds with one key, or from one address (draft-ietf-httpapi-ratelimit-headers).",
        '"requests";q=60;w=60',
        is_sure=False,
    ),
    "RateLimit": _header(
        "There with `RateLimit-Policy`: `r`, how many could follow at once, and `t`, after how "
        "many seconds all could again.",
        '"requests";r=57;t=3',
        is_sure=False,
    ),
}
"""Headers of nearly all answers, as components."""

RATE_REFERENCES: Json = {name: {"$ref": f"#/components/headers/{name}"} for name in RATE_HEADERS}
