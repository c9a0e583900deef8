"""Surfaces with an address: stored under the hash of their content, given back, and deleted."""

from functools import partial

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended, visiting
from service.api.answers import HEADERS, ChunkedResponse, json_response
from service.api.caching.entries import FOR_AN_HOUR, FOR_EVER
from service.api.caching.requested import condition_of
from service.api.caching.tags import is_any, listed
from service.api.catalogue import list_surfaces
from service.api.links import mesh_links, surface_address
from service.api.parameters import no_parameters
from service.api.posted import Posting, posting
from service.api.stored import content_id, exists, forget, surface_of
from service.api.timing import Timing
from service.api.work import Task, done, pace_of, parsed
from service.encoders.format import Format
from service.errors import Issue, UnknownSurface
from service.pipeline.definition import DefinitionWork, plan_definition
from service.schemas.canonical import canonical, surface_id
from service.schemas.request import SurfaceRequest
from service.settings.values import Settings, document_limits, result_limits
from service.storage.store import SurfaceStore
from service.surface.examples import EXAMPLES


async def collection(request: Request) -> Response:
    """`/v1/surfaces`: GET lists the examples, POST stores a surface."""
    if request.method == "POST":
        return await post_surface(request)
    return await list_surfaces(request)


async def item(request: Request) -> Response:
    """`/v1/surfaces/{id}`: GET gives the definition back, DELETE removes it."""
    if request.method == "DELETE":
        return await delete_surface(request)
    return await get_surface(request)


async def post_surface(request: Request) -> Response:
    """Stores the surface in the body: 201 if it is new, 200 if it was there already."""
    settings: Settings = request.app.state.settings
    store: SurfaceStore = request.app.state.store
    posted: Posting[Format] = posting(request)
    timing = Timing()
    with timing.step("read"):
        body = await posted.read(request, settings)
    async with attended(request):
        name = partial(_named, posted, body, settings)
        id, content = await parsed(name, timing, is_long=posted.is_long(body))
        del body, name  # half of the memory of a large request
        visiting().rest()
        with timing.step("store"):
            is_new = await store.put(id, content)
    root = request.scope.get("root_path", "")
    address = surface_address(root, id)
    links = {"self": address, "mesh": mesh_links(root, id)}
    headers = HEADERS | {"Location": address, "Server-Timing": str(timing)}
    return json_response({"id": id, "links": links}, 201 if is_new else 200, headers)


async def get_surface(request: Request) -> Response:
    """The definition, as a body for POST /v1/mesh."""
    settings: Settings = request.app.state.settings
    no_parameters(request.query_params)
    id = request.path_params["id"]
    tag = f'"{content_id(id)}"'
    headers = {"ETag": tag, "Cache-Control": FOR_AN_HOUR if id in EXAMPLES else FOR_EVER}
    async with attended(request):
        if _has(request, tag) and await exists(request, id):
            return Response(status_code=304, headers=HEADERS | headers)
        timing = Timing()
        with timing.step("surface"):
            stored = await surface_of(request, id)
        plan = partial(plan_definition, stored.surface, result_limits(settings))
        task = Task("definition", plan, 0, pace_of, stored.is_long)
        _, content = await done(task, DefinitionWork.run, len, timing)
    headers |= {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, HEADERS | headers, "application/json")


async def delete_surface(request: Request) -> Response:
    """Removes a stored surface, and what is kept of its meshes.

    Comes here only where the settings allow it. Examples stay.
    """
    store: SurfaceStore = request.app.state.store
    no_parameters(request.query_params)
    id = request.path_params["id"]
    if id in EXAMPLES:
        raise HTTPException(405, headers={"Allow": "GET, HEAD"})
    if not await store.delete(content_id(id)):
        issue = Issue("unknown_surface", "No surface is kept under this id.", "/id")
        raise UnknownSurface(issue)
    forget(request, id)
    return Response(status_code=204, headers=HEADERS)


def _named(posted: Posting[Format], body: bytes, settings: Settings) -> tuple[str, bytes]:
    """The id and the content of the surface in a body."""
    wanted = posted.request(SurfaceRequest, body, document_limits(settings))
    content = canonical(wanted.to_surface())
    return surface_id(content), content


def _has(request: Request, tag: str) -> bool:
    """Whether the client has the answer of this tag already."""
    condition = condition_of(request) or b""
    return is_any(condition) or tag.encode() in listed(condition)
