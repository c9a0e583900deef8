"""The fields of the calls beside the surface, for type checkers and editors.

`docs/reference.md` explains each field, its range and its default.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Required, TypeAlias, TypedDict

from numpy.typing import NDArray

Numbers: TypeAlias = NDArray[Any] | Sequence[Any]
"""An array, or lists of numbers."""

Pair: TypeAlias = int | Sequence[int]
"""One number, or one for u and one for v."""


class FileFields(TypedDict, total=False):
    """Fields of a surface that stand beside a file."""

    type: Literal["bezier", "bspline", "patches"]
    degree: Pair
    knots: str | Sequence[str]
    homogeneous: bool
    up: Literal["y", "z"]
    name: str
    invalid_faces: Literal["skip", "refuse"]


class MeshFields(FileFields, total=False):
    """Options of a mesh."""

    resolution: Pair
    tolerance: float
    relative_tolerance: float
    angle_tolerance: float
    max_triangles: int
    max_bytes: int
    two_sided: bool
    camera: Mapping[str, Any]
    pixel_tolerance: float
    faces: Literal["triangles", "quads", "none"]
    normals: bool
    uvs: bool
    curvatures: bool
    weld: bool
    crease_angle: float
    weld_tolerance: float
    orient: bool
    overlays: Sequence[Literal["control_net", "boundary"]]
    isocurves: Pair
    wires: Literal["lines", "tubes", "ribbons"]
    wire_width: float
    wire_sides: int
    method: Literal["matrix", "de_casteljau", "forward_difference"]
    oogl: Literal["cquad", "mesh", "off", "bez"]
    quantize: bool
    compression: Literal["none", "meshopt"]
    stl: Literal["binary", "ascii"]


class ViewFields(TypedDict, total=False):
    """From where a picture is drawn, and how large it is."""

    width: int
    height: int
    azimuth: float
    elevation: float
    zoom: float
    field_of_view: float
    orthographic: bool


class ImageFields(FileFields, ViewFields, total=False):
    """Options of a picture."""

    position: Numbers
    target: Numbers
    look: Literal["shaded", "gaussian", "mean"]
    background: str
    edges: bool
    isocurves: Pair
    control_net: bool


class PointsFields(FileFields, total=False):
    """Parameters of points: `uv`, or `barycentric` on triangles."""

    uv: Numbers
    barycentric: Numbers
    patch: int | Sequence[int]
    derivatives: int


class CurveFields(TypedDict, total=False):
    """Samples of a curve."""

    resolution: int
    tolerance: float
    parameters: Numbers
    derivatives: int
    tangents: bool
    arc_lengths: bool


class ProjectFields(FileFields, total=False):
    """Points (m, 3) whose closest points are asked for."""

    curve: Mapping[str, Any]
    points: Numbers
    relative_tolerance: float
    sign: bool


class Rays(TypedDict):
    """Rays: one origin, or one direction, may serve all."""

    origins: Numbers
    directions: Numbers


class Planes(TypedDict, total=False):
    """Planes by their normals, and offsets or points."""

    normals: Required[Numbers]
    offsets: Numbers
    points: Numbers


class IntersectFields(FileFields, total=False):
    """Rays that may hit the surface, or planes that cut it."""

    rays: Rays
    planes: Planes
    hits: Literal["first", "all"]
    relative_thickness: float
    tolerance: float
    relative_tolerance: float


class MeasureFields(FileFields, total=False):
    """How exact measures are."""

    tolerance: float
    weld_tolerance: float


class CheckFields(FileFields, total=False):
    """How exactly a mesh is compared with its surface."""

    quad_diagonal: Literal["02", "13"]
    relative_tolerance: float
    distances: bool


class ConvertFields(FileFields, total=False):
    """The operations of a conversion, one after the other."""

    operations: Sequence[Mapping[str, Any]]


class SignFields(TypedDict, total=False):
    """When a signed URL expires: at a time, or in some seconds."""

    expires: int
    seconds: int
