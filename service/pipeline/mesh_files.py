"""Meshes in files of clients, read in the coordinates of the surface for their comparison."""

from dataclasses import replace

from service.decoders.format import FileLimits
from service.decoders.mesh_axes import undo_root
from service.decoders.mesh_registry import GLTF_NAMES, MESH_BY_NAME
from service.errors import MalformedBody, SurfaceError
from service.pipeline.check import plan_check
from service.pipeline.cost import MEMORY_SHARE, Cost, Work
from service.pipeline.limits import Limits
from service.pipeline.reading import plan_reading
from service.schemas.check import CheckRequest, MeshFile
from service.schemas.document import DocumentLimits
from service.schemas.meshes import MeshDefinition
from service.schemas.validation import validate_document
from service.surface.given_mesh import GivenMesh

IN_DOCUMENT, AS_BODY = "/mesh/file", ""
"""Where the errors of a file point to: a field of a document, or the whole body."""


def plan_given_mesh(
    request: CheckRequest,
    document_limits: DocumentLimits,
    file_limits: FileLimits,
    limits: Limits,
    where: str = IN_DOCUMENT,
) -> Work[GivenMesh]:
    """The work of reading the file of a request as a mesh; a child process reads it.

    Raises
    ------
    TooLarge
        No request may take the memory that a file of this length needs.
    """
    file = request.mesh
    assert isinstance(file, MeshFile)  # other meshes are built with their request
    try:
        decoder = MESH_BY_NAME[file.format]
        reading = plan_reading(decoder, file.file, None, file_limits, limits)
    except SurfaceError as error:
        raise _point_to(where, error) from None

    def read() -> GivenMesh:
        try:
            definition = validate_document(MeshDefinition, reading.run().tree, document_limits)
            mesh = definition.to_mesh(request.quad_diagonal)
            if file.format not in GLTF_NAMES:
                return mesh
            surface = request.to_surface()
            return undo_root(mesh, surface.up, surface.unit)
        except SurfaceError as error:
            raise _point_to(where, error) from None

    return Work(reading.cost, read)


def plan_file_check(request: CheckRequest, reading: Work[GivenMesh], limits: Limits) -> Work[bytes]:
    """The work of reading a mesh and of comparing it with the surface, one after the other.

    How large the mesh is, is not known before: the memory is that of the largest, as for meshes by
    tolerance.
    """
    memory = min(limits.max_memory, reading.cost.memory + limits.max_memory // MEMORY_SHARE)

    def run() -> bytes:
        mesh = reading.run()
        return plan_check(request.to_surface(), mesh, request.to_query(), limits).run()

    return Work(Cost(memory, reading.cost.seconds), run)


def _point_to(where: str, error: SurfaceError) -> SurfaceError:
    """The error with pointers to the whole file: the client has no document of it.

    A file that is damaged is no file of its format.
    """
    is_damaged = any(issue.code == "malformed_file" for issue in error.issues)
    kind = MalformedBody if is_damaged else type(error)
    return kind(*(replace(issue, pointer=where) for issue in error.issues))
