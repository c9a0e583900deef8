"""Checks the vectors of rays and planes in a document."""

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue
from service.schemas.arrays import NumberGrid
from service.surface.checks import validate_points

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
        message = "A vector of length 0 has no direction."
        where = f"/{name}/{zero_rows[0]}"
        raise InvalidRequest(
            Issue("zero_direction", message, where, "a length of about 0", "a longer vector")
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
        message = f"There must be as many {name} as {other_name}, or only one of them."
        got = f"{len(rows)} {name}, {len(other_rows)} {other_name}"
        needed = f"{len(other_rows)} {name}, or 1"
        raise InvalidRequest(Issue("conflicting_options", message, f"/{name}", got, needed))
    return (
        np.broadcast_to(rows, (count, *rows.shape[1:])),
        np.broadcast_to(other_rows, (count, *other_rows.shape[1:])),
    )
