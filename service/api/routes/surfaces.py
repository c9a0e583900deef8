"""Routes that store, read, list and delete surfaces, and sign their URLs."""

import time
from functools import cache
from typing import Any

import orjson
from fastapi import APIRouter, HTTPException, Request, Response

from service.api.body import BodyRoute
from service.api.caching.cached_response import FOR_AN_HOUR, FOR_EVER, matches_all, parse_tags
from service.api.compression import compress_response
from service.api.guard.signatures import MIN_SECRET, Signer, build_signed_url
from service.api.models.surfaces import SignedAddress, StoredSurface, SurfaceDocument, SurfaceList
from service.api.negotiation import condition_of, refuse_parameters
from service.api.openapi.parameters import (
    IF_NONE_MATCH,
    REQUESTS,
    Json,
    StoredId,
    SurfaceId,
    json_body,
    surface_body,
)
from service.api.openapi.responses import (
    CODED,
    DEFINITION_HEADERS,
    LOCATION,
    POST_ERRORS,
    READING,
    TIMED,
    UNCHANGED_DEFINITION,
    error,
    header,
    links,
    show_responses,
    success,
)
from service.api.responses import HEADERS, bytes_response, json_response, reading_headers
from service.api.services import ContextDep
from service.api.stored import (
    content_id,
    exists,
    mesh_url_path,
    picture_url_path,
    stored_links,
    surface_of,
    surface_url,
)
from service.decoders.registry import DECODERS
from service.encoders.registry import FORMATS
from service.errors import Issue, UnknownSurface
from service.pipeline.documents import plan_definition
from service.schemas.request import SignRequest, SurfaceRequest
from service.storage.canonical import plan_content
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.examples.catalogue import EXAMPLES, Example
from service.surface.lowered import GroupModel, Model


class SurfaceRoute(BodyRoute):
    """A route that reads a surface as JSON or as a file."""

    decoders = DECODERS
    has_surface_files = True


storing = APIRouter(route_class=SurfaceRoute)
reading = APIRouter()
signing = APIRouter(route_class=BodyRoute)
deleting = APIRouter()


_MESHES = REQUESTS["createMesh"]
_SURFACES: Json = {
    name: _MESHES[name] | {"value": {"surface": _MESHES[name]["value"]["surface"]}}
    for name in ("patch", "rational", "nurbs", "group")
}
_NOW = 1_799_996_400
"""The present in the example of a signed URL, which expires an hour later, at 1,800,000,000."""


def _store_example(body: SurfaceRequest) -> bytes:
    id, _ = plan_content(body.to_surface()).run()
    return orjson.dumps({"id": id, "links": stored_links("", id)})


def _sign_example(body: SignRequest) -> bytes:
    """A URL signed with a fixed public secret, so that the example never changes."""
    url, expires = build_signed_url(Signer(["-" * MIN_SECRET]), body, "", _NOW)
    return orjson.dumps({"url": url, "expires": expires})


show_responses("storeSurface", _SURFACES, SurfaceRequest, _store_example)
show_responses("signAddress", REQUESTS["signAddress"], SignRequest, _sign_example)

_STORED = success(
    TIMED | LOCATION | READING, links=links("$response.body#/id", "Definition", "Mesh", "Removal")
)


@storing.post(
    "/v1/surfaces",
    operation_id="storeSurface",
    tags=["surfaces"],
    summary="Stores a surface",
    response_model=StoredSurface,
    response_description="The surface was stored already.",
    responses={
        200: _STORED,
        201: _STORED | {"description": "The surface is stored.", "model": StoredSurface},
        **POST_ERRORS,
        503: error("Unavailable"),
        507: error("StoreFull"),
    },
    openapi_extra=surface_body(_SURFACES),
)
async def store_surface(body: SurfaceRequest, context: ContextDep) -> Response:
    """Stores the surface under the SHA-256 of its content, which becomes its id.

    The status is 201 for a new surface, 200 for one that was stored already. All ways to write the
    same surface have one id: the order of keys, the form of numbers (`1`, `1.0`, `1e0`; 0 and −0)
    and explicit defaults make no difference; another value of a number makes another surface. A
    file of control points, with the other fields in the query, is the same surface as in JSON.
    `links` has the URLs of the meshes and of the picture, which clients may cache for ever.
    """
    services, computation, request, _ = context
    id, content = await computation.run(plan_content(body.to_surface()), "content")
    async with computation.until_deadline():
        with computation.timing.step("store"):
            is_new = await services.store.put(id, content)
    root = request.scope.get("root_path", "")
    headers = HEADERS | {
        "Location": surface_url(root, id),
        "Server-Timing": str(computation.timing),
    }
    document = {"id": id, "links": stored_links(root, id)}
    if body.reading is not None:
        document["reading"] = body.reading
        headers |= reading_headers(body.reading)
    return json_response(document, 201 if is_new else 200, headers)


@reading.get(
    "/v1/surfaces",
    operation_id="listSurfaces",
    tags=["catalogue"],
    summary="The built-in surfaces",
    response_model=SurfaceList,
    response_description="The built-in surfaces.",
    responses={
        200: success(
            CODED | {"Cache-Control": header("How long it may be kept.", FOR_AN_HOUR)},
            links=links("$response.body#/surfaces/0/id", "Definition", "Mesh"),
        ),
        422: error("InvalidQuery"),
        500: error("InternalError"),
    },
)
async def list_surfaces(request: Request, context: ContextDep) -> Response:
    """Lists the built-in surfaces, with the URLs of their meshes."""
    refuse_parameters(request.query_params)
    root = request.scope.get("root_path", "")
    surfaces = [_build_summary(each, root) for each in EXAMPLES.values()]
    kept = HEADERS | {"Cache-Control": FOR_AN_HOUR}
    response = json_response({"surfaces": surfaces}, headers=kept)
    accepted = request.headers.get("accept-encoding", "").encode("latin-1")
    return await compress_response(response, accepted, context.computation)


@reading.get(
    "/v1/surfaces/{id}",
    operation_id="getSurface",
    tags=["surfaces"],
    summary="The definition of a surface",
    response_model=SurfaceDocument,
    response_description="The definition of a surface.",
    responses={
        200: success(TIMED | DEFINITION_HEADERS, links=links("$request.path.id", "Mesh")),
        304: UNCHANGED_DEFINITION,
        404: error("UnknownSurface"),
        422: error("InvalidQuery"),
        429: error("Busy"),
        500: error("DamagedObject"),
        503: error("Unavailable"),
    },
    openapi_extra={"parameters": [IF_NONE_MATCH]},
)
async def get_surface(id: SurfaceId, request: Request, context: ContextDep) -> Response:
    """Returns the definition of a built-in or a stored surface: a body for the other calls.

    The definition under a hash never changes. The `ETag` is the hash of the content, in quotes.
    """
    services, computation, *_ = context
    refuse_parameters(request.query_params)
    tag = f'"{content_id(id)}"'
    headers = {"ETag": tag, "Cache-Control": FOR_AN_HOUR if id in EXAMPLES else FOR_EVER}
    async with computation.until_deadline():
        condition = condition_of(request) or b""
        is_unchanged = matches_all(condition) or tag.encode() in parse_tags(condition)
        if is_unchanged and await exists(services.store, id):
            return Response(status_code=304, headers=HEADERS | headers)
        computation.check_compute_limit()
        with computation.timing.step("surface"):
            surface = await surface_of(services, computation, id)
        content = await computation.run(plan_definition(surface, services.limits), "definition")
    return bytes_response(content, computation, HEADERS | headers)


@deleting.delete(
    "/v1/surfaces/{id}",
    operation_id="deleteSurface",
    tags=["surfaces"],
    summary="Removes a stored surface",
    status_code=204,
    response_description="The surface is removed.",
    responses={
        404: error("UnknownSurface"),
        405: error("MethodNotAllowed"),
        422: error("InvalidQuery"),
        500: error("InternalError"),
        503: error("StoreFailed"),
    },
)
async def delete_surface(id: StoredId, request: Request, context: ContextDep) -> Response:
    """Removes a stored surface, if the service allows it (`SURFACE_ALLOW_DELETE`).

    Built-in surfaces cannot be removed (405). Other instances with the same store may serve cached
    meshes of the surface for half a minute. Caches that may keep a mesh of the surface for ever
    still have it: the service cannot delete it there. A surface that is stored again has the same
    id.
    """
    refuse_parameters(request.query_params)
    if id in EXAMPLES:
        raise HTTPException(405, headers={"Allow": "GET, HEAD"})
    # `content_id` refuses ids that are no hashes, and returns hashes unchanged.
    if not await context.services.store.delete(content_id(id)):
        raise UnknownSurface(Issue("unknown_surface", "No surface is stored under this id.", "/id"))
    context.services.cache.forget(id)
    return Response(status_code=204, headers=HEADERS)


def _build_summary(example: Example, root: str) -> dict[str, Any]:
    return {
        **_describe_example(example),
        "links": {
            "self": surface_url(root, example.id),
            "mesh": {f.suffix: mesh_url_path(root, example.id, f.suffix) for f in FORMATS},
            "image": picture_url_path(root, example.id),
        },
    }


@cache
def _describe_example(example: Example) -> dict[str, Any]:
    surface = example.surface()
    model, size = surface.lower(), surface.size()
    return {
        "id": example.id,
        "title": example.title,
        "description": example.description,
        "up": surface.up,
        "patches": size.patches + size.face_patches,
        "degree": _degree(model),
    }


def _degree(model: Model) -> list[int]:
    """The highest degrees of the patches along u and v; a sweep has its curve's degree and 0."""
    degrees = [(0, 0)]
    for part in model.models if isinstance(model, GroupModel) else (model,):
        if isinstance(part, SweepModel):
            degrees.append((part.pieces.degree, 0))
            continue
        if isinstance(part, BrepModel):
            degrees += part.surfaces.degrees.tolist()
            continue
        for batch in part.batches:
            along_v, _, along_u, _ = batch.side_degrees  # of the sides u=0, u=1, v=0 and v=1
            degrees.append((along_u, along_v))
    u, v = zip(*degrees, strict=True)
    return [max(u), max(v)]


@signing.post(
    "/v1/sign",
    operation_id="signAddress",
    tags=["surfaces"],
    summary="Signs a URL of a private surface",
    response_model=SignedAddress,
    response_description="The URL.",
    responses={200: success({}), **POST_ERRORS},
    openapi_extra=json_body(REQUESTS["signAddress"]),
)
async def sign_url(body: SignRequest, context: ContextDep) -> Response:
    """Makes a URL that any client may read without a key until it expires.

    It is for services whose surfaces and meshes are not public (`SURFACE_PUBLIC_READS=false`): for
    example, for a viewer on a page. The signature is valid for one path and its parameters, in any
    order, for `GET` and `HEAD`. The service does not check that the surface exists. It signs only
    URLs of its own surfaces and meshes, for at most seven days. Without `SURFACE_SIGNING_KEYS` this
    call does not exist.
    """
    assert context.services.signer is not None  # without keys, the app has no such route
    root = context.request.scope.get("root_path", "")
    url, expires = build_signed_url(context.services.signer, body, root, time.time())
    headers = HEADERS | {"Cache-Control": "no-store"}
    return json_response({"url": url, "expires": expires}, headers=headers)
