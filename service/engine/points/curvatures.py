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

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.evaluation.degenerate import Direction, choose_directions, trace_inwards
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.points.series import Series, cross_series, dot_series, expand
from service.engine.vectors import cross, dot, length

MAX_ORDERS = (1, 4)
"""The orders of the zero of S_u × S_v up to which limits are computed: first up to order 1, which
usual poles have, then up to order 4. Since K is a quotient by |S_u × S_v|⁴, a zero of order k takes
4 k + 1 terms."""

MAX_DISTANCE = 2.0**-8
"""Up to this distance from a pole, divided by the degree, the power series is used; the distance is
a difference of u or of v."""

NEAR_TERMS = 10
"""The number of terms of a series near a pole. Where S_u × S_v has a zero of order 1, the first 4
terms of the numerator of K vanish. The other 6 remain; so the error of truncation is of the order
of MAX_DISTANCE⁶."""

MAX_ERROR = 2.0**-20
"""The largest error of a limit that is reported: relative, or in units of the net if the limit is
below 1."""


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
                _InwardLines(nets, patch_numbers[rows], at_side, v[rows], "u")
                if side < 2
                else _InwardLines(nets, patch_numbers[rows], u[rows], at_side, "v")
            )
            series = lines.series(NEAR_TERMS)
            result[:, rows] = _compute_curvatures(series, normals[rows], distances[rows, side])
    return result


def _find_limits(
    nets: DerivativeNets, patch_numbers: Ints, uv: FloatArray, normals: FloatArray
) -> FloatArray:
    """Limits of K, H, k_1, k_2 where S_u × S_v vanishes, in the scale of the nets: (4, m).

    They are limits along the first line into the patch on which S_u × S_v does not vanish
    everywhere; `service.engine.evaluation.degenerate` defines the order of the lines.
    """
    u, v = uv
    result = np.full((4, len(patch_numbers)), np.nan)
    is_unresolved = np.ones(len(patch_numbers), dtype=bool)
    for group, directions in choose_directions(u, v):
        for direction in directions:
            rows = np.flatnonzero(group & is_unresolved)
            if not len(rows):
                continue
            order = _InwardLines(nets, patch_numbers[rows], u[rows], v[rows], direction).order()
            is_unresolved[rows[order <= MAX_ORDERS[-1]]] = False
            for lower_order, upper_order in pairwise((-1, *MAX_ORDERS)):
                block = rows[(order > lower_order) & (order <= upper_order)]
                if len(block):
                    lines = _InwardLines(nets, patch_numbers[block], u[block], v[block], direction)
                    result[:, block] = _compute_curvatures(
                        lines.series(4 * upper_order + 1), normals[block]
                    )
    return result


@dataclass(frozen=True, eq=False, slots=True)
class _InwardLines:
    """m lines into patches: line k begins at (u[k], v[k]) of net `patch_numbers[k]`.

    All lines have one direction: along u, along v, or diagonal.
    """

    nets: DerivativeNets
    patch_numbers: Ints
    u: FloatArray
    v: FloatArray
    direction: Direction

    def order(self) -> FloatArray:
        """The order of the zero of S_u × S_v at the beginning of each line, (m,).

        It is larger than the highest of `MAX_ORDERS` if all terms up to that order vanish.
        """
        su, sv = self.series(MAX_ORDERS[-1] + 1, has_second=False)
        order: FloatArray = cross_series(su, sv).first().min(axis=1)
        return order

    def series(self, count: int, *, has_second: bool = True) -> list[Series]:
        """S_u, S_v and, if `has_second`, S_uu, S_uv, S_vv along the lines: (m, 3, count)."""
        partials = [self._partial(i, j, count) for i, j in PARTIALS[: 6 if has_second else 3]]
        if not self.nets.is_rational:
            return partials[1:]
        x, w = [f.axes(slice(0, 3)) for f in partials], [f.axes(slice(3, 4)) for f in partials]
        s = x[0] / w[0]
        su = (x[1] - w[1] * s) / w[0]
        sv = (x[2] - w[2] * s) / w[0]
        if not has_second:
            return [su, sv]
        suu = (x[3] - w[3] * s - (w[1] * su).times(2)) / w[0]
        suv = (x[4] - w[4] * s - w[1] * sv - w[2] * su) / w[0]
        svv = (x[5] - w[5] * s - (w[2] * sv).times(2)) / w[0]
        return [su, sv, suu, suv, svv]

    def _partial(self, i: int, j: int, count: int) -> Series:
        """The partial ∂^{i+j}/∂u^i ∂v^j along the lines, as series of vectors, (m, d, count)."""
        net = self.nets.partial_net(i, j)
        if net is None:
            zero = np.zeros((len(self.patch_numbers), self.nets.point.shape[1], count))
            return Series(zero, zero)
        return expand(trace_inwards(net, self.patch_numbers, self.u, self.v, self.direction), count)


def _compute_curvatures(
    series: list[Series], normals: FloatArray, distance: FloatArray | float = 0.0
) -> FloatArray:
    """Curvatures K, H, k_1, k_2 at a distance s from poles, (4, m), from series of partials.

    Let N = S_u × S_v = c s^k + …, let L, M, P = S_uu · N, S_uv · N, S_vv · N be the second form,
    and E, F, G the first form. Then

        K = (L P − M²)/|N|⁴,  H = (L G − 2 M F + P E)/(2 |N|³)

    The denominators begin with the orders 4 k and 3 k, so a limit is finite only if all lower terms
    of its numerator vanish.
    """
    su, sv, suu, suv, svv = series
    n = cross_series(su, sv)
    order = n.first().min(axis=1)
    ell, em, pe = (dot_series(partial, n) for partial in (suu, suv, svv))
    # |N|² / s^(2k): `_divide` divides by the powers of s.
    squared_normal, _ = dot_series(n, n).tail(2 * order, distance)
    gauss, gauss_error = _divide(ell * pe - em * em, 4 * order, squared_normal**2, distance)
    mean, mean_error = _divide(
        ell * dot_series(sv, sv) - (em * dot_series(su, sv)).times(2) + pe * dot_series(su, su),
        3 * order,
        2 * squared_normal**1.5,
        distance,
    )
    # The given normal may be the limit along another line, and have the opposite sign.
    direction, _ = n.tail(np.repeat(order[:, np.newaxis], 3, axis=1), 0.0)
    mean = np.where(dot(direction, normals, -1) < 0, -mean, mean)
    # The square of half the difference of k_1 and k_2.
    square = mean**2 - gauss
    uncertainty = 2 * np.abs(mean) * mean_error + gauss_error
    spread = np.sqrt(np.where(square <= uncertainty, 0.0, square))
    return np.stack([gauss, mean, mean + spread, mean - spread])


def _divide(
    numerator: Series, order: FloatArray, denominator: FloatArray, distance: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """The quotient numerator / (denominator s^order), and a bound of its error.

    The quotient is NaN if its limit is infinite or uncertain.
    """
    term, error = numerator.tail(order, distance)
    value, error = term / denominator, error / denominator
    is_infinite = numerator.first() < order
    is_uncertain = ~(error <= MAX_ERROR * np.maximum(np.abs(value), 1.0))
    return np.where(is_infinite | is_uncertain, np.nan, value), error
