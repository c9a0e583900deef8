"""Curvatures at and near poles, where S_u × S_v vanishes: quotients of power series.

At a pole the formulas are 0/0, and near a pole numerator and denominator lose digits with the
square of the distance. Along a line from the pole both are power series whose lowest terms are zero
and can be omitted.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine import vectors
from service.engine.evaluation.degenerate import Direction, trace_inwards
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.points.series import Series, cross, dot, expand

ORDERS = (1, 4)
"""Orders of the zero of S_u × S_v up to which limits are computed: first order 1 for usual poles,
then order 4 for the others. Since K is a quotient by |S_u × S_v|⁴, order k takes 4 k + 1 terms."""

NEAR = 2.0**-8
"""Distance from a pole, times the degree, up to which the power series is used."""

NEAR_TERMS = 10
"""Terms of a series near a pole: the error of truncation is of the order of NEAR⁶."""

KNOWN = 2.0**-20
"""A limit with a larger relative error than this, or error in units of the net, is not reported."""


def find_curvatures_near(
    nets: DerivativeNets, which: Ints, u: FloatArray, v: FloatArray, normals: FloatArray
) -> FloatArray:
    """K, H, k_1, k_2 near sides that are one point; NaN on the sides and far from them: (4, m).

    Parameters
    ----------
    which : ndarray of int, shape (m,)
        Rows of `nets`.
    normals : ndarray of float64, shape (m, 3)
        Unit normals, which decide the sign.
    """
    result = np.full((4, len(which)), np.nan)
    distances = np.stack([u, 1 - u, v, 1 - v], axis=1)
    inside = (distances > 0) & (distances <= NEAR / max(nets.degree))
    near = nets.collapsed[which] & inside
    distances = np.where(near, distances, np.inf)
    nearest = distances.argmin(axis=1)
    for side in range(4):
        rows = np.flatnonzero(near.any(axis=1) & (nearest == side))
        if len(rows):
            foot = np.full(len(rows), float(side % 2))
            if side < 2:
                line = Line(nets, which[rows], foot, v[rows], "u")
            else:
                line = Line(nets, which[rows], u[rows], foot, "v")
            series = line.series(NEAR_TERMS)
            result[:, rows] = _quotients(series, normals[rows], distances[rows, side])
    return result


def find_limit_curvatures(
    nets: DerivativeNets, which: Ints, u: FloatArray, v: FloatArray, normals: FloatArray
) -> FloatArray:
    """Limits of K, H, k_1, k_2 where S_u × S_v vanishes, in the scale of the nets: (4, m).

    They are limits along the first line inwards on which that vector does not vanish identically;
    `service.engine.evaluation.degenerate` defines the order of the lines.
    """
    result = np.full((4, len(which)), np.nan)
    is_open = np.ones(len(which), dtype=bool)
    on_u_edge_only = ((u == 0) | (u == 1)) & (v > 0) & (v < 1)
    corner = ((u == 0) | (u == 1)) & ((v == 0) | (v == 1))
    orders: tuple[tuple[Bools, tuple[Direction, ...]], ...] = (
        (~on_u_edge_only, ("v", "u")),
        (on_u_edge_only, ("u", "v")),
        (corner, ("diagonal",)),
    )
    for group, directions in orders:
        for direction in directions:
            rows = np.flatnonzero(group & is_open)
            if not len(rows):
                continue
            order = Line(nets, which[rows], u[rows], v[rows], direction).order()
            is_open[rows[order <= ORDERS[-1]]] = False
            for least, most in pairwise((-1, *ORDERS)):
                block = rows[(order > least) & (order <= most)]
                if len(block):
                    line = Line(nets, which[block], u[block], v[block], direction)
                    result[:, block] = _quotients(line.series(4 * most + 1), normals[block])
    return result


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """Lines inwards from parameters of patches: rows `which` of nets, at (u, v)."""

    nets: DerivativeNets
    which: Ints
    u: FloatArray
    v: FloatArray
    direction: Direction

    def order(self) -> FloatArray:
        """Order of the zero of S_u × S_v at the beginning of each line, up to the highest order."""
        su, sv = self.series(ORDERS[-1] + 1, second=False)
        order: FloatArray = cross(su, sv).first().min(axis=1)
        return order

    def series(self, count: int, *, second: bool = True) -> list[Series]:
        """S_u, S_v and, with `second`, S_uu, S_uv, S_vv along the lines: vectors (m, 3, T)."""
        partials = [self._partial(i, j, count) for i, j in PARTIALS[: 6 if second else 3]]
        if not self.nets.rational:
            return partials[1:]
        x, w = [f.axes(slice(0, 3)) for f in partials], [f.axes(slice(3, 4)) for f in partials]
        s = x[0] / w[0]
        su = (x[1] - w[1] * s) / w[0]
        sv = (x[2] - w[2] * s) / w[0]
        if not second:
            return [su, sv]
        suu = (x[3] - w[3] * s - (w[1] * su).times(2)) / w[0]
        suv = (x[4] - w[4] * s - w[1] * sv - w[2] * su) / w[0]
        svv = (x[5] - w[5] * s - (w[2] * sv).times(2)) / w[0]
        return [su, sv, suu, suv, svv]

    def _partial(self, i: int, j: int, count: int) -> Series:
        net = self.nets.partial_net(i, j)
        if net is None:
            zero = np.zeros((len(self.which), self.nets.point.shape[1], count))
            return Series(zero, zero)
        return expand(trace_inwards(net, self.which, self.u, self.v, self.direction), count)


def _quotients(
    series: list[Series], normals: FloatArray, distance: FloatArray | float = 0.0
) -> FloatArray:
    """K, H, k_1, k_2 at a distance s from poles: (4, m).

    With N = S_u × S_v = c s^k + …, the second form L, M, P = S_uu · N, S_uv · N, S_vv · N and the
    first form E, F, G

        K = (L P − M²)/|N|⁴,  H = (L G − 2 M F + P E)/(2 |N|³)

    so the quotients begin with the terms of order 4k and 3k of the numerators.
    """
    su, sv, suu, suv, svv = series
    n = cross(su, sv)
    order = n.first().min(axis=1)
    ell, em, pe = (dot(second, n) for second in (suu, suv, svv))
    square, _ = dot(n, n).tail(2 * order, distance)
    gauss, gauss_error = _quotient(ell * pe - em * em, 4 * order, square**2, distance)
    mean, mean_error = _quotient(
        ell * dot(sv, sv) - (em * dot(su, sv)).times(2) + pe * dot(su, su),
        3 * order,
        2 * square**1.5,
        distance,
    )
    # The given normal may be the limit along another line, on the other side.
    lead, _ = n.tail(np.repeat(order[:, np.newaxis], 3, axis=1), 0.0)
    mean = np.where(vectors.dot(lead, normals) < 0, -mean, mean)
    spread = mean**2 - gauss
    uncertainty = 2 * np.abs(mean) * mean_error + gauss_error
    spread = np.sqrt(np.where(spread <= uncertainty, 0.0, spread))
    return np.stack([gauss, mean, mean + spread, mean - spread])


def _quotient(
    numerator: Series, order: FloatArray, denominator: FloatArray, distance: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Numerator / (denominator s^order), NaN if its limit is infinite or uncertain; the error."""
    term, error = numerator.tail(order, distance)
    value, error = term / denominator, error / denominator
    infinite = numerator.first() < order
    unknown = ~(error <= KNOWN * np.maximum(np.abs(value), 1.0))
    return np.where(infinite | unknown, np.nan, value), error
