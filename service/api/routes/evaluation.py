"""Routes for points of surfaces, conversions of surfaces, and curves."""

from fastapi import APIRouter, Response

from service.api.body import BodyRoute
from service.api.models.points import Curve, Points
from service.api.models.surfaces import SurfaceDocument
from service.api.openapi.parameters import (
    OPERATIONS_PARAMETER,
    REQUESTS,
    Json,
    format_parameter,
    json_body,
    surface_body,
)
from service.api.openapi.responses import (
    FILE_HEADERS,
    POST_ERRORS,
    READING,
    WRITTEN_HEADERS,
    error,
    show_responses,
    success,
)
from service.api.responses import HEADERS, bytes_response, file_response, reading_headers
from service.api.services import ContextDep
from service.decoders.registry import DECODERS
from service.encoders.cad.format import DefinitionFormat
from service.encoders.cad.registry import CONVERSION_FORMATS
from service.encoders.polylines.registry import CURVE_FORMATS, CURVES_BY_NAME
from service.pipeline.cad_files import plan_cad_file
from service.pipeline.documents import plan_conversion
from service.pipeline.polylines import plan_curve
from service.pipeline.queries import plan_points
from service.schemas.convert import ConvertRequest
from service.schemas.curves import CurveRequest
from service.schemas.queries import PointsRequest
from service.surface.convert.nets import SizeLimits


class ConversionRoute(BodyRoute):
    """A route that reads a surface as JSON or as a file, and writes JSON or a CAD file."""

    decoders, has_surface_files = DECODERS, True
    formats = CONVERSION_FORMATS


class CurveRoute(BodyRoute):
    """A route whose response is in a format for curves."""

    formats = CURVE_FORMATS


_POINTS, _CONVERSIONS, _CURVES = (
    REQUESTS[operation] for operation in ("queryPoints", "convertSurface", "createCurve")
)


def _select_examples(examples: Json, *names: str) -> Json:
    return {name: examples[name] for name in names}


show_responses(
    "queryPoints",
    _select_examples(_POINTS, "patch"),
    PointsRequest,
    lambda body: plan_points(body.to_surface(), body.to_query()).run(),
)
show_responses(
    "convertSurface",
    _CONVERSIONS,
    ConvertRequest,
    lambda body: plan_conversion(body.to_surface(), body.to_operations(), SizeLimits()).run(),
)
show_responses(
    "createCurve",
    _select_examples(_CURVES, "quarter", "parameters"),
    CurveRequest,
    lambda body: plan_curve(body.to_curve(), body.curve_options(), CURVES_BY_NAME["json"]).run(),
)

points = APIRouter(route_class=BodyRoute)
conversions = APIRouter(route_class=ConversionRoute)
curves = APIRouter(route_class=CurveRoute)


@points.post(
    "/v1/points",
    operation_id="queryPoints",
    tags=["points"],
    summary="Points of a surface, with derivatives and curvatures",
    response_model=Points,
    response_description="The points.",
    responses={200: success(), **POST_ERRORS},
    openapi_extra=json_body(_POINTS),
)
async def query_points(body: PointsRequest, context: ContextDep) -> Response:
    """Evaluates the surface at the given parameters, in float64, and returns columns.

    Row k of each column belongs to row k of `uv` or `barycentric`. Partial derivatives are with
    respect to the surface's own parameters; at a knot they are the limits from the right. The
    parameters on a brep are those of the surface of a face, which `patch` names, and `inside` says
    whether the point is inside the trims of this face. In a group, `patch` counts the faces and
    Bézier patches of all members; points, derivatives and curvatures are those of the placed
    surfaces. Exact tubes have the patches that `/v1/project` names; ribbons, and other tubes, have
    none (`not_parametric`).
    """
    services, computation, *_ = context
    work = plan_points(body.to_surface(), body.to_query(), services.limits)
    return bytes_response(await computation.run(work, "points"), computation)


@conversions.post(
    "/v1/convert",
    operation_id="convertSurface",
    tags=["surfaces"],
    summary="A surface in another form, with the same points",
    response_model=SurfaceDocument,
    response_description="The surface.",
    responses={
        200: success(WRITTEN_HEADERS | READING, CONVERSION_FORMATS),
        406: error("NotAcceptable"),
        **POST_ERRORS,
    },
    openapi_extra=surface_body(
        _CONVERSIONS, format_parameter(CONVERSION_FORMATS), options=[OPERATIONS_PARAMETER]
    ),
)
async def convert_surface(body: ConvertRequest, context: ContextDep) -> Response:
    """Applies the operations in their order and returns the converted surface.

    The operations may be left out: a CAD file, sent as the body, then becomes JSON, with the report
    of reading it (`reading`). Of several patches or members, operations change all, or the one that
    `patch` names. The response is in the format that `format` names or `Accept`
    prefers; JSON without either. JSON is a body for the other calls. Corner points keep their
    digits, and patches that shared an edge still share it. Colours, texture coordinates and
    attributes are converted too.

    STEP and IGES have the surface as it is defined, not its mesh: faces with their edges, names,
    colours of faces and of members, instances and units. Borders that are equal become one edge.
    VTU has Bézier cells, and no breps. Tubes and ribbons are not written in these formats.
    """
    services, computation, _, fmt = context
    settings = services.settings
    size_limits = SizeLimits(settings.max_control_points, settings.max_degree)
    operations, limits = body.to_operations(), services.limits
    surface, reading = body.to_surface(), body.reading
    if isinstance(fmt, DefinitionFormat):
        file = await computation.run(
            plan_cad_file(surface, operations, size_limits, fmt, limits), "convert"
        )
        return file_response(
            file.content, fmt, surface.name, computation, reading=reading, writing=file.report
        )
    work = plan_conversion(surface, operations, size_limits, limits, reading)
    content = await computation.run(work, "convert")
    return bytes_response(content, computation, HEADERS | reading_headers(reading))


@curves.post(
    "/v1/curve",
    operation_id="createCurve",
    tags=["curves"],
    summary="A curve as points, tangents and lengths, or as lines",
    response_model=Curve,
    response_description="The curve.",
    responses={
        200: success(FILE_HEADERS, CURVE_FORMATS),
        406: error("NotAcceptable"),
        **POST_ERRORS,
    },
    openapi_extra=json_body(_CURVES, format_parameter(CURVE_FORMATS)),
)
async def create_curve(body: CurveRequest, context: ContextDep) -> Response:
    """Samples the curve, evenly, within a tolerance, or at parameters of your choice.

    Row k of each column belongs to point k. Derivatives are with respect to the parameter of the
    curve.

    The response is in the format that `format` names or `Accept` prefers; JSON without either. In
    glTF, OOGL and OBJ a plane curve has z = 0; these formats have no derivatives.
    """
    services, computation, _, fmt = context
    work = plan_curve(body.to_curve(), body.curve_options(), fmt, services.limits)
    content = await computation.run(work, "curve")
    return file_response(content, fmt, body.to_curve().name, computation)
