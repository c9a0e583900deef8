"""Models of JSON responses about surfaces, formats, errors and the service."""

from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import Field, WithJsonSchema

from service.api.models.meshes import Count, IntegerPair, Missing, ResponseModel, schema_of_names
from service.api.models.reading import Reading
from service.api.problems import INTERNAL_ERROR, METHOD_NOT_ALLOWED, NOT_FOUND, PROBLEMS
from service.encoders.format import Compression as AnyCompression
from service.encoders.registry import FORMATS
from service.errors import MAX_ISSUES
from service.schemas.surfaces import SurfaceDefinition

State: TypeAlias = Literal["ready", "unavailable"]
Compression: TypeAlias = Annotated[
    str, schema_of_names([kind for kind in get_args(AnyCompression) if kind != "none"])
]
# Not the problems that the server itself returns for any URL: no operation declares them.
_PROBLEMS = (*PROBLEMS.values(), NOT_FOUND, METHOD_NOT_ALLOWED, INTERNAL_ERROR)
ProblemCode: TypeAlias = Annotated[
    str, schema_of_names(sorted({problem.code for problem in _PROBLEMS}))
]

_URLS_BY_SUFFIX: dict[str, Any] = {
    "type": "object",
    "properties": {f.suffix: {"type": "string", "description": f"{f.title}."} for f in FORMATS},
    "required": [f.suffix for f in FORMATS],
}
UrlsBySuffix: TypeAlias = Annotated[dict[str, str], WithJsonSchema(_URLS_BY_SUFFIX)]


class Issue(ResponseModel):
    """One error, and where it is: a pointer, a parameter or a header."""

    code: Annotated[str, Field(examples=["ragged"])]
    """Stable code of the error, for programs; the description of this document lists them. Later
    versions may add codes."""
    pointer: str | Missing = None
    """JSON pointer (RFC 6901) into the body; empty for the whole body."""
    parameter: str | Missing = None
    """Name of the path or query parameter, instead of a pointer."""
    header: str | Missing = None
    """Name of the header, instead of a pointer."""
    detail: str
    """Text of the error, for people."""
    got: str | Missing = None
    """A description of the input, which does not repeat it."""
    needed: str | Missing = None
    """A description of valid input."""


class Problem(ResponseModel):
    """An error response (RFC 9457)."""

    type: Literal["about:blank"]
    """Always `about:blank`; `code` says more."""
    title: str
    """The phrase of the HTTP status."""
    status: int
    """The HTTP status."""
    code: ProblemCode
    """Stable code of the kind of problem, for programs."""
    detail: str
    """The problem in words, for people."""
    errors: list[Issue] = Field(
        max_length=MAX_ISSUES,
        description=f"The errors; at most {MAX_ISSUES} of them.",
    )


class SurfaceLinks(ResponseModel):
    """URLs, without the host."""

    self: str
    """URL of the definition."""
    mesh: UrlsBySuffix
    """URL of the mesh by suffix; add options as a query."""
    image: str
    """URL of the picture; add options as a query."""


class SurfaceSummary(ResponseModel):
    """A built-in surface."""

    id: str
    """A readable id."""
    title: str
    """A short title."""
    description: str
    """A sentence about the surface."""
    up: Literal["y", "z"]
    """The vertical axis."""
    patches: Count
    """Number of Bézier patches, also of the surfaces of faces; tubes and ribbons have none."""
    degree: IntegerPair
    """Highest degrees [p, q] of its patches. For a triangle of degree n, [n, n]; for a tube or a
    ribbon, the degree of its curve, and 0."""
    links: SurfaceLinks


class SurfaceList(ResponseModel):
    """The built-in surfaces."""

    surfaces: list[SurfaceSummary]
    """The built-in surfaces, one entry each."""


class Orientation(ResponseModel):
    """Which patches were turned, so that neighbours agree and volumes are positive.

    Numbers are those of the surface before the operation, as `POST /v1/points` counts them
    (`patch`); of a B-spline in a group its first.
    """

    turned: list[Annotated[int, Field(ge=0)]]
    """The patches that were turned."""
    not_orientable: list[Annotated[int, Field(ge=0)]]
    """The patches of surfaces without a consistent orientation, such as a Möbius strip, which were
    not turned."""


class SurfaceDocument(ResponseModel):
    """A surface without options. Clients may add options, and send it to the other calls."""

    surface: SurfaceDefinition
    """The definition, in the form of a request."""
    reading: Reading | Missing = None
    """The report of reading, if the surface came from a CAD file. Other calls ignore it."""
    orientation: Orientation | Missing = None
    """The report of the last operation `orient`. Other calls ignore it."""


class StoredLinks(SurfaceLinks):
    """URLs, without the host."""

    mesh: UrlsBySuffix
    """URL of the mesh by suffix, for this version of the engine: clients may cache the mesh for
    ever. Add options before `engine`, which is at the end of a canonical URL."""
    image: str
    """URL of the picture, for this version of the engine, as that of the mesh."""


class StoredSurface(ResponseModel):
    """A stored surface."""

    id: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """SHA-256 of the content: 64 hexadecimal digits."""
    links: StoredLinks
    reading: Reading | Missing = None
    """The report of reading, if the surface came from a CAD file. It is not stored."""


class StoredEntry(ResponseModel):
    """A stored surface in a list."""

    id: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """SHA-256 of the content: 64 hexadecimal digits."""
    bytes: Count
    """Bytes of the content."""
    time: Annotated[str, Field(examples=["2026-01-31T12:00:00.000Z"])]
    """When it was stored, or stored again after damage: RFC 3339, UTC."""


class PageLinks(ResponseModel):
    """URLs, without the host."""

    next: str | Missing = None
    """URL of the next page; missing on the last one."""


class StoredList(ResponseModel):
    """Stored surfaces in the order of their ids."""

    surfaces: list[StoredEntry]
    """The surfaces, at most `limit`."""
    links: PageLinks


class SignedAddress(ResponseModel):
    """A URL that any client may read without a key."""

    url: str
    """The URL, with `expires` and `signature` at its end."""
    expires: int
    """The time when it expires, in Unix time."""


class Format(ResponseModel):
    """A format of meshes."""

    name: str
    """Name for `?format=`."""
    title: str
    """A short title of the format."""
    media_type: str
    """Media type for `Accept`."""
    suffix: str
    """Suffix of files and of mesh URLs."""
    quads: bool
    """Whether it can store quads."""
    overlays: bool
    """Whether it can store lines."""
    uvs: bool
    """Whether it can store texture coordinates."""
    colors: bool
    """Whether it can store colours of vertices."""
    attributes: bool
    """Whether it can store attributes."""
    precision: Literal["float32", "float64"]
    """Precision of positions."""
    quantize: bool
    """Whether it supports `quantize`."""
    compression: list[Compression]
    """The kinds of `compression` that this service supports for it, beside `none`."""


class FormatList(ResponseModel):
    """The formats of meshes."""

    formats: list[Format]
    """The formats, one entry each."""


class Health(ResponseModel):
    """The health of the service."""

    status: Literal["live", "ready", "unready", "draining"]
    """State of the service."""
    computing: State | Missing = None
    """Whether the self-test computed the right mesh."""
    store: State | Missing = None
    """Whether stored surfaces can be read."""
    writes: Literal["ready", "read_only", "full", "unavailable"] | Missing = None
    """Whether surfaces can be stored, by the last write or by a test of writing each minute. If
    not, the service still serves stored surfaces, and is ready."""
    version: str | Missing = None
    """Version of the service."""
    engine: int | Missing = None
    """Version of the numbers. It changes when the service computes other numbers for the same
    request."""
