"""Files of meshes for tests: read in this process, and checked as a posted mesh is."""

from service.decoders.format import FileLimits
from service.decoders.mesh_registry import MESH_BY_NAME
from service.errors import SurfaceError
from service.schemas.meshes import MeshDefinition
from service.schemas.validation import validate_document
from service.surface.given_mesh import GivenMesh, QuadDiagonal

LIMITS = FileLimits(max_control_points=10_000)


def read(name: str, content: bytes | str, diagonal: QuadDiagonal = "02") -> GivenMesh:
    """The mesh of a file of this format."""
    content = content.encode(errors="surrogateescape") if isinstance(content, str) else content
    tree = MESH_BY_NAME[name].decode(content, None, LIMITS).tree
    return validate_document(MeshDefinition, tree).to_mesh(diagonal)


def refuse(name: str, content: bytes | str) -> str:
    """The code of the error of a file."""
    try:
        read(name, content)
    except SurfaceError as error:
        return error.issues[0].code
    raise AssertionError("the file was read")
