"""Responses about meshes, as JSON, and the base class of all models of responses.

FastAPI makes the schemas of the OpenAPI document from these models. Routes write long responses
directly from arrays; tests validate these responses against the models.
"""

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema
from pydantic.json_schema import SkipJsonSchema

from service.encoders.registry import FORMATS
from service.schemas.arrays import tuple_schema
from service.surface.channels import MAX_DIMENSION
from service.surface.checks import MAX_METRES_PER_UNIT

_NUMBER: dict[str, Any] = {"type": "number"}
_COLOR_COMPONENT: dict[str, Any] = {"type": "number", "minimum": 0, "maximum": 1}
_OPTIONAL_BOUND = WithJsonSchema({"type": ["number", "null"], "minimum": 0})
_WHOLE_NUMBER: dict[str, Any] = {"type": "integer", "minimum": 0}


def schema_of_names(names: list[str]) -> WithJsonSchema:
    """The schema of a string that is one of some names."""
    return WithJsonSchema({"type": "string", "enum": names})


def schema_of_row(item: dict[str, Any], length: int) -> WithJsonSchema:
    """The schema of a list of `length` items, each with the schema `item`."""
    return WithJsonSchema(tuple_schema(item, length))


def _sizes(phrase: str) -> WithJsonSchema:
    """The schema of an object with a number of bytes by format.

    The description of each number is `phrase` and the name of the format.
    """
    sizes = {f.name: _WHOLE_NUMBER | {"description": f"{phrase} {f.name}."} for f in FORMATS}
    return WithJsonSchema({"type": "object", "properties": sizes, "additionalProperties": False})


class ResponseModel(BaseModel):
    """A response, or a part of one.

    A model is built at its first use: most are only parts of the OpenAPI document, and building all
    of them would take a fifth of the start of a process.
    """

    model_config = ConfigDict(use_attribute_docstrings=True, defer_build=True)


Missing: TypeAlias = SkipJsonSchema[None]
"""The type of the default of a field that may be left out; the field is never null."""

Count: TypeAlias = Annotated[int, Field(ge=0)]
Length: TypeAlias = Annotated[float, Field(ge=0)]
Pair: TypeAlias = Annotated[tuple[float, float], schema_of_row(_NUMBER, 2)]
Vector: TypeAlias = Annotated[tuple[float, float, float], schema_of_row(_NUMBER, 3)]
Rgba: TypeAlias = Annotated[tuple[float, float, float, float], schema_of_row(_COLOR_COMPONENT, 4)]
IntegerPair: TypeAlias = Annotated[tuple[int, int], schema_of_row({"type": "integer"}, 2)]
Segment: TypeAlias = Annotated[tuple[int, int], schema_of_row(_WHOLE_NUMBER, 2)]
Corners: TypeAlias = Annotated[list[Count], Field(min_length=3, max_length=4)]
Continuity: TypeAlias = Literal["C0", "G1", "C1"]
FormatName: TypeAlias = Annotated[str, schema_of_names([f.name for f in FORMATS])]


class Bounds(ResponseModel):
    """Bounding box of the stored vertices."""

    min: Vector
    """Least x, y and z."""
    max: Vector
    """Greatest x, y and z."""


class CurvatureRange(ResponseModel):
    """Least and greatest curvature at the vertices."""

    gaussian: Pair
    """Per square of the model unit."""
    mean: Pair
    """Per model unit."""


class PartReport(ResponseModel):
    """Facts about a part."""

    name: str
    """Name of the part, of the face of a brep, or of the member of a group."""
    deviation_bound: Length | Missing = None
    """The `deviation_bound` of the part alone; left out for tubes and ribbons, and for faces that
    have no triangles."""


class CollapsedEdges(ResponseModel):
    """Edges of a brep that became one vertex."""

    count: Count
    """Their number."""
    longest_chain: Length
    """The greatest length of connected edges that became one vertex, in model units."""


class SkippedFace(ResponseModel):
    """A face of a brep that was left out: it is invalid, or becomes so at this tolerance."""

    face: Count
    """Number of the face in the brep."""
    code: str
    """The code of the error that would refuse the brep."""
    got: str
    """A description of the face, with figures."""
    needed: str
    """A description of a valid face."""


class MeshReport(ResponseModel):
    """Facts about a mesh."""

    vertices: Count
    """Number of positions: a position with several normals counts once."""
    triangles: Count
    """Number of triangles."""
    quads: Count
    """Number of quads."""
    patches: Count
    """Number of Bézier patches; tubes and ribbons have none. For breps those of all faces."""
    bounds: Bounds
    watertight: bool
    """Whether every edge belongs to exactly two faces."""
    boundary_edges: Count
    """Edges that belong to only one face."""
    poles_repaired: Count
    """Samples where du × dv vanishes, so that the normal is a limit."""
    closed_u: bool | Missing = None
    """Whether the surface closes along u: its curves at the least and the greatest u are the same.
    This and the next three fields are only for a surface with one rectangular domain of (u, v)."""
    closed_v: bool | Missing = None
    """Whether the surface closes along v: its curves at the least and greatest v are the same."""
    continuity_u: Continuity | Missing = None
    """If the surface closes along u, its continuity there: C1 for equal partials du, G1 for equal
    tangent planes, else C0."""
    continuity_v: Continuity | Missing = None
    """If the surface closes along v, its continuity there: as `continuity_u`, with dv."""
    deviation_bound: Length | Missing = None
    """Proved, in model units: no point of the surface is further than this from the faces, with the
    coordinates that the file has after rounding. Never above the tolerance of the request, except
    for breps whose edges are further than that from their faces (`reached`). For breps it holds for
    faces and for edges. Left out if the mesh has no faces, or only faces of tubes and ribbons."""
    mesh_deviation_bound: Annotated[Length | None, _OPTIONAL_BOUND] = None
    """With `two_sided`; proved: no point of the faces is further than this from the surface. Null
    for a brep without such a bound; `mesh_deviation_reason` says why."""
    mesh_deviation_reason: str | Missing = Field(
        default=None, examples=["The part is too thin for this tolerance."]
    )
    """Why `mesh_deviation_bound` is null."""
    reached: bool | Missing = Field(default=None, examples=[True])
    """Whether `deviation_bound` is at most the tolerance. This and the next fields are only for
    breps, and groups with breps: sums and greatest values over all of them."""
    gap_bound: Length | Missing = Field(default=None, examples=[1.5e-7])
    """Proved, in model units: no point of an edge is further than this from the point of its
    parameter curve at the same parameter, on the surface of the face."""
    pcurves_replaced: Count | Missing = Field(default=None, examples=[2])
    """Number of given parameter curves that were made anew, because they were too far from their
    edges."""
    complete: bool | Missing = Field(default=None, examples=[True])
    """Whether all faces have triangles: none is in `skipped_faces`, and none is degenerate."""
    non_manifold_edges: Count | Missing = Field(default=None, examples=[0])
    """Number of edges with more than two coedges in one shell that could not be put in pairs."""
    double_edges: Count | Missing = Field(default=None, examples=[0])
    """Number of pairs of vertices that more than two triangles join; those along
    `non_manifold_edges` do not count."""
    degenerate_faces: Count | Missing = Field(default=None, examples=[0])
    """Number of faces without triangles that are not in `skipped_faces`: they are too narrow for
    the tolerance. `reached` is false unless all their edges are in the mesh."""
    collapsed_edges: CollapsedEdges | Missing = Field(
        default=None, examples=[{"count": 1, "longest_chain": 2e-7}]
    )
    """Edges that became one vertex, because they are shorter than their uncertainty."""
    skipped_faces: list[SkippedFace] | Missing = Field(
        default=None,
        examples=[
            [
                {
                    "face": 3,
                    "code": "edge_not_on_surface",
                    "got": "an edge 2.5 from the surface",
                    "needed": "at most 1/10 of the diagonal of the face",
                }
            ]
        ],
    )
    """Invalid faces that were left out, with `"invalid_faces": "skip"`."""
    normal_angle: Length | Missing = None
    """With `angle_tolerance`: the largest measured angle, in radians, between the normals at the
    two ends of an edge."""
    curvature: CurvatureRange | Missing = None
    """With `curvatures`: the least and greatest curvatures at the vertices."""
    merged_knots: Count | Missing = None
    """Number of knots that differed from the knot before only by rounding, and were made equal to
    that knot; left out if it is 0."""
    moved: Length | Missing = None
    """The largest distance, in model units, by which a point of the surface was moved to join
    control points (`weld_tolerance`). All bounds include this distance; left out if it is 0."""
    turned: list[Count] | Missing = Field(default=None, examples=[[2]])
    """With `orient`: the numbers of the patches that were turned, as `POST /v1/points` counts them
    (`patch`); of a B-spline in a group its first. At most the first 10,000."""
    not_orientable: list[Count] | Missing = Field(default=None, examples=[[]])
    """With `orient`: the numbers of the patches of surfaces without a consistent orientation, such
    as a Möbius strip, which were not turned. At most the first 10,000."""
    metres_per_unit: Annotated[float, Field(gt=0, le=MAX_METRES_PER_UNIT)] | Missing = None
    """The unit of all lengths in metres, if the surface has a `metres_per_unit`."""
    parts: list[PartReport] | Missing = None
    """The bound of each part, in the order of the parts; left out if no part has a bound, and for
    breps of more than 10,000 faces. The parts of a brep are its faces."""
    engine: int
    """Version of the numbers. It changes when the service computes other numbers for the same
    request."""


class MeshPart(ResponseModel):
    """A named part of the surface, and its range of faces."""

    name: str
    """Name of the part."""
    faces: IntegerPair
    """Index of the first face, and index after the last face."""
    color: Rgba | Missing = None
    """Base colour [r, g, b, a], sRGB, if the part has one."""


class MeshLines(ResponseModel):
    """Lines beside the faces: an overlay of the request."""

    name: str
    """Name of the overlay."""
    vertices: list[Vector]
    """Positions of the overlay."""
    segments: list[Segment]
    """Each line segment as a pair of indices of these `vertices`."""


class Mesh(ResponseModel):
    """A mesh as JSON."""

    vertices: list[Vector]
    """Positions [x, y, z]; a welded vertex is one row. Float64, with the fewest digits that give
    the same number."""
    faces: list[Corners]
    """For each corner of each face an index of `vertices`, counter-clockwise seen from the normal's
    tip. Faces are sorted by part; the quads of a part are before its triangles."""
    normals: list[Vector] | Missing = None
    """Unit normals, float32; left out if `normals` is false. Row k belongs to row k of `vertices`,
    unless the mesh has `attribute_faces`."""
    uvs: list[Pair] | Missing = None
    """Texture coordinates of the surface; if it has none and `uvs` is true, its parameters (u, v).
    Float64, exact enough to evaluate the surface at the vertex again. Row k belongs to row k of
    `normals`."""
    colors: list[Annotated[list[float], Field(min_length=3, max_length=4)]] | Missing = None
    """Colours of the surface, if it has any: sRGB, or sRGB and opacity, from 0 to 1; float32. Row k
    belongs to row k of `normals`."""
    attributes: (
        dict[str, list[Annotated[list[float], Field(min_length=1, max_length=MAX_DIMENSION)]]]
        | Missing
    ) = None
    """Values of the surface's attributes by name, float64. Row k belongs to row k of `normals`."""
    attribute_faces: list[Corners] | Missing = None
    """If a position has several normals, colours or other values, as at a crease: for each corner
    of each face, in the shape of `faces`, an index of `normals`, `uvs`, `colors` and
    `attributes`."""
    parts: list[MeshPart]
    """The parts, each with its range of `faces`; those of a brep are its faces. Empty for breps of
    more than 10,000 faces."""
    lines: list[MeshLines] | Missing = None
    """The overlays of the request, if any."""
    report: MeshReport


class Refusal(ResponseModel):
    """A reason for which `POST /v1/mesh` would refuse the request."""

    formats: Annotated[list[FormatName], Field(min_length=1)]
    """The formats that would be refused."""
    code: str
    """The code of the error that `POST /v1/mesh` would return."""
    pointer: str
    """JSON pointer (RFC 6901) into the body."""
    detail: str
    """Text of the error, for people."""
    got: str
    """A description of the input, which does not repeat it."""
    needed: str
    """A description of valid input."""


class Estimate(ResponseModel):
    """The size of a mesh before it is computed."""

    vertices: Count
    """Number of positions, as in the report: a position with several normals counts once."""
    triangles: Count
    """Number of triangles."""
    quads: Count
    """Number of quads."""
    exact: bool
    """Whether these three numbers will be exactly those of the report. If not, they are upper
    bounds: for a tolerance (usually 10 times the numbers of the report) or a budget, for tubes and
    ribbons, for wires with faces, and for a mesh with too many vertices."""
    bytes: Annotated[dict[str, int], _sizes("Bytes as")]
    """Bytes of the response in every format that can store the mesh: upper bounds, except for
    `exact_bytes`. Numbers in text count with their largest length."""
    exact_bytes: list[FormatName]
    """The formats whose number of bytes is exact."""
    memory: Annotated[dict[str, int], _sizes("Bytes of memory for the mesh as")]
    """The most memory that the work takes, in bytes, by format. The service refuses a request that
    needs more memory than one request may take (`too_much_memory`); a large request may have to
    wait."""
    accepted: bool
    """Whether `POST /v1/mesh` would return a mesh for this body in one of the formats."""
    certain: bool
    """Whether `POST /v1/mesh` is certain to do what `accepted` says. With a tolerance it is certain
    if the bounds above are within all limits. If they are not, or with a budget, the computation
    may show that the mesh is too large, or the tolerance too small."""
    refused: list[Refusal]
    """The reasons for refusals, by format."""
