"""Models of JSON responses about points and curves."""

from typing import Annotated, Any, TypeAlias

from pydantic import Field

from service.api.models.meshes import Length, Missing, ResponseModel, Vector, schema_of_row

_NUMBER_OR_NULL: dict[str, Any] = {"type": ["number", "null"]}

PairOrNull: TypeAlias = Annotated[
    tuple[float | None, float | None], schema_of_row(_NUMBER_OR_NULL, 2)
]
VectorOrNull: TypeAlias = Annotated[
    tuple[float | None, float | None, float | None], schema_of_row(_NUMBER_OR_NULL, 3)
]
Point: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=3)]
PointOrNull: TypeAlias = Annotated[list[float | None], Field(min_length=2, max_length=3)]


class Points(ResponseModel):
    """Points of a surface in columns, float64, one row for each requested place.

    A derivative or curvature beyond the range of float64 is null.
    """

    positions: list[Vector]
    """The points [x, y, z]."""
    du: list[VectorOrNull] | Missing = None
    """First partials along u, in the parameters of the surface."""
    dv: list[VectorOrNull] | Missing = None
    """First partials along v."""
    normals: list[Vector] | Missing = None
    """Unit normals along du × dv; where du × dv vanishes, their limits from inside the surface. If
    du and dv are parallel at a corner of a patch, or inside a patch, there may be another limit
    along u than along v: then the limit along the diagonal is given, which stays the same if u and
    v are exchanged."""
    degenerate: list[bool] | Missing = None
    """Whether du × dv vanishes, as at a pole: normals and curvatures there are limits, along the
    line in the domain that leads straight inwards."""
    duu: list[VectorOrNull] | Missing = None
    """Second partials along u."""
    duv: list[VectorOrNull] | Missing = None
    """Mixed second partials."""
    dvv: list[VectorOrNull] | Missing = None
    """Second partials along v."""
    gaussian_curvature: list[float | None] | Missing = None
    """Gaussian curvatures, k1 · k2; null where they are infinite, as at the apex of a cone, or
    have no limit."""
    mean_curvature: list[float | None] | Missing = None
    """Mean curvatures, (k1 + k2)/2; positive where the surface bends towards its normal, so that a
    sphere with outward normals has −1/r; null where they are infinite, as at the apex of a cone, or
    have no limit."""
    principal_curvatures: list[PairOrNull] | Missing = None
    """Principal curvatures [k1, k2], k1 ≥ k2; null where they are infinite, as at the apex of a
    cone, or have no limit."""
    inside: list[bool | None] | Missing = None
    """For a brep, or a group with one: whether the point is inside the trims of its face; points of
    untrimmed patches are. Proved, rounding included.
    Null where this is not decided: on a border of the face, nearer to an edge than the proved gap
    between this edge and the surface, and on a face that was left out. Seams and poles are no
    borders."""


class CurveBounds(ResponseModel):
    """Bounding box of the stored points."""

    min: Point
    """Least x, y and, in space, z."""
    max: Point
    """Greatest x, y and, in space, z."""


class CurveReport(ResponseModel):
    """Facts about a curve."""

    points: Annotated[int, Field(ge=1)]
    """Number of points."""
    pieces: Annotated[int, Field(ge=1)]
    """Number of Bézier pieces."""
    length: float
    """Length of the curve itself, to about 12 digits."""
    closed: bool
    """Whether the curve ends where it begins; its last point is then equal to the first."""
    deviation_bound: Length | Missing = None
    """Proved, in model units: no point of the curve is further than this from the lines. The lines
    join the points as they are in the file, after rounding. Left out with `parameters`."""
    bounds: CurveBounds
    engine: int
    """Version of the engine: equal requests give equal numbers while it is the same."""


class Curve(ResponseModel):
    """A sampled curve as JSON: columns of float64; row k of each column belongs to point k."""

    points: list[Point]
    """Points with as many coordinates as the control points have."""
    tangents: list[Point] | Missing = None
    """Unit tangents; left out if `tangents` is false. At a corner or a cusp, the tangent where the
    next piece begins."""
    parameters: list[float]
    """Parameters in the domain of the curve."""
    arc_lengths: list[float] | Missing = None
    """Length of the curve up to each point; left out if `arc_lengths` is false."""
    dt: list[PointOrNull] | Missing = None
    """First derivatives, by the parameter of the curve; at a knot from the right."""
    degenerate: list[bool] | Missing = None
    """Whether the first derivative vanishes, as at a cusp: tangents, curvatures and torsions there
    are limits from the right, at the end of the curve from the left."""
    dtt: list[PointOrNull] | Missing = None
    """Second derivatives."""
    curvature: list[float | None] | Missing = None
    """Curvatures, 1/r on a circle of radius r; of a curve in the plane positive where it turns
    left. Null where they are infinite, as at most cusps, and where the curve is one point."""
    dttt: list[PointOrNull] | Missing = None
    """Third derivatives."""
    torsion: list[float | None] | Missing = None
    """Torsions of a curve in space, positive where it twists like a right-handed screw; null where
    they are infinite, and where the curve is straight."""
    report: CurveReport
