"""The JSON language of intersections: a surface, and rays or planes."""

from typing import Annotated, Literal, Self

import numpy as np
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
from service.schemas.arrays import NumberGrid
from service.schemas.fields import (
    Omittable,
    StrictModel,
    check_exactly_one,
    conflict_issue,
    optional,
)
from service.schemas.request import SurfaceRequest
from service.schemas.validation import to_invalid
from service.surface.checks import check_stored, validate_points

VECTORS = NumberGrid(
    ("vectors", "coordinates"),
    width=3,
    width_rule="Rays and planes are in space: three numbers [x, y, z].",
)

MIN_NUMBER = 1e-100
"""A vector needs one number at least this large in absolute value. Vectors are divided by their
largest number before they are squared; only numbers below 1e-307 have too few digits for this."""


def validate_directions(vectors: FloatArray, name: str) -> FloatArray:
    """Check directions: returns the vectors as an array (n, 3); they need not have length 1.

    Raises
    ------
    InvalidRequest
        `zero_direction`, and the errors of `validate_points`; with pointers to `/name`.
    """
    directions = validate_points(vectors, name, axes=2)
    zero_rows = np.flatnonzero(np.abs(directions).max(axis=1) < MIN_NUMBER)
    if len(zero_rows):
        raise InvalidRequest(
            Issue(
                "zero_direction",
                "A vector of length 0 has no direction.",
                f"/{name}/{zero_rows[0]}",
                "a length of about 0",
                "a longer vector",
            )
        )
    return directions


def pair_rows(
    rows: FloatArray, name: str, other_rows: FloatArray, other_name: str
) -> tuple[FloatArray, FloatArray]:
    """Give two arrays the same number of rows: if one has a single row, this row is repeated.

    Raises
    ------
    InvalidRequest
        `conflicting_options`: the numbers of rows differ.
    """
    count = max(len(rows), len(other_rows))
    if not {len(rows), len(other_rows)} <= {1, count}:
        raise InvalidRequest(
            Issue(
                "conflicting_options",
                f"There must be as many {name} as {other_name}, or only one of them.",
                f"/{name}",
                f"{len(rows)} {name}, {len(other_rows)} {other_name}",
                f"{len(other_rows)} {name}, or 1",
            )
        )
    return (
        np.broadcast_to(rows, (count, *rows.shape[1:])),
        np.broadcast_to(other_rows, (count, *other_rows.shape[1:])),
    )


class PlaneSet(StrictModel):
    """Planes n · p = d, where n is the unit normal; row k of each field belongs to plane k."""

    normals: Annotated[FloatArray, VECTORS] = Field(
        description="Normals of the planes, [x, y, z], of any length but 0; or one normal for all "
        "planes.",
        examples=[[[0, 0, 1]]],
    )
    offsets: Annotated[FloatArray | None, NumberGrid(("offsets",))] = optional(
        "Distances d of the planes from the origin, in the direction of their normals: at most "
        "1,000 numbers, or one number for all planes.",
        [0.5, 1, 1.5],
    )
    points: Annotated[FloatArray | None, VECTORS] = optional(
        "In place of `offsets`: one point [x, y, z] of each plane, or one point for all planes.",
        [[0, 0, 0.5]],
    )

    @model_validator(mode="after")
    def _check_one_form(self) -> Self:
        check_exactly_one(
            self, "offsets", "points", "A plane has a normal, and an offset or a point."
        )
        return self

    def to_planes(self) -> Planes:
        """The planes as a value of the engine.

        Raises
        ------
        InvalidRequest
            `conflicting_options`: the numbers of normals and of offsets or points differ;
            `zero_direction`; and the errors of `validate_points`.
        """
        try:
            return self._build_planes()
        except InvalidRequest as error:
            raise error.within("/planes") from None

    def _build_planes(self) -> Planes:
        """Build the planes; the pointers of errors are relative to this object."""
        normals = validate_directions(self.normals, "normals")
        # First divide by the largest coordinate, so that the squares of small numbers keep digits.
        normals = normals / np.abs(normals).max(axis=1, keepdims=True)
        normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
        if self.points is not None:
            points = validate_points(self.points, "points", axes=2)
            normals, points = pair_rows(normals, "normals", points, "points")
            return Planes(normals, (normals * points).sum(axis=1))
        offsets = np.asarray(self.offsets, np.float64) + 0.0  # −0 becomes 0
        check_stored(offsets, "/offsets")  # within single precision
        return Planes(*pair_rows(normals, "normals", offsets, "offsets"))


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
        check_exactly_one(self, "rays", "planes", "A request has either rays or planes.")
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
        return self.planes.to_planes(), SectionTolerance(self.tolerance, self.relative_tolerance)

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
