"""Routes for meshes of posted surfaces, and for estimates of such meshes."""

from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter, Response

from service.api.body import BodyRoute
from service.api.models.meshes import Estimate, Mesh
from service.api.openapi.parameters import (
    REQUESTS,
    Json,
    format_parameter,
    mesh_options,
    surface_body,
)
from service.api.openapi.responses import (
    CODED,
    MESH_HEADERS,
    POST_ERRORS,
    READING,
    TIMED,
    error,
    show_responses,
    success,
)
from service.api.responses import HEADERS, bytes_response, file_response, reading_headers
from service.api.services import ContextDep
from service.decoders.registry import DECODERS
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, FORMATS
from service.pipeline.estimate import plan_estimate
from service.pipeline.mesh import plan_mesh, render, select_encode_options
from service.schemas.request import MeshRequest

_SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
_RAMP: Json = {
    "type": "patches",
    "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 1], [2, 1, 1]],
    "patches": [[[0, 1], [2, 3]], [[2, 3], [4, 5]]],
    "name": "ramp",
}
_SMALL_MESHES: Json = {
    "MeshOfPatch": {
        "summary": "A patch: row k of the normals belongs to row k of the vertices",
        "value": {"surface": _SQUARE, "resolution": 1},
    },
    "MeshWithCrease": {
        "summary": "Two patches that meet at an angle: `attribute_faces` has indices of normals",
        "value": {"surface": _RAMP, "faces": "quads", "resolution": 1},
    },
}
_MESHES = REQUESTS["createMesh"]


def _vary_mesh_example(name: str, summary: str, **changes: Any) -> Json:
    """An example of a mesh request with another summary and some other fields."""
    return {"summary": summary, "value": _MESHES[name]["value"] | changes}


_ESTIMATES: Json = {
    "patch": _MESHES["patch"],
    "quads": _vary_mesh_example("patches", "Quads, which some formats cannot store"),
    "huge": _vary_mesh_example("patch", "More vertices than the service allows", resolution=60_000),
    "tolerance": _vary_mesh_example("tolerance", "By tolerance: upper bounds"),
    "tube": _vary_mesh_example("tube", "A tube: an upper bound of its vertices"),
}


def _estimate(body: MeshRequest) -> bytes:
    options, encode = body.mesh_options(), select_encode_options(body)
    return plan_estimate(body.to_surface(), options, encode).run()


for operation in ("createMesh", "getSurfaceMesh"):
    show_responses(
        operation,
        _SMALL_MESHES,
        MeshRequest,
        lambda body: render(body.to_surface(), body.mesh_options(), BY_NAME["json"]),
    )
show_responses("estimateMesh", _ESTIMATES, MeshRequest, _estimate)


class MeshRoute(BodyRoute):
    """A route that reads a surface as JSON or as a file, and whose response is in a mesh format."""

    formats = FORMATS
    decoders = DECODERS
    has_surface_files = True


class EstimateRoute(MeshRoute):
    """A route with the bodies and formats of `MeshRoute`, whose response is always JSON."""

    reads_accept = False


meshes = APIRouter(route_class=MeshRoute)
estimates = APIRouter(route_class=EstimateRoute)


@meshes.post(
    "/v1/mesh",
    operation_id="createMesh",
    tags=["meshes"],
    summary="The mesh of a surface",
    response_model=Mesh,
    response_description="The mesh.",
    responses={
        200: success(MESH_HEADERS | READING, FORMATS),
        406: error("NotAcceptable"),
        **POST_ERRORS,
    },
    openapi_extra=surface_body(_MESHES, format_parameter(FORMATS), options=mesh_options()),
)
async def create_mesh(body: MeshRequest, context: ContextDep) -> Response:
    """Evaluates the surface and returns its mesh.

    The response is in the format that `format` names or `Accept` prefers; JSON without either. The
    body is a JSON document with the options in it, or a file with the options in the query: a CAD
    file, of STEP, IGES or 3DM, or a file of control points. `Surface-Reading` says how many faces
    of a CAD file were read.
    """
    services, computation, request, fmt = context
    options, encode = body.mesh_options(), select_encode_options(body)
    work = plan_mesh(body.to_surface(), options, fmt, encode, services.limits)
    mesh_file = await computation.run(work, "mesh")
    request.app.state.counters.count_mesh(mesh_file.report)
    content, report, name = mesh_file.content, mesh_file.report, mesh_file.name
    return file_response(content, fmt, name, computation, report, reading=body.reading)


@estimates.post(
    "/v1/estimate",
    operation_id="estimateMesh",
    tags=["meshes"],
    summary="The size of a mesh, before it is computed",
    response_model=Estimate,
    response_description="The estimate.",
    responses={200: success(TIMED | CODED | READING), **POST_ERRORS},
    openapi_extra=surface_body(
        _ESTIMATES,
        format_parameter(FORMATS, "The format to estimate for; without it, all formats."),
        options=mesh_options(),
    ),
)
async def estimate_mesh(body: MeshRequest, context: ContextDep) -> Response:
    """Reads the body of `POST /v1/mesh` and returns how large the mesh would be.

    The response has the numbers of vertices and faces, the bytes in each format, and whether
    `POST /v1/mesh` would refuse the request. An estimate takes a small part of the time of the
    mesh. An invalid body is an error here too.
    """
    services, computation, _, fmt = context
    formats: Sequence[Format] = FORMATS if fmt is None else (fmt,)
    options, encode = body.mesh_options(), select_encode_options(body)
    work = plan_estimate(body.to_surface(), options, encode, services.limits, formats)
    content = await computation.run(work, "estimate")
    return bytes_response(content, computation, HEADERS | reading_headers(body.reading))
