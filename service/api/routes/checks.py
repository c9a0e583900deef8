"""The route that judges meshes: how far anyone's mesh and its surface are apart."""

from fastapi import APIRouter, Response

from service.api.mesh_route import MeshRoute
from service.api.models.checks import MeshCheck
from service.api.openapi.parameters import REQUESTS, mesh_body
from service.api.openapi.responses import POST_ERRORS, error, show_responses, success
from service.api.responses import bytes_response
from service.api.services import ContextDep
from service.decoders.mesh_registry import MESH_DECODERS
from service.pipeline.calls import CALLS, JSON, CallLimits
from service.pipeline.check import plan_check
from service.pipeline.mesh_files import AS_BODY, IN_DOCUMENT, plan_given_mesh
from service.schemas.check import CheckFields, CheckRequest
from service.settings.limits import file_limits
from service.surface.given_mesh import GivenMesh

MESH_BYTES = 120
"""Bytes of memory of a mesh that was read, for each vertex and each triangle."""

checks = APIRouter(route_class=MeshRoute)

_CHECKS = REQUESTS["checkMesh"]


_SHOWN = {name: example for name, example in _CHECKS.items() if name != "file"}
"""Those whose response the document has: to read a file, it would start a process."""

show_responses(
    "checkMesh",
    _SHOWN,
    CheckRequest,
    lambda body: bytes(CALLS["/v1/check"].plan(body, JSON, CallLimits()).run().content),
)


@checks.post(
    "/v1/check",
    operation_id="checkMesh",
    tags=["queries"],
    summary="How far anyone's mesh is from its surface, with proved intervals",
    response_model=MeshCheck,
    response_description="The intervals, and the faults of the mesh.",
    responses={200: success(), 404: error("UnknownSurface"), **POST_ERRORS},
    openapi_extra=mesh_body(_CHECKS, CheckFields, MESH_DECODERS),
)
async def check_mesh(body: CheckRequest, context: ContextDep) -> Response:
    """Compares a mesh of any program with a surface of any kind.

    One interval provably contains the largest distance from a point of the surface to the mesh, the
    other the largest distance from a point of the mesh to the surface; both with the place where
    that is. Then the faults of the mesh itself are counted.

    The mesh is in the coordinates of the surface. It may be a file: as the body, when the query
    names a built-in or a stored surface and has the options; or inside the JSON document. The nodes
    of a glTF file are applied; what its root does to surfaces with `up: z` or with
    `metres_per_unit` is undone. No other units are converted.
    """
    services, computation, request, _ = context
    mesh = body.to_mesh()
    if mesh is None:
        where = AS_BODY if "surface" in request.query_params else IN_DOCUMENT
        reading = plan_given_mesh(
            body,
            services.document_limits,
            file_limits(services.settings),
            services.limits,
            where,
        )
        mesh = await computation.run(reading, "decode")
        computation.drop_work()
        computation.hold_body(computation.body_memory + _count_bytes(mesh))
    work = plan_check(body.to_surface(), mesh, body.to_query(), services.limits)
    return bytes_response(await computation.run(work, "check"), computation)


def _count_bytes(mesh: GivenMesh) -> int:
    return MESH_BYTES * (len(mesh.positions) + len(mesh.triangles))
