"""The OpenAPI document: every call, every media type, every error, with examples that are true.

Routes read the raw request, so nothing could be derived from their signatures. The language comes
from the pydantic models, formats and ids from their registries, and the examples of meshes and
errors from the code that makes them.
"""

from functools import cache

from service import __version__
from service.api.openapi import surfaces
from service.api.openapi.access import SECURITY_SCHEMES, guarded
from service.api.openapi.answers import ANSWERS
from service.api.openapi.codes import code_list
from service.api.openapi.convert import post_convert
from service.api.openapi.curve import curve_schema, post_curve
from service.api.openapi.estimate import estimate_schema, post_estimate
from service.api.openapi.examples import meshes
from service.api.openapi.headers import RATE_HEADERS
from service.api.openapi.mesh import get_mesh, post_mesh
from service.api.openapi.observing import add_ids, metrics_operation, ready_operation
from service.api.openapi.operations import get_operation
from service.api.openapi.points import points_schema, post_points
from service.api.openapi.problems import responses
from service.api.openapi.references import Json
from service.api.openapi.requests import request_schemas
from service.api.openapi.shapes import with_named_unions, with_tuples
from service.api.openapi.sign import post_sign, signed_schema

_DESCRIPTION = """\
Parametric surfaces in, meshes out: post a control net, get vertices and faces.

A request carries a surface and, beside it, the options of its mesh. Built-in surfaces, and those
that were stored, answer by URL, with the same options as query parameters. `GET` calls answer
`HEAD` as well.

Every answer has an id in `X-Request-Id`, that of the request where it brings a harmless one. It is
in the log of the service, as is the trace that a `traceparent` names (W3C Trace Context).

Errors are problems (RFC 9457) with a stable `code` and, for each thing that is wrong, a JSON
pointer into the body or the name of a parameter, what was got and what was needed. The input is
never repeated. A request that would cost too much is refused before anything is computed: 413 where
the body itself is too long, 422 where its content or the answer would be too large.

Some problems may come at every address, before the request has been read, and the connection is
closed after them: 400 `malformed_request`, what is no HTTP/1.1 or could be read in two ways; 431
`head_too_large`, the address and the headers are too long; 408 `head_too_slow`, they did not arrive
in time; 503 `too_many_connections`; and 503 `draining`, the service stopped before it could answer.
Both of the last come with `Retry-After`.

The `code` of a problem tells its kind; the `code` of each of its `errors` is one of these:

"""

_TAGS = [
    {"name": "meshes", "description": "Surfaces to meshes."},
    {"name": "points", "description": "Points of surfaces, one by one."},
    {"name": "surfaces", "description": "Surfaces with an address, and in another form."},
    {"name": "curves", "description": "Curves to points and lines."},
    {"name": "catalogue", "description": "What there is to ask for."},
    {"name": "operations", "description": "Whether the service is well."},
]


@cache
def document() -> Json:
    """The whole document, OpenAPI 3.1."""
    whole: Json = {
        "openapi": "3.1.0",
        "info": {
            "title": "Surface Service",
            "version": __version__,
            "description": _DESCRIPTION + code_list(),
        },
        "tags": _TAGS,
        "paths": guarded(_paths()),
        "components": {
            "schemas": with_named_unions(
                request_schemas()
                | ANSWERS
                | {
                    "Points": points_schema(),
                    "Curve": curve_schema(),
                    "Estimate": estimate_schema(),
                    "StoredSurface": surfaces.stored_schema(),
                    "SignedAddress": signed_schema(),
                }
            ),
            "responses": responses(),
            "headers": RATE_HEADERS,
            "securitySchemes": SECURITY_SCHEMES,
            "examples": meshes(),
        },
    }
    add_ids(whole)
    return whole | {key: with_tuples(whole[key]) for key in ("paths", "components")}


def _paths() -> Json:
    return {
        "/v1/mesh": {"post": post_mesh()},
        "/v1/estimate": {"post": post_estimate()},
        "/v1/points": {"post": post_points()},
        "/v1/convert": {"post": post_convert()},
        "/v1/curve": {"post": post_curve()},
        "/v1/surfaces": surfaces.collection(),
        "/v1/surfaces/{id}": surfaces.item(),
        "/v1/surfaces/{id}/mesh.{suffix}": {"get": get_mesh()},
        "/v1/sign": {"post": post_sign()},
        "/v1/formats": {
            "get": get_operation(
                "listFormats", "catalogue", "The formats written here", "FormatList", "InvalidQuery"
            )
        },
        "/health": {
            "get": get_operation(
                "getHealth", "operations", "State and versions, for people", "Health"
            )
        },
        "/health/live": {
            "get": get_operation(
                "getLiveness", "operations", "200 as long as the process works", "Health"
            )
        },
        "/health/ready": {"get": ready_operation()},
        "/metrics": {"get": metrics_operation()},
    }
