"""The JSON language of rays and planes: vectors, and planes that cut a surface."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from service.bases.arrays import FloatArray
from service.engine.sections.values import Planes
from service.errors import InvalidRequest, Issue
from service.schemas.arrays import NumberGrid
from service.schemas.fields import StrictModel, conflict_issue, optional
from service.schemas.validation import to_invalid
from service.surface.checks import check_finite, check_stored, validate_points

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


OFFSETS = NumberGrid(("offsets",))


class PlaneSet(StrictModel):
    """Planes n · p = d, where n is the unit normal; row k of each field belongs to plane k."""

    normals: Annotated[FloatArray, VECTORS] = Field(
        description="Normals of the planes, [x, y, z], of any length but 0; or one normal for all "
        "planes.",
        examples=[[[0, 0, 1]]],
    )
    offsets: Annotated[FloatArray | None, OFFSETS] = optional(
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
        if (self.offsets is None) == (self.points is None):
            message = "A plane has a normal, and an offset or a point."
            is_neither = self.offsets is None
            raise to_invalid(conflict_issue("offsets", "points", message, is_neither=is_neither))
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
        check_finite(offsets, "/offsets")
        check_stored(offsets, "/offsets")  # within single precision
        return Planes(*pair_rows(normals, "normals", offsets, "offsets"))
