"""Curvatures as quotients of power series along lines from a pole into the patch.

Where S_u × S_v vanishes, the formulas of curvatures are 0/0. Along a line both are power series;
their lowest terms are zero and can be left out.

References
----------
do Carmo, Differential Geometry of Curves and Surfaces, section 3.3.
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.evaluation.degenerate import VANISHING, Direction, trace_inwards
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.points.series import Series, cross_series, dot_series, expand
from service.engine.vectors import dot

MAX_ORDERS = (1, 4)
"""The orders of the zero of S_u × S_v up to which limits are computed: first up to order 1, which
usual poles have, then up to order 4. Since K is a quotient by |S_u × S_v|⁴, a zero of order k takes
4 k + 1 terms."""

MAX_ERROR = 2.0**-20
"""The largest error of a limit that is reported: relative, or in units of the net if the limit is
below 1."""


@dataclass(frozen=True, eq=False, slots=True)
class InwardLines:
    """m lines into patches: line k begins at (u[k], v[k]) of net `patch_numbers[k]`.

    All lines have one direction: along u, along v, or diagonal.
    """

    nets: DerivativeNets
    patch_numbers: Ints
    u: FloatArray
    v: FloatArray
    direction: Direction

    def take(self, rows: Ints) -> "InwardLines":
        """Some of the lines."""
        return replace(self, patch_numbers=self.patch_numbers[rows], u=self.u[rows], v=self.v[rows])

    def order(self) -> FloatArray:
        """The order of the zero of S_u × S_v at the beginning of each line, (m,).

        It is larger than the highest of `MAX_ORDERS` if all terms up to that order vanish. Terms
        that may come from the rounding of control points count as zero: these are the terms for
        which S_u × S_v itself counts as zero.
        """
        su, sv = self.series(MAX_ORDERS[-1] + 1, has_second=False, is_noisy=True)
        order: FloatArray = cross_series(su, sv).first().min(axis=1)
        return order

    def series(
        self, count: int, *, has_second: bool = True, is_noisy: bool = False
    ) -> list[Series]:
        """S_u, S_v and, if `has_second`, S_uu, S_uv, S_vv along the lines: (m, 3, count).

        If `is_noisy`, the control points have errors of `VANISHING` times the largest of them.
        """
        pairs = PARTIALS[: 6 if has_second else 3]
        partials = [self._partial(i, j, count, is_noisy=is_noisy) for i, j in pairs]
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

    def _partial(self, i: int, j: int, count: int, *, is_noisy: bool) -> Series:
        """The partial ∂^{i+j}/∂u^i ∂v^j along the lines, as series of vectors, (m, d, count)."""
        net = self.nets.partial_net(i, j)
        if net is None:
            zero = np.zeros((len(self.patch_numbers), self.nets.point.shape[1], count))
            return Series(zero, zero)
        line = trace_inwards(net, self.patch_numbers, self.u, self.v, self.direction)
        if not is_noisy:
            return expand(line, count)
        largest = np.abs(net).max(axis=(1, 2, 3))[self.patch_numbers]
        return expand(
            line, count, np.repeat(VANISHING * largest[:, np.newaxis], len(net[0]), axis=1)
        )


def compute_curvatures(
    series: list[Series],
    normals: FloatArray,
    distance: FloatArray | float = 0.0,
    *,
    noisy: list[Series] | None = None,
) -> tuple[FloatArray, Bools]:
    """Curvatures K, H, k_1, k_2 at a distance s from poles, (4, m), from series of partials.

    The second result (2, m) says where the limits of K and H are certainly infinite. The errors of
    `noisy`, by default those of `series`, decide which terms vanish.

    Let N = S_u × S_v = c s^k + …, let L, M, P = S_uu · N, S_uv · N, S_vv · N be the second form,
    and E, F, G the first form. Then

        K = (L P − M²)/|N|⁴,  H = (L G − 2 M F + P E)/(2 |N|³)

    The denominators begin with the orders 4 k and 3 k, so a limit is finite only if all lower terms
    of its numerator vanish.
    """
    n, gauss_numerator, mean_numerator = _find_numerators(series)
    noisy_n, noisy_gauss, noisy_mean = (
        (n, gauss_numerator, mean_numerator) if noisy is None else _find_numerators(noisy)
    )
    order = noisy_n.first().min(axis=1)
    # |N|² / s^(2k): `_divide` divides by the powers of s.
    squared_normal, _ = dot_series(n, n).tail(2 * order, distance)
    is_infinite = np.stack([noisy_gauss.first() < 4 * order, noisy_mean.first() < 3 * order])
    gauss, gauss_error = _divide(gauss_numerator, 4 * order, squared_normal**2, distance)
    mean, mean_error = _divide(mean_numerator, 3 * order, 2 * squared_normal**1.5, distance)
    gauss[is_infinite[0]], mean[is_infinite[1]] = np.nan, np.nan
    # The given normal may be the limit along another line, and have the opposite sign.
    direction, _ = n.tail(np.repeat(order[:, np.newaxis], 3, axis=1), 0.0)
    mean = np.where(dot(direction, normals, -1) < 0, -mean, mean)
    # The square of half the difference of k_1 and k_2.
    square = mean**2 - gauss
    uncertainty = 2 * np.abs(mean) * mean_error + gauss_error
    spread = np.sqrt(np.where(square <= uncertainty, 0.0, square))
    return np.stack([gauss, mean, mean + spread, mean - spread]), is_infinite


def _find_numerators(series: list[Series]) -> tuple[Series, Series, Series]:
    """N, and the numerators of K and H, from S_u, S_v, S_uu, S_uv and S_vv."""
    su, sv, suu, suv, svv = series
    n = cross_series(su, sv)
    ell, em, pe = (dot_series(partial, n) for partial in (suu, suv, svv))
    mean = ell * dot_series(sv, sv) - (em * dot_series(su, sv)).times(2) + pe * dot_series(su, su)
    return n, ell * pe - em * em, mean


def _divide(
    numerator: Series, order: FloatArray, denominator: FloatArray, distance: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """The quotient numerator / (denominator s^order), and a bound of its error.

    The quotient is NaN if it is uncertain.
    """
    term, error = numerator.tail(order, distance)
    value, error = term / denominator, error / denominator
    is_uncertain = ~(error <= MAX_ERROR * np.maximum(np.abs(value), 1.0))
    return np.where(is_uncertain, np.nan, value), error
