"""Answers as JSON: the models behind the schemas of the OpenAPI document.

Routes write long answers from arrays, without them; tests validate the answers against them.
"""

from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema
from pydantic.json_schema import SkipJsonSchema

from service.api.problems import INTERNAL_ERROR, METHOD_NOT_ALLOWED, NOT_FOUND, PROBLEMS
from service.encoders.format import Compression as AnyCompression
from service.encoders.registry import FORMATS
from service.errors import MAX_ISSUES
from service.schemas.arrays import tuple_schema
from service.schemas.surfaces import SurfaceDefinition
from service.surface.channels import MAX_DIMENSION

_NUMBER: dict[str, Any] = {"type": "number"}
_OR_NULL: dict[str, Any] = {"type": ["number", "null"]}
_SHARE: dict[str, Any] = {"type": "number", "minimum": 0, "maximum": 1}
_ROW: dict[str, Any] = {"type": "integer", "minimum": 0}


def _names(names: list[str]) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "enum": names})


def _row(item: dict[str, Any], length: int) -> WithJsonSchema:
    return WithJsonSchema(tuple_schema(item, length))


def _sizes(what: str) -> WithJsonSchema:
    """The schema of an object with a number of bytes for each format."""
    each = {f.name: _ROW | {"description": f"{what} {f.name}."} for f in FORMATS}
    return WithJsonSchema({"type": "object", "properties": each, "additionalProperties": False})


class Answer(BaseModel):
    """An answer, or a part of one."""

    model_config = ConfigDict(use_attribute_docstrings=True)


Missing: TypeAlias = SkipJsonSchema[None]
"""The value of a field that may be left out, but is never null."""

Count: TypeAlias = Annotated[int, Field(ge=0)]
Length: TypeAlias = Annotated[float, Field(ge=0)]
Pair: TypeAlias = Annotated[tuple[float, float], _row(_NUMBER, 2)]
Vector: TypeAlias = Annotated[tuple[float, float, float], _row(_NUMBER, 3)]
PairOrNull: TypeAlias = Annotated[tuple[float | None, float | None], _row(_OR_NULL, 2)]
VectorOrNull: TypeAlias = Annotated[
    tuple[float | None, float | None, float | None], _row(_OR_NULL, 3)
]
Point: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=3)]
Rgba: TypeAlias = Annotated[tuple[float, float, float, float], _row(_SHARE, 4)]
Run: TypeAlias = Annotated[tuple[int, int], _row({"type": "integer"}, 2)]
Segment: TypeAlias = Annotated[tuple[int, int], _row(_ROW, 2)]
Corners: TypeAlias = Annotated[list[Count], Field(min_length=3, max_length=4)]
Continuity: TypeAlias = Literal["C0", "G1", "C1"]
State: TypeAlias = Literal["ready", "unavailable"]
FormatName: TypeAlias = Annotated[str, _names([f.name for f in FORMATS])]
Compression: TypeAlias = Annotated[
    str, _names([kind for kind in get_args(AnyCompression) if kind != "none"])
]
_PROBLEMS = (*PROBLEMS.values(), NOT_FOUND, METHOD_NOT_ALLOWED, INTERNAL_ERROR)
ProblemCode: TypeAlias = Annotated[str, _names(sorted({problem.code for problem in _PROBLEMS}))]

_ADDRESSES: dict[str, Any] = {
    "type": "object",
    "properties": {f.suffix: {"type": "string", "description": f"{f.title}."} for f in FORMATS},
    "required": [f.suffix for f in FORMATS],
}
Addresses: TypeAlias = Annotated[dict[str, str], WithJsonSchema(_ADDRESSES)]


class Bounds(Answer):
    """Of the vertices as stored."""

    min: Vector
    """Least x, y and z."""
    max: Vector
    """Greatest x, y and z."""


class CurvatureRange(Answer):
    """Least and greatest curvature of the vertices."""

    gaussian: Pair
    """Per square of the model unit."""
    mean: Pair
    """Per model unit."""


class PartReport(Answer):
    """What is known about a part."""

    name: str
    """Name of the part; of a group, of the member."""
    deviation_bound: Length | Missing = None
    """As that of the whole; left out of what has no parameters."""


class MeshReport(Answer):
    """What is known about a mesh."""

    vertices: Count
    """Number of positions: one with several normals counts once."""
    triangles: Count
    """Number of triangles."""
    quads: Count
    """Number of quads."""
    patches: Count
    """Number of Bézier patches; tubes and ribbons have none."""
    bounds: Bounds
    watertight: bool
    """Whether every edge is used by exactly two faces."""
    boundary_edges: Count
    """Edges that only one face uses."""
    poles_repaired: Count
    """Samples whose normal is a limit, since du × dv vanishes there."""
    closed_u: bool | Missing = None
    """Whether the surface closes along u: its last line is its first one. Left out, as the next
    three, for several patches that are not one surface."""
    closed_v: bool | Missing = None
    """Whether it closes along v."""
    continuity_u: Continuity | Missing = None
    """There if it closes along u: whether it does so with one partial du (C1), with one tangent
    plane (G1), or with neither (C0)."""
    continuity_v: Continuity | Missing = None
    """There if it closes along v: whether with one partial dv, as above."""
    deviation_bound: Length | Missing = None
    """Proved, in model units: no point of the surface is further than this from the faces as they
    are written, their rounding included. Never above a tolerance that was asked for; left out where
    there are no faces of a parametric surface."""
    mesh_deviation_bound: Length | Missing = None
    """There if it was asked for (`two_sided`), and proved as well: no point of the faces is further
    than this from the surface."""
    normal_angle: Length | Missing = None
    """There if it was asked for (`angle_tolerance`): radians, the largest measured between the
    normals at two vertices that an edge joins."""
    curvature: CurvatureRange | Missing = None
    """There if it was asked for (`curvatures`): least and greatest curvature of the vertices."""
    parts: list[PartReport] | Missing = None
    """The bound of every part by itself, in the order of the parts."""
    engine: int
    """Version of the numbers."""


class MeshPart(Answer):
    """A named run of faces."""

    name: str
    """Name of the part."""
    faces: Run
    """First face, and the one after the last."""
    color: Rgba | Missing = None
    """Base colour [r, g, b, a], sRGB, where one was told."""


class MeshLines(Answer):
    """An overlay."""

    name: str
    """Name of the overlay."""
    vertices: list[Vector]
    """Positions of its own."""
    segments: list[Segment]
    """Pairs of rows of its `vertices`."""


class Mesh(Answer):
    """A mesh as JSON."""

    vertices: list[Vector]
    """Positions [x, y, z], welded ones once; float64, shortest digits that round-trip."""
    faces: list[Corners]
    """Rows of `vertices` for each corner of each face, counter-clockwise seen from the normal's
    tip; part by part, the quads of a part before its triangles."""
    normals: list[Vector] | Missing = None
    """Unit normals, float32; left out if `normals` is false. Row by row those of `vertices`, unless
    there are `attribute_faces`."""
    uvs: list[Pair] | Missing = None
    """Texture coordinates of the surface, or if it has none and `uvs` is true, parameters (u, v);
    float32. In the rows of `normals`."""
    colors: list[Annotated[list[float], Field(min_length=3, max_length=4)]] | Missing = None
    """Colours of the surface, if it has any: sRGB, or sRGB and opacity, from 0 to 1; float32. In
    the rows of `normals`."""
    attributes: (
        dict[str, list[Annotated[list[float], Field(min_length=1, max_length=MAX_DIMENSION)]]]
        | Missing
    ) = None
    """Values of the surface's attributes by name, float64. In the rows of `normals`."""
    attribute_faces: list[Corners] | Missing = None
    """There if a position has several normals, colours or the like, as at a crease: in the shape
    of `faces`, the rows of `normals`, `uvs`, `colors` and `attributes` for each corner of each
    face."""
    parts: list[MeshPart]
    """Named runs [first, last) of `faces`."""
    lines: list[MeshLines] | Missing = None
    """Overlays, if any were asked for."""
    report: MeshReport


class Points(Answer):
    """Points of a surface in columns, float64, a row for every place asked for."""

    positions: list[Vector]
    """The points [x, y, z]."""
    du: list[VectorOrNull] | Missing = None
    """First partials along u, in the parameters of the surface."""
    dv: list[VectorOrNull] | Missing = None
    """First partials along v."""
    normals: list[Vector] | Missing = None
    """Unit normals along du × dv; where that vanishes, their limits from inside the surface."""
    degenerate: list[bool] | Missing = None
    """Whether du × dv vanishes, as at a pole: normals and curvatures there are limits, taken along
    the line that leads straight inwards."""
    duu: list[VectorOrNull] | Missing = None
    """Second partials along u."""
    duv: list[VectorOrNull] | Missing = None
    """Mixed second partials."""
    dvv: list[VectorOrNull] | Missing = None
    """Second partials along v."""
    gaussian_curvature: list[float | None] | Missing = None
    """Gaussian curvatures, k1 · k2; null where it grows beyond all bounds, as at the apex of a
    cone, or has no limit."""
    mean_curvature: list[float | None] | Missing = None
    """Mean curvatures, (k1 + k2)/2; positive where the surface bends towards its normal, so that a
    sphere with outward normals has −1/r; null where it grows beyond all bounds, as at the apex of a
    cone, or has no limit."""
    principal_curvatures: list[PairOrNull] | Missing = None
    """Principal curvatures [k1, k2], k1 ≥ k2; null where it grows beyond all bounds, as at the apex
    of a cone, or has no limit."""


class CurveBounds(Answer):
    """Of the points as stored."""

    min: Point
    """Least x, y and, in space, z."""
    max: Point
    """Greatest x, y and, in space, z."""


class CurveReport(Answer):
    """What is known about the curve."""

    points: Annotated[int, Field(ge=2)]
    """Number of points."""
    pieces: Annotated[int, Field(ge=1)]
    """Number of Bézier pieces."""
    length: float
    """Length of the curve itself, to about twelve digits."""
    closed: bool
    """Whether it ends where it begins; the last point is then the first."""
    deviation_bound: Length
    """No point of the curve is further from the lines between the points, as they are written."""
    bounds: CurveBounds
    engine: int
    """Version of the numbers."""


class Curve(Answer):
    """A sampled curve as JSON: columns of float64, row k of each for point k."""

    points: list[Point]
    """Points with as many coordinates as the control points have."""
    tangents: list[Point] | Missing = None
    """Unit tangents; left out if `tangents` is false. At a corner or a cusp, that of what
    follows."""
    parameters: list[float]
    """Parameters in the domain of the curve."""
    arc_lengths: list[float] | Missing = None
    """Length of the curve up to each point; left out if `arc_lengths` is false."""
    report: CurveReport


class Refusal(Answer):
    """One thing for which `POST /v1/mesh` would refuse."""

    formats: Annotated[list[FormatName], Field(min_length=1)]
    """The formats that it holds for."""
    code: str
    """As in an error of `POST /v1/mesh`."""
    pointer: str
    """JSON pointer (RFC 6901) into the body."""
    detail: str
    """What is wrong, for people."""
    got: str
    """What was found."""
    needed: str
    """What would be right."""


class Estimate(Answer):
    """What a mesh would be."""

    vertices: Count
    """Positions, as in the report: one with several normals counts once."""
    triangles: Count
    """Triangles."""
    quads: Count
    """Quads."""
    exact: bool
    """Whether these three are those of the report. Else they are upper bounds: under a tolerance,
    usually some ten times what comes out, or a budget; of what is swept along a curve; of wires
    with faces; of what is refused for its vertices."""
    bytes: Annotated[dict[str, int], _sizes("Bytes as")]
    """Bytes of the answer in every format that has a place for the mesh: upper bounds, but for
    `exact_bytes`. Numbers written as text count as long as they can be."""
    exact_bytes: list[FormatName]
    """The formats whose number of bytes is exact."""
    memory: Annotated[dict[str, int], _sizes("Bytes of memory for the mesh as")]
    """Bytes of memory that making the answer takes at most, in the formats in which there would be
    one. What takes more than the service has for one request is refused, `too_much_memory`; what
    takes much may have to wait."""
    accepted: bool
    """Whether `POST /v1/mesh` would answer this body in one of the formats."""
    certain: bool
    """Whether nothing else can be refused. Under a tolerance it is so if the bounds above are
    within all limits; else, and under a budget, a mesh may turn out to be too large, or the
    tolerance too small, when it is made."""
    refused: list[Refusal]
    """Why it would not, in the formats in which it would not."""


class Issue(Answer):
    """One thing that is wrong, and where: a pointer, a parameter or a header."""

    code: Annotated[str, Field(examples=["ragged"])]
    """What is wrong, stable, for programs; the list stands at the head of this document. There may
    be more of them in later versions."""
    pointer: str | Missing = None
    """JSON pointer (RFC 6901) into the body; empty for the whole of it."""
    parameter: str | Missing = None
    """Name of the path or query parameter, instead of a pointer."""
    header: str | Missing = None
    """Name of the header, instead of a pointer."""
    detail: str
    """What is wrong, for people."""
    got: str | Missing = None
    """What was found, described and not repeated."""
    needed: str | Missing = None
    """What would have been right."""


class Problem(Answer):
    """An error answer (RFC 9457)."""

    type: Literal["about:blank"]
    """Always `about:blank`; `code` tells more."""
    title: str
    """The phrase of the status."""
    status: int
    """The status again."""
    code: ProblemCode
    """Kind of problem, stable, for programs."""
    detail: str
    """Kind of problem, for people."""
    errors: list[Issue] = Field(
        max_length=MAX_ISSUES,
        description=f"What is wrong, place by place; at most {MAX_ISSUES} of them.",
    )


class SurfaceLinks(Answer):
    """Addresses, without the host."""

    self: str
    """Address of the definition."""
    mesh: Addresses
    """Address of the mesh by suffix; options are added as a query."""


class SurfaceSummary(Answer):
    """A built-in surface."""

    id: str
    """The id, readable."""
    title: str
    """A short title."""
    description: str
    """What it is."""
    up: Literal["y", "z"]
    """The vertical axis."""
    patches: Count
    """Number of Bézier patches; tubes and ribbons have none."""
    degree: Run
    """Highest degree [p, q] of its patches; a triangle counts as [n, n]. Of what is swept along a
    curve, that of the curve and 0."""
    links: SurfaceLinks


class SurfaceList(Answer):
    """The built-in surfaces."""

    surfaces: list[SurfaceSummary]
    """One entry a surface."""


class SurfaceDocument(Answer):
    """A surface alone: a body for the other calls, to which options may be added."""

    surface: SurfaceDefinition
    """The definition, as a request would give it."""


class StoredLinks(SurfaceLinks):
    """Addresses, without the host."""

    mesh: Addresses
    """Address of the mesh by suffix, in the numbers of today: it may be kept for ever. Options are
    added in front of `engine`."""


class StoredSurface(Answer):
    """A surface that is stored."""

    id: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """SHA-256 of the content: 64 hexadecimal digits."""
    links: StoredLinks


class SignedAddress(Answer):
    """An address that any client may read without a key."""

    url: str
    """The address, with `expires` and `signature` at its end."""
    expires: int
    """Until when, in Unix time."""


class Format(Answer):
    """A format that meshes are written in."""

    name: str
    """Name for `?format=`."""
    title: str
    """What it is."""
    media_type: str
    """Media type for `Accept`."""
    suffix: str
    """Suffix of files and of mesh URLs."""
    quads: bool
    """Whether it can hold quads."""
    overlays: bool
    """Whether it can hold lines."""
    uvs: bool
    """Whether it can hold texture coordinates."""
    colors: bool
    """Whether it can hold colours of vertices."""
    attributes: bool
    """Whether it can hold attributes."""
    precision: Literal["float32", "float64"]
    """Precision of positions."""
    quantize: bool
    """Whether it takes `quantize`."""
    compression: list[Compression]
    """The kinds of `compression` that it takes here, beside `none`."""


class FormatList(Answer):
    """The formats of meshes."""

    formats: list[Format]
    """One entry a format."""


class Health(Answer):
    """How the service is."""

    status: Literal["live", "ready", "unready", "draining"]
    """State of the service."""
    computing: State | Missing = None
    """Whether meshes come out right."""
    store: State | Missing = None
    """Whether surfaces can be kept."""
    version: str | Missing = None
    """Version of the service."""
    engine: int | Missing = None
    """Version of the numbers."""
