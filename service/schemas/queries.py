"""The JSON language of queries: points of a surface, closest points, and measures."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, WithJsonSchema, WrapValidator, model_validator
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from service.bases.arrays import FloatArray, Ints
from service.engine.closest.project import RELATIVE_TOLERANCE, ProjectQuery
from service.engine.measures.values import (
    MAX_TOLERANCE,
    TOLERANCE,
    WELD_TOLERANCE,
    MeasureQuery,
)
from service.engine.options import MAX_WELD_TOLERANCE
from service.engine.points.places import PointsQuery
from service.errors import InvalidRequest, Issue, count_nouns
from service.schemas.arrays import NumberGrid
from service.schemas.curves import CurveDefinition, build_curve
from service.schemas.fields import (
    IgnoredOrientation,
    IgnoredReading,
    Omittable,
    RequestModel,
    check_exactly_one,
    conflict_issue,
    optional,
)
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import SurfaceDefinition
from service.schemas.validation import MAX_INDEX, index_too_large, to_invalid, wrong_type
from service.surface.checks import validate_points
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.kinds import Surface

MIN_TOLERANCE = 1e-12
"""The least tolerance that a request may ask for: rounding alone makes intervals this wide."""

UV = NumberGrid(
    ("points", "parameters"), width=2, width_rule="A point of a surface has two parameters [u, v]."
)
BARYCENTRIC = NumberGrid(
    ("places", "coordinates"),
    width=3,
    width_rule="A place on a triangle has three barycentric coordinates [r, s, t].",
)


def _parse_patch_numbers(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """Parse the field `patch`: a list of patch numbers, or one number for all points."""
    if type(value) is int:
        if abs(value) > MAX_INDEX:
            raise to_invalid(index_too_large())
        return np.array(value, dtype=np.int64)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a whole number or a list of them"))
    return handler(value)


_INDEX = {"type": "integer", "minimum": 0}

PatchChoice = Annotated[
    Ints | None,
    NumberGrid(("patch numbers",), integers=True),
    WrapValidator(_parse_patch_numbers),
    WithJsonSchema({"oneOf": [_INDEX, {"type": "array", "items": _INDEX, "minItems": 1}]}),
]


class PointsRequest(SurfaceRequest):
    """Parameters at which a surface is evaluated, and the derivatives to return."""

    uv: Annotated[FloatArray | None, UV] = optional(
        "Parameters [u, v], one pair for each point, in the domain of the surface; for a patch, "
        "both are from 0 to 1. A knot belongs to the span that begins at it, and the end of the "
        "domain belongs to the last span.",
        [[0.5, 0.5], [0, 1]],
    )
    barycentric: Annotated[FloatArray | None, BARYCENTRIC] = optional(
        "For triangles, in place of `uv`: barycentric coordinates [r, s, t], none negative, with "
        "the sum 1. `du` is then the derivative in the direction (−1, 1, 0), and `dv` in the "
        "direction (−1, 0, 1).",
        [[0.5, 0.25, 0.25], [1, 0, 0]],
    )
    patch: PatchChoice = optional(
        "For `patches`, `multipatch`, `brep` and `group` with more than one patch, surface or "
        "face: the number of the patch, surface or face on which the points are, from 0 in the "
        "order of the request. In a group, the faces of a brep and the Bézier patches of other "
        "members follow those of the member before. One number for all points, or a list with one "
        "number for each point. Required for these surfaces, and only for these; a `brep` or a "
        "`group` of one face or patch may have it, too.",
        0,
    )
    derivatives: Annotated[int, Field(ge=0, le=2)] = Field(
        default=1,
        description="Order of the partials. 0 returns `positions` alone; 1 adds `du`, `dv`, "
        "`normals` and `degenerate`; 2 adds `duu`, `duv`, `dvv` and the curvatures.",
        examples=[2],
    )

    @model_validator(mode="after")
    def _check_one_form(self) -> Self:
        message = "There must be one list of places: `uv`, or on triangles `barycentric`."
        check_exactly_one(self, "uv", "barycentric", message)
        return self

    def to_query(self) -> PointsQuery:
        """The parameters, the patch numbers and the order of derivatives, for the engine."""
        places = self.barycentric if self.uv is None else self.uv
        if places is None:
            raise ValueError("a request without places was not validated")
        return PointsQuery(places, self.patch, self.derivatives)


class MeasureRequest(SurfaceRequest):
    """A surface to measure."""

    tolerance: Annotated[float, Field(ge=MIN_TOLERANCE, le=MAX_TOLERANCE)] = Field(
        default=TOLERANCE,
        description="The largest width of intervals: relative to the area, to the length of all "
        "borders and to the volume of the whole surface; for the centroid relative to the diagonal "
        "of the bounding box of the control points. Intervals that take more work than one request "
        "may take are wider, and `reached` is false.",
        examples=[1e-9],
    )
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=WELD_TOLERANCE,
        description="A share of the diagonal of the bounding box of the control points. Control "
        "points on borders of patches that are nearer to each other than this count as one point, "
        "as in a mesh. The interval of a volume includes every way to close the gaps between such "
        "points.",
        examples=[1e-6],
    )

    def to_query(self) -> MeasureQuery:
        """The tolerances of the request, for the engine."""
        return MeasureQuery(self.tolerance, self.weld_tolerance)


class ProjectRequest(RequestModel):
    """A surface or a curve, and points: the service finds the closest point for each of them."""

    surface: Annotated[SurfaceDefinition | None, Omittable()] = optional(
        "The surface: all of its patches, and all members of a group, are searched together; of a "
        "brep its trimmed faces and its edges."
    )
    curve: Annotated[CurveDefinition | None, Omittable()] = optional(
        "A curve, in place of the surface."
    )
    reading: IgnoredReading = None
    orientation: IgnoredOrientation = None
    points: Annotated[FloatArray, NumberGrid(("points", "coordinates"))] = Field(
        description="Points [x, y, z], or [x, y] for a curve in the plane. At most 100,000.",
        examples=[[[0, 0, 2], [1.5, 0, 0]]],
    )
    relative_tolerance: Annotated[float, Field(ge=MIN_TOLERANCE, le=0.1)] = Field(
        default=RELATIVE_TOLERANCE,
        description="The largest width of an interval in `distance_bounds`, as a share of the "
        "diagonal of the bounding box of the control points.",
        examples=[1e-6],
    )
    sign: bool = Field(
        default=False,
        description="Whether the response says which points are inside a closed surface (`signs`).",
        examples=[True],
    )

    @model_validator(mode="after")
    def _check_shape(self) -> Self:
        check_exactly_one(self, "surface", "curve", "A request has either a surface or a curve.")
        if self.curve is not None and self.sign:
            message = "A curve has no inside: `sign` is for surfaces."
            raise to_invalid(conflict_issue("curve", "sign", message, is_neither=False))
        return self

    def to_shape(self) -> Surface | Curve:
        """The surface or the curve; the first call builds it.

        Raises `InvalidRequest` with pointers into the whole request.
        """
        shape: Surface | Curve | None = self.__dict__.get("_shape")
        if shape is None:
            if self.curve is not None:
                shape = build_curve(self.curve)
            elif self.surface is not None:
                try:
                    shape = self.surface.to_surface()
                except InvalidRequest as error:
                    raise error.within("/surface") from None
            else:
                raise ValueError("a request without a shape was not validated")
            self.__dict__["_shape"] = shape
        return shape

    build = to_shape

    def to_query(self) -> ProjectQuery:
        """The points and the tolerance, for the engine; raises `InvalidRequest`."""
        shape = self.to_shape()
        dimension = shape.lower().dimension if isinstance(shape, BezierCurve | BsplineCurve) else 3
        check_dimension(self.points, dimension)
        points = validate_points(self.points, "points", axes=2, dimensions=(dimension,))
        return ProjectQuery(points, self.relative_tolerance, self.sign)


def check_dimension(points: FloatArray, dimension: int) -> None:
    """Refuse points that do not have `dimension` coordinates, as the control points have."""
    if points.shape[1] != dimension:
        raise InvalidRequest(
            Issue(
                "wrong_dimension",
                "A point has as many coordinates as the control points have.",
                "/points/0",
                count_nouns(points.shape[1], "numbers"),
                count_nouns(dimension, "numbers"),
            )
        )
