"""Answers about surfaces, formats, errors and the service itself as JSON."""

from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import Field, WithJsonSchema

from service.api.models.meshes import Answer, Count, Missing, Run, schema_of_names
from service.api.problems import INTERNAL_ERROR, METHOD_NOT_ALLOWED, NOT_FOUND, PROBLEMS
from service.encoders.format import Compression as AnyCompression
from service.encoders.registry import FORMATS
from service.errors import MAX_ISSUES
from service.schemas.surfaces import SurfaceDefinition

State: TypeAlias = Literal["ready", "unavailable"]
Compression: TypeAlias = Annotated[
    str, schema_of_names([kind for kind in get_args(AnyCompression) if kind != "none"])
]
_PROBLEMS = (*PROBLEMS.values(), NOT_FOUND, METHOD_NOT_ALLOWED, INTERNAL_ERROR)
ProblemCode: TypeAlias = Annotated[
    str, schema_of_names(sorted({problem.code for problem in _PROBLEMS}))
]

_ADDRESSES: dict[str, Any] = {
    "type": "object",
    "properties": {f.suffix: {"type": "string", "description": f"{f.title}."} for f in FORMATS},
    "required": [f.suffix for f in FORMATS],
}
Addresses: TypeAlias = Annotated[dict[str, str], WithJsonSchema(_ADDRESSES)]


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
