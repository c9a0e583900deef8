"""The JSON language of intersections: a surface, and rays or planes."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.bases.arrays import FloatArray
from service.engine.rays.intersect import RELATIVE_THICKNESS, RayQuery
from service.engine.sections.values import (
    MIN_RELATIVE_TOLERANCE,
    RELATIVE_TOLERANCE,
    Planes,
    SectionTolerance,
)
from service.errors import InvalidRequest, Issue
from service.schemas.fields import Omittable, StrictModel, conflict_issue, optional
from service.schemas.planes import VECTORS, PlaneSet, pair_rows, validate_directions
from service.schemas.request import SurfaceRequest
from service.schemas.validation import to_invalid
from service.surface.checks import validate_points

MIN_THICKNESS = 1e-12
"""The least thickness that a request may ask for. With a smaller thickness, rounding would
decide whether a ray hits."""


class Rays(StrictModel):
    """Rays origin + t · direction with t ≥ 0; row k of both fields belongs to ray k."""

    origins: Annotated[FloatArray, VECTORS] = Field(
        description="Starting points of the rays, [x, y, z], at most 100,000; or one for all.",
        examples=[[[0, 0, 9], [1, 0, 9]]],
    )
    directions: Annotated[FloatArray, VECTORS] = Field(
        description="Directions of the rays, [x, y, z], of any length but 0; or one for all.",
        examples=[[[0, 0, -1]]],
    )


RAY_FIELDS, PLANE_FIELDS = ("hits", "relative_thickness"), ("tolerance", "relative_tolerance")
"""Names of the fields that are for rays only, and of the fields that are for planes only."""


class IntersectRequest(SurfaceRequest):
    """A surface, and rays that hit it or planes that cut it."""

    rays: Annotated[Rays | None, Omittable()] = optional("The rays that may hit the surface.")
    planes: Annotated[PlaneSet | None, Omittable()] = optional(
        "The planes that may cut the surface, in place of rays."
    )
    hits: Literal["first", "all"] = Field(
        default="first", description="Which hits of a ray are returned: the first, or all."
    )
    relative_thickness: Annotated[float, Field(ge=MIN_THICKNESS, le=1e-3)] = Field(
        default=RELATIVE_THICKNESS,
        description="At borders, and where a ray only touches the surface, a ray within this "
        "distance counts as a hit. A share of the diagonal of the bounding box of the control "
        "points.",
        examples=[1e-6],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0)] = optional(
        "For planes: the largest distance, in model units, of a section from its polyline.",
        0.001,
    )
    relative_tolerance: Annotated[float, Field(ge=MIN_RELATIVE_TOLERANCE, le=0.1)] = Field(
        default=RELATIVE_TOLERANCE,
        description="The tolerance as a share of the diagonal of the bounding box of the control "
        "points, in place of `tolerance`.",
        examples=[1e-4],
    )

    @model_validator(mode="after")
    def _check_fields(self) -> Self:
        if (self.rays is None) == (self.planes is None):
            message = "A request has either rays or planes."
            raise to_invalid(
                conflict_issue("rays", "planes", message, is_neither=self.rays is None)
            )
        excluded, kind = (PLANE_FIELDS, "planes") if self.planes is None else (RAY_FIELDS, "rays")
        for name in excluded:
            if name in self.model_fields_set:
                raise to_invalid(
                    Issue(
                        "conflicting_options",
                        f"This field is for {kind} only.",
                        f"/{name}",
                        "a request without them",
                        kind,
                    )
                )
        if set(PLANE_FIELDS) <= self.model_fields_set:
            message = "A request has one tolerance: in model units, or as a share."
            raise to_invalid(conflict_issue(*PLANE_FIELDS, message, is_neither=False))
        return self

    def to_sections(self) -> tuple[Planes, SectionTolerance]:
        """The planes, and the tolerance of the polylines, for the engine.

        Raises
        ------
        InvalidRequest
            `conflicting_options`: the numbers of points and normals differ; `zero_direction`.
        """
        if self.planes is None:
            raise ValueError("a request without planes has no sections")
        tolerance = SectionTolerance(self.tolerance, self.relative_tolerance)
        return self.planes.to_planes(), tolerance

    def to_query(self) -> RayQuery:
        """The rays, with one row for each ray, for the engine.

        Raises
        ------
        InvalidRequest
            `conflicting_options`: the numbers of origins and directions differ; `zero_direction`.
        """
        if self.rays is None:
            raise ValueError("a request without rays has no hits")
        try:
            origins = validate_points(self.rays.origins, "origins", axes=2)
            directions = validate_directions(self.rays.directions, "directions")
            directions, origins = pair_rows(directions, "directions", origins, "origins")
        except InvalidRequest as error:
            raise error.within("/rays") from None
        return RayQuery(origins, directions, self.hits == "first", self.relative_thickness)
