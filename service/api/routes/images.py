"""Routes for pictures: of posted surfaces, and by URL."""

from functools import partial
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response

from service.api.body import BodyRoute
from service.api.by_url import UrlRequest, answer_by_url
from service.api.caching.cached_response import RawHeaders, Subject
from service.api.computation import Computation
from service.api.negotiation import check_engine, codings_of, condition_of
from service.api.openapi.parameters import (
    ACCEPT_ENCODING,
    IF_NONE_MATCH,
    REQUESTS,
    SurfaceId,
    picture_options,
    picture_parameters,
    surface_body,
)
from service.api.openapi.responses import (
    FILE_HEADERS,
    IMAGE_HEADERS,
    POST_ERRORS,
    READING,
    UNCHANGED_IMAGE,
    error,
    success,
)
from service.api.responses import disposition, file_response
from service.api.services import ContextDep, Services
from service.api.stored import content_id, picture_url
from service.decoders.registry import DECODERS
from service.encoders.libraries import describe_platform
from service.encoders.png import PNG, WRITER
from service.pipeline.picture import plan_picture
from service.schemas.pictures import PictureRequest
from service.schemas.query import canonical_query, parse_picture_query
from service.surface.kinds import Surface


class ImageRoute(BodyRoute):
    """A route that reads a surface as JSON or as a file, and whose response is a picture."""

    decoders = DECODERS
    has_surface_files = True
    reads_accept = False


images, by_url = APIRouter(route_class=ImageRoute), APIRouter()


@images.post(
    "/v1/image",
    operation_id="createImage",
    tags=["pictures"],
    summary="A picture of a surface",
    response_class=Response,
    response_description="The picture.",
    responses={200: success(FILE_HEADERS | READING, (PNG,)), **POST_ERRORS},
    openapi_extra=surface_body(REQUESTS["createImage"], options=picture_options()),
)
async def create_image(body: PictureRequest, context: ContextDep) -> Response:
    """Draws a surface as PNG: no point of it is further than 0.25 pixels from where it is.

    The body is that of `POST /v1/mesh`, with the options of a picture in place of those of a mesh.
    Normals, colours and curvatures are those of the surface at the places of the pixels.
    """
    services, computation, *_ = context
    surface = body.to_surface()
    content = await computation.run(
        plan_picture(surface, body.picture_options(), services.limits), "image"
    )
    return file_response(content, PNG, surface.name, computation, reading=body.reading)


@by_url.get(
    "/v1/surfaces/{id}/image.png",
    operation_id="getSurfaceImage",
    tags=["pictures"],
    summary="The picture of a surface, by URL",
    response_class=Response,
    response_description="The picture.",
    responses={
        200: success(IMAGE_HEADERS, (PNG,)),
        304: UNCHANGED_IMAGE,
        404: error("UnknownSurface"),
        406: error("CodingNotAcceptable"),
        410: error("EngineGone"),
        422: error("InvalidQuery"),
        429: error("Busy"),
        500: error("DamagedObject"),
        503: error("Unavailable"),
    },
    openapi_extra={"parameters": [*picture_parameters(), IF_NONE_MATCH, ACCEPT_ENCODING]},
)
async def get_surface_image(id: SurfaceId, request: Request, context: ContextDep) -> Response:
    """Returns a picture by URL, as `GET /v1/surfaces/{id}/mesh.{suffix}` returns a mesh.

    The picture depends only on the parts of the URL. Caches may keep it for ever under its
    canonical form, which `Link` names, if the id is a hash.
    """
    fields = parse_picture_query(request.query_params.multi_items())
    check_engine(fields.engine)
    query = canonical_query(fields)
    content_hash = content_id(id)
    subject = Subject(
        url=picture_url(request.scope.get("root_path", ""), id, query),
        surface=id,
        content_name=f"{content_hash} {PNG.suffix} {query} {WRITER} {describe_platform()}",
        is_permanent=id == content_hash,
    )
    # A picture is compressed already.
    accepted = codings_of(request)
    asked = UrlRequest(
        subject,
        ("identity",) if "identity" in accepted else accepted,
        condition_of(request),
        has_engine=fields.engine is not None,
    )
    make = partial(_make, context.services, subject, query=query)
    return await answer_by_url(request, context, asked, make)


async def _make(
    services: Services, subject: Subject, surface: Surface, computation: Computation, *, query: str
) -> tuple[bytes, RawHeaders]:
    """The picture of the canonical query, and its headers."""
    options = parse_picture_query(parse_qsl(query)).picture_options()
    content = await computation.run(plan_picture(surface, options, services.limits), "image")
    computation.finish_work(len(content))
    name = surface.name if subject.is_permanent else subject.surface
    return content, (
        (b"content-type", PNG.media_type.encode()),
        (b"content-disposition", disposition("inline", name, PNG.suffix).encode()),
    )
