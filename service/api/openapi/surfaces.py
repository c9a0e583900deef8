"""Surfaces with an address, in the OpenAPI document; what storing one answers is computed."""

from functools import cache

from service.api.caching.entries import FOR_AN_HOUR, FOR_EVER
from service.api.links import mesh_links, surface_address
from service.api.openapi.bodies import with_files
from service.api.openapi.examples import REQUESTS
from service.api.openapi.headers import IF_NONE_MATCH, timed
from service.api.openapi.links import links
from service.api.openapi.mesh import ID_PARAMETER
from service.api.openapi.operations import get_operation, post_operation, problems
from service.api.openapi.references import Json, ref
from service.api.stored import content_id
from service.encoders.registry import FORMATS
from service.schemas.canonical import canonical, surface_id
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document

_STORED = ("patch", "rational", "nurbs", "group")
"""Requests for meshes whose surfaces are the examples here."""

_STORE = """\
Stores the surface under the SHA-256 of its content, which is its id from then on: 201 where it is
new, 200 where it was there. All ways to write a surface down have one id: the order of keys, the
spelling of numbers (`1`, `1.0`, `1e0`, −0), what a default says and whether it is said make no
difference; any other number does. A file of control points is the surface that JSON would say, with
what it does not hold in the query. Its meshes have addresses, which `links` names, and may be kept
for ever by whoever fetches them.
"""

_GET = """\
The definition of a built-in or a stored surface, as a body for the other calls. Under an id that is
a hash it never changes; its `ETag` is the hash of the content, in quotes.
"""

_DELETE = """\
Removes a stored surface, where the service is set up to allow it (`SURFACE_ALLOW_DELETE`); else,
and for built-in surfaces, 405. What others have kept of its meshes is theirs: addresses that may be
kept for ever are not called back. Storing the surface again brings back the same id.
"""


def collection() -> Json:
    """/v1/surfaces."""
    lists = get_operation(
        "listSurfaces", "catalogue", "The built-in surfaces", "SurfaceList", "InvalidQuery"
    )
    first = "$response.body#/surfaces/0/id"
    lists["responses"]["200"]["links"] = links(first, "Definition", "Mesh")
    return {"get": lists, "post": _post()}


def item() -> Json:
    """/v1/surfaces/{id}."""
    reads = get_operation(
        "getSurface",
        "surfaces",
        "The definition of a surface",
        "SurfaceDocument",
        "UnknownSurface",
        "InvalidQuery",
        "Busy",
        "Unavailable",
    )
    reads["description"] = _GET
    reads["parameters"] = [ID_PARAMETER, IF_NONE_MATCH]
    reads["responses"]["200"] = timed(reads["responses"]["200"] | {"headers": _HEADERS})
    reads["responses"]["200"]["links"] = links("$request.path.id", "Mesh")
    reads["responses"]["304"] = {
        "description": "The client has the definition already: `If-None-Match` lists its tag.",
        "headers": _HEADERS,
    }
    reads["responses"] |= problems("DamagedObject")
    deletes = {
        "operationId": "deleteSurface",
        "tags": ["surfaces"],
        "summary": "Removes a stored surface",
        "description": _DELETE,
        "parameters": [_STORED_ID],
        "responses": {
            "204": {"description": "It is gone."},
            **problems(
                "UnknownSurface", "MethodNotAllowed", "InvalidQuery", "InternalError", "StoreFailed"
            ),
        },
    }
    return {"get": reads, "delete": deletes}


def stored_schema() -> Json:
    """What storing a surface answers."""
    mesh = {fmt.suffix: _text(f"{fmt.title}.") for fmt in FORMATS}
    addresses = {
        "self": _text("Address of the definition."),
        "mesh": {
            "type": "object",
            "properties": mesh,
            "required": list(mesh),
            "description": "Address of the mesh by suffix, in the numbers of today: it may be kept "
            "for ever. Options are added in front of `engine`.",
        },
    }
    return {
        "type": "object",
        "properties": {
            "id": _text("SHA-256 of the content: 64 hexadecimal digits.")
            | {"pattern": "^[0-9a-f]{64}$"},
            "links": {
                "type": "object",
                "properties": addresses,
                "required": list(addresses),
                "description": "Addresses, without the host.",
            },
        },
        "required": ["id", "links"],
        "description": "A surface that is stored.",
    }


def _post() -> Json:
    examples = _examples()
    requests = {
        name: {"summary": REQUESTS[name]["summary"], "value": {"surface": surface}}
        for name, (surface, _) in examples.items()
    }
    answers = {
        name: {"summary": REQUESTS[name]["summary"], "value": answer}
        for name, (_, answer) in examples.items()
    }
    (address, *_) = (answer["links"]["self"] for _, answer in examples.values())
    answer = {
        "description": "It was stored already.",
        "headers": {
            "Location": {
                "required": True,
                "description": "Address of the definition, without the host.",
                "schema": {"type": "string"},
                "example": address,
            }
        },
        "content": {"application/json": {"schema": ref("StoredSurface"), "examples": answers}},
        "links": links("$response.body#/id", "Definition", "Mesh", "Removal"),
    }
    operation = post_operation(
        "storeSurface",
        "surfaces",
        "Stores a surface",
        _STORE,
        request=("SurfaceRequest", requests),
        answer=timed(answer),
    )
    operation["responses"] = {
        "201": timed(answer) | {"description": "It is stored."},
        **operation["responses"],
        **problems("Unavailable", "StoreFull"),
    }
    return with_files(operation, options=False)


@cache
def _examples() -> dict[str, tuple[Json, Json]]:
    """Surface and answer of each example."""
    found: dict[str, tuple[Json, Json]] = {}
    for name in _STORED:
        surface: Json = REQUESTS[name]["value"]["surface"]
        wanted = validate_document(SurfaceRequest, {"surface": surface})
        id = surface_id(canonical(wanted.to_surface()))
        addresses = {"self": surface_address("", id), "mesh": mesh_links("", id)}
        found[name] = surface, {"id": id, "links": addresses}
    return found


_STORED_ID = ID_PARAMETER | {
    "description": "Id of a stored surface: what storing it answered.",
    "schema": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
    "example": content_id("saddle"),
}

_HEADERS: Json = {
    "ETag": {
        "required": True,
        "description": "The hash of the content, in quotes.",
        "schema": {"type": "string"},
        "example": f'"{content_id("saddle")}"',
    },
    "Cache-Control": {
        "required": True,
        "description": f"`{FOR_EVER}` where the id is a hash; else `{FOR_AN_HOUR}`.",
        "schema": {"type": "string"},
        "example": FOR_EVER,
    },
}


def _text(description: str) -> Json:
    return {"type": "string", "description": description}
