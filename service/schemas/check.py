"""The JSON language of checks: a surface, and a mesh of it that anyone has made."""

from base64 import b64decode
from binascii import Error as NoBase64
from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema

from service.engine.mesh_checks.query import (
    MAX_RELATIVE_TOLERANCE,
    MIN_RELATIVE_TOLERANCE,
    RELATIVE_TOLERANCE,
    CheckQuery,
)
from service.errors import InvalidRequest, Issue
from service.schemas.fields import StrictModel
from service.schemas.meshes import MeshDefinition
from service.schemas.request import SurfaceRequest
from service.schemas.validation import to_invalid, wrong_type
from service.surface.given_mesh import GivenMesh, QuadDiagonal
from service.surface.kinds import Surface

MeshFormat: TypeAlias = Literal["glb", "gltf", "obj", "ply", "stl", "off"]
"""The names of the formats of files with meshes."""


def _decode_file(value: object) -> bytes:
    """The bytes of a file that a document has as base64, and a request with a file as they are."""
    if isinstance(value, bytes):
        return value
    if not isinstance(value, str):
        raise to_invalid(wrong_type(value, "a string"))
    try:
        return b64decode(value, validate=True)
    except (NoBase64, ValueError):
        message, got = "This is not a file in base64.", "other characters, or too few"
        issue = Issue("wrong_value", message, got=got, needed="base64 (RFC 4648, section 4)")
        raise to_invalid(issue) from None


class MeshFile(StrictModel):
    """A file with a mesh, inside a document."""

    file: Annotated[
        bytes,
        BeforeValidator(_decode_file),
        WithJsonSchema({"type": "string", "contentEncoding": "base64"}),
    ] = Field(
        description="The bytes of the file, in base64 (RFC 4648, section 4).",
        examples=["T0ZGCjMgMSAwCjAgMCAwCjEgMCAwCjAgMSAwCjMgMCAxIDIK"],
    )
    format: MeshFormat = Field(description="The format of the file.", examples=["off"])


def _choose_form(value: object) -> str:
    """The form of a mesh: a file, or vertices and faces, which have no field `file`."""
    is_file = isinstance(value, dict) and "file" in value and "faces" not in value
    return "file" if is_file else "mesh"


MeshSource: TypeAlias = Annotated[
    Annotated[MeshDefinition, Tag("mesh")] | Annotated[MeshFile, Tag("file")],
    Discriminator(_choose_form),
]


class CheckFields(StrictModel):
    """How a mesh is judged. All fields have defaults."""

    quad_diagonal: QuadDiagonal = Field(
        default="02",
        description="How a face of four corners 0, 1, 2, 3 becomes two triangles: by the diagonal "
        "between the corners 0 and 2, or 1 and 3.",
        examples=["13"],
    )
    relative_tolerance: Annotated[
        float, Field(ge=MIN_RELATIVE_TOLERANCE, le=MAX_RELATIVE_TOLERANCE)
    ] = Field(
        default=RELATIVE_TOLERANCE,
        description="The largest width of each of the two intervals, as a share of its `high`. "
        "Where that takes more work than one request may take, the interval is wider, and "
        "`reached` is false.",
        examples=[0.02],
    )
    distances: bool = Field(
        default=False,
        description="Whether the response has the mesh as it was read, and the distances of its "
        "vertices and of the middles of its triangles from the surface, as colours need them.",
        examples=[True],
    )

    def to_query(self) -> CheckQuery:
        """How exactly the mesh is judged, for the engine."""
        return CheckQuery(self.relative_tolerance, self.distances)


class CheckRequest(SurfaceRequest, CheckFields):
    """A surface, and a mesh that is compared with it."""

    mesh: MeshSource = Field(
        description="The mesh, in the coordinates of the surface: its vertices and faces, or a "
        "file. Who made it, and how, does not matter."
    )

    def to_mesh(self) -> GivenMesh | None:
        """The mesh as a value; the first call builds it. None for a file, which is not read here.

        Raises
        ------
        InvalidRequest
            With pointers into the whole request.
        """
        if isinstance(self.mesh, MeshFile):
            return None
        mesh: GivenMesh | None = self.__dict__.get("_mesh")
        if mesh is None:
            try:
                mesh = self.__dict__["_mesh"] = self.mesh.to_mesh(self.quad_diagonal)
            except InvalidRequest as error:
                raise error.within("/mesh") from None
        return mesh

    def build(self) -> Surface:
        """Build the surface, and the mesh if it is no file; raises `InvalidRequest`."""
        self.to_mesh()
        return self.to_surface()
