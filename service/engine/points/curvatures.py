"""Gaussian, mean and principal curvatures from partials: by formulas, and as limits at poles.

The second form S_uu · n, S_uv · n, S_vv · n has the unit normal n along S_u × S_v. So a curvature
is positive where the surface bends towards its normal. A sphere of radius r whose normals point
outwards has K = 1/r² and H = −1/r.

At a pole, where S_u × S_v vanishes, the formulas of curvatures are 0/0. Near a pole, numerator and
denominator have relative errors that grow as the inverse square of the distance. Along a line from
the pole, both are power series; their lowest terms are zero and can be left out.

References
----------
do Carmo, Differential Geometry of Curves and Surfaces, section 3.3.
"""

from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.evaluation.degenerate import Direction, choose_directions
from service.engine.evaluation.nets import DerivativeNets
from service.engine.points.curvature_series import MAX_ORDERS, InwardLines, compute_curvatures
from service.engine.vectors import cross, dot, length

MAX_DISTANCE = 2.0**-8
"""Up to this distance from a pole, divided by the degree, the power series is used; the distance is
a difference of u or of v."""

NEAR_TERMS = 10
"""The number of terms of a series near a pole. Where S_u × S_v has a zero of order 1, the first 4
terms of the numerator of K vanish. The other 6 remain; so the error of truncation is of the order
of MAX_DISTANCE⁶."""

EQUAL_LIMITS = 2.0**-18
"""The largest difference of limits along two lines that count as one: relative, or in units of the
net if the limits are below 1. It is twice the difference that two errors of `MAX_ERROR`
(`curvature_series`) make."""


def find_regular_curvatures(partials: FloatArray, normals: FloatArray) -> FloatArray:
    """Curvatures K, H, k_1, k_2, shape (4, m), from the second form in an orthonormal frame.

    With e_1 along S_u and e_2 = n × e_1 the form has the matrix (a b; b c), and

        K = a c − b²,  H = (a + c)/2,  k = H ± √(((a − c)/2)² + b²)

    At umbilics this formula loses no digits, unlike √(H² − K). The result is not finite where
    S_u × S_v vanishes.

    Parameters
    ----------
    partials : ndarray of float64, shape (6, m, 3)
        S, S_u, S_v, S_uu, S_uv and S_vv.
    normals : ndarray of float64, shape (m, 3)
        The unit normals n.
    """
    _, du, dv, duu, duv, dvv = partials
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        length_u, length_v = (length(d, -1)[:, np.newaxis] for d in (du, dv))
        along_u, along_v = du / length_u, dv / length_v
        cosine = dot(along_u, along_v, -1)
        sine = length(cross(along_u, along_v, -1), -1)
        # The form of the unit vectors along S_u and S_v has the matrix (a f; f g). There are two
        # divisions, because the product of two lengths may underflow.
        a = dot(duu / length_u / length_u, normals, -1)
        f = dot(duv / length_u / length_v, normals, -1)
        g = dot(dvv / length_v / length_v, normals, -1)
        b = (f - cosine * a) / sine
        c = (g - cosine * (f + sine * b)) / (sine * sine)
        mean = (a + c) / 2
        spread = np.hypot((a - c) / 2, b)
        return np.stack([a * c - b * b, mean, mean + spread, mean - spread])


def find_pole_curvatures(
    nets: DerivativeNets, patch_numbers: Ints, uv: FloatArray, normals: FloatArray, is_pole: Bools
) -> FloatArray:
    """Curvatures K, H, k_1, k_2 at and near poles, in the scale of the nets: (4, m).

    They are limits where `is_pole` (m,) is true, series near sides that are one point, and NaN
    elsewhere, and where a limit is infinite or uncertain.

    Parameters
    ----------
    patch_numbers : ndarray of int, shape (m,)
        The patch of each parameter in `nets`.
    uv : ndarray of float64, shape (2, m)
    normals : ndarray of float64, shape (m, 3)
        Unit normals, which decide the sign.
    """
    result = _find_curvatures_near(nets, patch_numbers, uv, normals)
    rows = np.flatnonzero(is_pole)
    if len(rows):
        limits = _find_limits(nets, patch_numbers[rows], uv[:, rows], normals[rows])
        result[:, rows] = np.where(np.isnan(result[:, rows]), limits, result[:, rows])
    return result


def _find_curvatures_near(
    nets: DerivativeNets, patch_numbers: Ints, uv: FloatArray, normals: FloatArray
) -> FloatArray:
    """Curvatures near sides that are one point, (4, m); NaN on these sides and far from them."""
    u, v = uv
    result = np.full((4, len(patch_numbers)), np.nan)
    distances = np.stack([u, 1 - u, v, 1 - v], axis=1)
    is_inside = (distances > 0) & (distances <= MAX_DISTANCE / max(nets.degree))
    is_near = nets.collapsed[patch_numbers] & is_inside
    distances = np.where(is_near, distances, np.inf)
    nearest = distances.argmin(axis=1)
    for side in range(4):
        rows = np.flatnonzero(is_near.any(axis=1) & (nearest == side))
        if len(rows):
            at_side = np.full(len(rows), float(side % 2))
            lines = (
                InwardLines(nets, patch_numbers[rows], at_side, v[rows], "u")
                if side < 2
                else InwardLines(nets, patch_numbers[rows], u[rows], at_side, "v")
            )
            series = lines.series(NEAR_TERMS)
            result[:, rows], _ = compute_curvatures(series, normals[rows], distances[rows, side])
    return result


def _find_limits(
    nets: DerivativeNets, patch_numbers: Ints, uv: FloatArray, normals: FloatArray
) -> FloatArray:
    """Limits of K, H, k_1, k_2 where S_u × S_v vanishes, in the scale of the nets: (4, m).

    They are limits along the first line into the patch on which S_u × S_v does not vanish
    everywhere; `service.engine.evaluation.degenerate` defines the order of the lines. A limit that
    differs along another line is NaN. On a side that is one point, without its ends, one
    line is enough: powers of the distance from the side cancel, and the rest is continuous.
    """
    u, v = uv
    result = np.full((4, len(patch_numbers)), np.nan)
    is_unresolved = np.ones(len(patch_numbers), dtype=bool)
    for group, directions in choose_directions(u, v):
        for direction in directions:
            rows = np.flatnonzero(group & is_unresolved)
            if len(rows):
                limits, _, has_order = _find_limits_along(
                    InwardLines(nets, patch_numbers[rows], u[rows], v[rows], direction),
                    normals[rows],
                )
                is_unresolved[rows[has_order]] = False
                result[:, rows[has_order]] = limits[:, has_order]
    rows = np.flatnonzero(~is_unresolved & ~_is_inside_pole(nets, patch_numbers, u, v))
    rows = rows[np.isfinite(result[:2, rows]).any(axis=0)]
    directions_of_all: tuple[Direction, ...] = ("v", "u", "diagonal")
    for direction in directions_of_all if len(rows) else ():
        lines = InwardLines(nets, patch_numbers[rows], u[rows], v[rows], direction)
        limits, is_infinite, _ = _find_limits_along(lines, normals[rows])
        result[:, rows] = _keep_equal_limits(result[:, rows], limits, is_infinite)
    return result


def _find_limits_along(lines: InwardLines, normals: FloatArray) -> tuple[FloatArray, Bools, Bools]:
    """Limits of K, H, k_1, k_2 at the beginnings of lines, (4, m); NaN if not finite or uncertain.

    The second result (2, m) says where those of K and H are certainly infinite, the third (m,)
    whether S_u × S_v has a zero of at most the highest of `MAX_ORDERS`; otherwise nothing is known.
    """
    count = len(lines.patch_numbers)
    limits, is_infinite = np.full((4, count), np.nan), np.zeros((2, count), dtype=bool)
    order = lines.order()
    for lower_order, upper_order in pairwise((-1, *MAX_ORDERS)):
        rows = np.flatnonzero((order > lower_order) & (order <= upper_order))
        if len(rows):
            chosen, count = lines.take(rows), 4 * upper_order + 1
            limits[:, rows], is_infinite[:, rows] = compute_curvatures(
                chosen.series(count), normals[rows], noisy=chosen.series(count, is_noisy=True)
            )
    return limits, is_infinite, np.asarray(order <= MAX_ORDERS[-1])


def _is_inside_pole(
    nets: DerivativeNets, patch_numbers: Ints, u: FloatArray, v: FloatArray
) -> Bools:
    """Which places (m,) are on a side that is one point, but not at its ends."""
    on_side = np.stack([u == 0, u == 1, v == 0, v == 1], axis=1)
    is_pole = (on_side & nets.collapsed[patch_numbers]).any(axis=1)
    is_inside: Bools = is_pole & (on_side.sum(axis=1) == 1)
    return is_inside


def _keep_equal_limits(limits: FloatArray, others: FloatArray, is_infinite: Bools) -> FloatArray:
    """The limits (4, m) along a line; NaN where those along another line are certainly others.

    `is_infinite` (2, m) says where the other limits of K and H are infinite.
    """
    gap = np.abs(limits[:2] - others[:2])
    size = np.maximum(np.maximum(np.abs(limits[:2]), np.abs(others[:2])), 1.0)
    has_gauss, has_mean = ~((gap > EQUAL_LIMITS * size) | is_infinite)
    return np.where(np.stack([has_gauss, has_mean, *[has_gauss & has_mean] * 2]), limits, np.nan)
