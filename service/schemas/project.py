"""The JSON language of closest points: a surface or a curve, and the points."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.bases.arrays import FloatArray
from service.engine.closest.project import RELATIVE_TOLERANCE, ProjectQuery
from service.errors import InvalidRequest, Issue, count_nouns
from service.schemas.arrays import NumberGrid
from service.schemas.curves import CurveDefinition, build_curve
from service.schemas.fields import Omittable, RequestModel, conflict_issue, optional
from service.schemas.surfaces import SurfaceDefinition
from service.schemas.validation import to_invalid
from service.surface.checks import validate_points
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.kinds import Surface

POINTS = NumberGrid(("points", "coordinates"))

MIN_TOLERANCE = 1e-12
"""The least tolerance that a request may ask for: rounding alone makes intervals this wide."""


class ProjectRequest(RequestModel):
    """A surface or a curve, and points: the service finds the closest point for each of them."""

    surface: Annotated[SurfaceDefinition | None, Omittable()] = optional(
        "The surface: all of its patches, and all members of a group, are searched together."
    )
    curve: Annotated[CurveDefinition | None, Omittable()] = optional(
        "A curve, in place of the surface."
    )
    points: Annotated[FloatArray, POINTS] = Field(
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
        if (self.surface is None) == (self.curve is None):
            message = "A request has either a surface or a curve."
            is_neither = self.surface is None
            raise to_invalid(conflict_issue("surface", "curve", message, is_neither=is_neither))
        if self.curve is not None and self.sign:
            message = "A curve has no inside: `sign` is for surfaces."
            raise to_invalid(conflict_issue("curve", "sign", message, is_neither=False))
        return self

    def build(self) -> None:
        """Build the surface or the curve, which `to_shape` then returns."""
        self.to_shape()

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

    def to_query(self) -> ProjectQuery:
        """The points and the tolerance, for the engine; raises `InvalidRequest`."""
        shape = self.to_shape()
        dimension = 3
        if isinstance(shape, BezierCurve | BsplineCurve):
            dimension = shape.lower().dimension
        check_dimension(self.points, dimension)
        points = validate_points(self.points, "points", axes=2, dimensions=(dimension,))
        return ProjectQuery(points, self.relative_tolerance, self.sign)


def check_dimension(points: FloatArray, dimension: int) -> None:
    """Refuse points that do not have `dimension` coordinates, as the control points have."""
    if points.shape[1] != dimension:
        message = "A point has as many coordinates as the control points have."
        got, needed = count_nouns(points.shape[1], "numbers"), count_nouns(dimension, "numbers")
        raise InvalidRequest(Issue("wrong_dimension", message, "/points/0", got, needed))
