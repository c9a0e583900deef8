"""Checks of points, weights and degrees, which all kinds of surface make on creation.

The arrays here are rectangular, because `service.schemas` has already checked the nested lists of
the request. Later code relies on these checks and does not repeat them.
"""

from collections.abc import Callable
from math import frexp
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray
from service.errors import MAX_ISSUES, InvalidRequest, Issue, count_nouns, pointer

Up: TypeAlias = Literal["y", "z"]
"""The vertical axis of a model."""

_UPS = get_args(Up)

MAX_DEGREE = 64
"""Highest degree. At higher degrees a control point has hardly any effect on a Bézier patch; a
B-spline of low degree is better."""

MAX_METRES_PER_UNIT = 1e6
"""The largest unit of length, in metres."""

MAX_COORDINATE = float(np.finfo(np.float32).max)
"""Largest coordinate that glTF, STL and PLY can store."""

MAX_WEIGHT_RATIO = 1e8
"""Largest quotient of two weights of one surface. Up to this quotient, float64 keeps half of its
digits near the control points with the least weight, also in normals."""

USUAL_EXPONENT = 64
"""Weights are scaled unless the largest is between 2^-65 and 2^64, so that powers and quotients of
weights stay in the range of float64. Scaling does not change the surface, which depends only on the
quotients of weights."""


def validate_points(
    values: ArrayLike, name: str, axes: int, dimensions: tuple[int, ...] = (3,)
) -> FloatArray:
    """Check points: returns `values` as a read-only array of finite coordinates within float32.

    Parameters
    ----------
    values : array_like, shape (…, d)
    name : str
        The field, for JSON pointers.
    axes : int
        Number of axes, including the axis of coordinates: 2 for a list of points, 3 for a net.
    dimensions : tuple of int
        The allowed numbers of coordinates of a point.

    Returns
    -------
    ndarray of float64, a copy

    Raises
    ------
    InvalidRequest
        `wrong_dimension`, or one issue `not_finite` or `coordinate_too_large` for each invalid
        coordinate, at most `MAX_ISSUES`.
    """
    # −0 becomes 0, so that equal surfaces have equal bytes.
    points = np.add(np.asarray(values, np.float64), 0.0, order="C")
    if points.ndim != axes or points.shape[-1] not in dimensions:
        dimension_text = "exactly three" if dimensions == (3,) else "two or three"
        raise InvalidRequest(
            Issue(
                "wrong_dimension",
                f"A control point has {dimension_text} coordinates.",
                f"/{name}",
                f"an array of shape {_shape_text(points.shape)}",
                f"{axes} axes, three numbers [x, y, z] in the last"
                + (", or two" if 2 in dimensions else ""),
            )
        )
    # Valid points need only this one reduction. The comparison is false for NaN, too.
    if not np.maximum.reduce(np.abs(points), axis=None, initial=0.0) <= MAX_COORDINATE:
        _refuse(points, f"/{name}", ~np.isfinite(points), _not_finite)
        _refuse(points, f"/{name}", np.abs(points) > MAX_COORDINATE, _too_large)
    points.flags.writeable = False
    return points


def validate_weights(values: ArrayLike | None, shape: tuple[int, ...]) -> FloatArray | None:
    """Check weights: returns `values` as a read-only array of finite, positive weights, or None.

    Returns
    -------
    ndarray of float64, a copy
        Multiplied by a power of two, without rounding, if the largest weight is very large or very
        small (`USUAL_EXPONENT`).

    Raises
    ------
    InvalidRequest
        `weights_shape`, `not_finite`, `weight_not_positive` or `weight_ratio`.
    """
    if values is None:
        return None
    weights = np.array(values, dtype=np.float64, order="C")
    if weights.shape != shape:
        raise InvalidRequest(
            Issue(
                "weights_shape",
                "There must be exactly one weight for every control point.",
                "/weights",
                f"an array of shape {_shape_text(weights.shape)}",
                f"shape {_shape_text(shape)}",
            )
        )
    _refuse(weights, "/weights", ~np.isfinite(weights), _not_finite)
    _refuse(weights, "/weights", weights <= 0, _not_positive)
    check_ratio(weights, "/weights")
    exponent = frexp(float(weights.max()))[1]
    if abs(exponent) > USUAL_EXPONENT:
        weights = np.ldexp(weights, -exponent)
    weights.flags.writeable = False
    return weights


def check_ratio(weights: FloatArray, where: str) -> None:
    """Refuse positive weights that differ too much; `where` is the JSON pointer to them."""
    low, high = float(weights.min()), float(weights.max())
    if high > MAX_WEIGHT_RATIO * low:
        raise InvalidRequest(
            Issue(
                "weight_ratio",
                "The weights differ too much: the lighter points would have no effect.",
                where,
                f"a largest weight {high / low:.3g} times the smallest",
                f"at most {MAX_WEIGHT_RATIO:.0e} times",
            )
        )


def check_stored(values: FloatArray, where: str) -> None:
    """Refuse NaN, infinities, and other numbers that single precision cannot store.

    `where` is the JSON pointer to the array.
    """
    _refuse(values, where, ~np.isfinite(values), _not_finite)
    _refuse(values, where, np.abs(values) > MAX_COORDINATE, _too_large)


def check_grid(rows: int, columns: int, name: str) -> None:
    """Refuse a grid of control points that is too small, or whose degree is too high."""
    if rows < 2 or columns < 2:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "A patch needs at least two rows of two control points (degree 1 by 1).",
                f"/{name}",
                f"a grid of {rows} × {columns}",
                "at least 2 × 2",
            )
        )
    if max(rows, columns) - 1 > MAX_DEGREE:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "A net of r × c control points is one patch of degree r − 1 by c − 1. With such a "
                "high degree, no control point shapes the surface; use several patches.",
                f"/{name}",
                f"degree {rows - 1} × {columns - 1}",
                f"degrees up to {MAX_DEGREE}",
            )
        )


def check_triangle(count: int, name: str) -> int:
    """The degree of a triangle with `count` control points.

    Refuses a count that no triangle has, and a degree above `MAX_DEGREE`.
    """
    degree = triangle.degree_or_none(count)
    if degree is None or degree < 1:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "A triangle of degree n has (n + 1)(n + 2)/2 control points, in rows of n + 1, n, "
                "… 1; n is at least 1.",
                f"/{name}",
                count_nouns(count, "control points"),
                "3, 6, 10, 15, …",
            )
        )
    if degree > MAX_DEGREE:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "A triangle of n + 1 rows is one patch of degree n. With such a high degree, no "
                "control point shapes the surface; use several patches.",
                f"/{name}",
                f"degree {degree}",
                f"degrees up to {MAX_DEGREE}",
            )
        )
    return degree


def check_metres_per_unit(metres: float | None) -> None:
    """Refuse a unit of length that is not above 0 and at most `MAX_METRES_PER_UNIT` metres."""
    if metres is not None and not 0 < metres <= MAX_METRES_PER_UNIT:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "A unit of length is a number of metres.",
                "/metres_per_unit",
                f"{metres:.6g}",
                f"above 0, at most {MAX_METRES_PER_UNIT:.0e}",
            )
        )


def check_up(up: str) -> None:
    """Refuse a vertical axis other than "y" and "z"."""
    if up not in _UPS:
        raise InvalidRequest(
            Issue("wrong_value", "`up` is the vertical axis.", "/up", "another text", '"y" or "z"')
        )


def check_uncertainties(values: FloatArray, where: Callable[[int], str]) -> None:
    """Refuse uncertainties that are negative, or that single precision cannot store.

    `where` is the JSON pointer to the value with this number.
    """
    is_wrong = ~((values >= 0) & (values <= MAX_COORDINATE))
    if is_wrong.any():
        raise InvalidRequest(
            *(
                Issue(
                    "out_of_range",
                    "An uncertainty is a distance, within single precision.",
                    where(number),
                    f"{values[number]:.6g}",
                    f"at least 0, at most {MAX_COORDINATE:.7g}",
                )
                for number in np.flatnonzero(is_wrong)[:MAX_ISSUES].tolist()
            )
        )


def _refuse(
    values: FloatArray,
    where: str,
    is_wrong: Bools,
    describe: Callable[[str, float], Issue],
) -> None:
    """Raise one issue for each of the first `MAX_ISSUES` positions where `is_wrong` is true.

    `where` is the JSON pointer to `values`.
    """
    positions = np.argwhere(is_wrong)[:MAX_ISSUES]
    if len(positions):
        raise InvalidRequest(
            *(
                describe(where + pointer(position), float(values[tuple(position)]))
                for position in positions.tolist()
            )
        )


def _not_finite(where: str, value: float) -> Issue:
    return Issue(
        "not_finite",
        "Every number must be finite.",
        where,
        "not a number" if np.isnan(value) else "an infinite number",
        "a finite number",
    )


def _too_large(where: str, value: float) -> Issue:
    return Issue(
        "coordinate_too_large",
        "Coordinates and attributes are stored in single precision.",
        where,
        f"{value:.6g}",
        f"between -{MAX_COORDINATE:.7g} and {MAX_COORDINATE:.7g}",
    )


def _not_positive(where: str, value: float) -> Issue:
    return Issue(
        "weight_not_positive",
        "Weights are positive: only then does the surface stay within its control points.",
        where,
        f"{value:.6g}",
        "a number above 0, or 0 for a point that does not pull and is no corner",
    )


def _shape_text(shape: tuple[int, ...]) -> str:
    return " × ".join(str(n) for n in shape) if shape else "() (a single number)"
