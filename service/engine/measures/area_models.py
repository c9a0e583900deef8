"""Areas over boxes of parameters: where |S_u × S_v| is analytic if both parameters are complex.

With weights w and N = S_u × S_v, |N| = √G / w with G = w² |N|², which is nearly constant on the
surfaces of CAD systems: on cylinders, cones, spheres and tori it is a polynomial of cosines. The
Chebyshev coefficients of G of low degree come from values at Chebyshev nodes. Those of higher
degree are bounded by the largest |G| on larger ellipses.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from math import pi

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.bases.cache import BASES
from service.engine.measures.border_curves import grow_chebyshev
from service.engine.measures.box_nets import BoxNets, combine, order_cells
from service.engine.measures.cells import UPWARDS, Net, along
from service.engine.measures.quadrature import bound_rounding
from service.engine.vectors import UNIT, cross, dot

MOST = 10
"""The highest degree of coefficients that are computed."""

OUTER = np.array([3.0, 6, 12, 30])
"""The ρ of the larger ellipses, along the axis of the coefficients."""

WIDER = 1.5
"""Along the other axis, the larger ellipses have a ρ this much greater."""


class AreaModels:
    """The functions G over K boxes."""

    def __init__(self, nets: BoxNets) -> None:
        self._nets = nets
        factor = 2 if nets.w is None else 6
        # The degree of the numerator of G, which is G without weights.
        degrees = [2 * (factor // 2 * n - 1) + 2 * (nets.w is not None) for n in nets.degree]
        self._is_cut = [nets.w is not None or degree > MOST for degree in degrees]
        self.counts = [min(degree, MOST) + 1 for degree in degrees]
        values = self._evaluate()
        largest_normal = np.prod(nets.stretches, axis=0) * UPWARDS
        # The angles of nodes are off by up to 2 π n units of rounding.
        shifts = np.full((2, len(nets.x.error)), 16 * max(self.counts) * UNIT)
        error = bound_rounding(nets, "size", max(self.counts), shifts)[0]
        error = (2 * largest_normal + error) * error + 64 * UNIT * largest_normal**2
        # A product with each matrix at most doubles errors, and rounds.
        rounding = 64 * (sum(self.counts) + 4) * UNIT * values.max(axis=(0, 1))
        self._error = 4 * error + rounding
        coefficients = along(_transform(self.counts[0]), values[np.newaxis], 0)
        coefficients = along(_transform(self.counts[1]), coefficients, 1)[0]
        self._constant = coefficients[0, 0].copy()
        coefficients[0, 0] = 0.0
        self._coefficients = order_cells(np.abs(coefficients) + self._error)

    def bound(self, axis_u: FloatArray, axis_v: FloatArray) -> FloatArray:
        """Bounds of |√G / w| on ellipses with these half axes, (R, K), where it is analytic.

        NaN or infinite elsewhere.
        """
        powers = [
            grow_chebyshev(axis, max(count - 1, degree))
            for axis, count, degree in zip(
                (axis_u, axis_v), self.counts, self._nets.degree, strict=True
            )
        ]
        total = combine(self._coefficients, *powers)
        # Coefficients of higher degree count twice: they are also a part of the computed ones.
        change = (total + 2 * self._bound_tail(axis_u, axis_v)) * UPWARDS
        is_analytic = change < self._constant * (1 - 2.0**-30)
        root = np.sqrt(np.where(is_analytic, self._constant + change, np.nan))
        if self._nets.w is None:
            return np.asarray(root * UPWARDS)
        return np.asarray(root / self._bound_weight(powers[0], powers[1]) * UPWARDS)

    def _evaluate(self) -> FloatArray:
        """G at Chebyshev nodes, (i, j, K)."""
        nets = self._nets

        def at_nodes(net: Net) -> FloatArray:
            rows, columns = net.values.shape[1:3]
            values = along(_basis(rows - 1, self.counts[0]), net.values, 0)
            return along(_basis(columns - 1, self.counts[1]), values, 1)

        partials = [at_nodes(net) for net in nets.x_partials]
        if nets.w is None:
            normal = cross(partials[0], partials[1], -4)
            return dot(normal, normal, -4)
        w = at_nodes(nets.w)
        position = at_nodes(nets.x) / w
        # These are w S_u and w S_v.
        w_s_u, w_s_v = (
            step - position * at_nodes(net)
            for step, net in zip(partials, nets.w_partials, strict=True)
        )
        normal = cross(w_s_u, w_s_v, -4) / w
        return dot(normal, normal, -4)

    def _bound_tail(self, axis_u: FloatArray, axis_v: FloatArray) -> FloatArray:
        """Bounds of Σ |c_kl| |T_k T_l| over all coefficients that are not computed, (R, K)."""
        axes = [number for number in range(2) if self._is_cut[number]]
        if not axes:
            return np.zeros_like(axis_u)
        # |c_kl| ≤ 4 M r^−k s^−l and |T_k T_l| ≤ ρ^k σ^l: sums of powers of ρ / r and of σ / s.
        radii = np.array([axis + np.sqrt(axis * axis - 1) for axis in (axis_u, axis_v)])
        # Pairs of one of the R′ outer ellipses along a cut axis, and one of the R ellipses.
        shape = (len(axes), len(OUTER), *axis_u.shape)
        outer = np.empty((2, *shape))
        for row, axis in enumerate(axes):
            outer[axis, row] = OUTER[:, np.newaxis, np.newaxis]
            outer[1 - axis, row] = WIDER * UPWARDS * radii[1 - axis]
        largest = self._bound_values(*outer.reshape(2, -1, shape[-1])).reshape(shape)
        share = np.minimum(radii[axes][:, np.newaxis] / OUTER[:, None, None] * UPWARDS, 1.0)
        counts = np.array(self.counts)[axes].reshape(-1, 1, 1, 1)
        with np.errstate(divide="ignore"):
            bound = 4 / (1 - share) / (1 - 1 / WIDER) * largest * share**counts * UPWARDS
        total: FloatArray = np.where(np.isnan(bound), np.inf, bound).min(axis=1).sum(axis=0)
        return total

    def _bound_values(self, radius_u: FloatArray, radius_v: FloatArray) -> FloatArray:
        """Bounds of |G| on ellipses with these ρ, (R, K); NaN where w may be 0."""
        nets = self._nets
        axes = [(radius + 1 / radius) / 2 * UPWARDS for radius in (radius_u, radius_v)]
        powers = [grow_chebyshev(axis, n) for axis, n in zip(axes, nets.degree, strict=True)]

        def norm(net: Net) -> FloatArray:
            return nets.bound_norm(net, powers[0], powers[1])

        x_u, x_v = (norm(net) for net in nets.x_partials)
        if nets.w is None:
            return np.asarray(np.square(x_u * x_v) * UPWARDS)
        # w³ N = w X_u × X_v − w_u X × X_v − w_v X_u × X
        x, w = norm(nets.x), norm(nets.w)
        w_u, w_v = (norm(net) for net in nets.w_partials)
        normal = w * x_u * x_v + x * (w_u * x_v + x_u * w_v)
        least = self._bound_weight(powers[0], powers[1])
        return np.asarray(np.square(normal / (least * least)) * UPWARDS)

    def _bound_weight(self, powers_u: FloatArray, powers_v: FloatArray) -> FloatArray:
        """Lower bounds of |w| where these bound Chebyshev polynomials; NaN if it may be 0."""
        assert self._nets.w is not None
        spread = self._nets.spread(self._nets.w, powers_u, powers_v)
        least: FloatArray = spread.value[0] - spread.deviation * UPWARDS
        least[~(least > 0)] = np.nan
        return least


def _angles(count: int) -> FloatArray:
    """The angles φ_j = (j + ½) π / N of the N Chebyshev nodes (1 + cos φ_j) / 2."""
    return np.asarray((np.arange(count) + 0.5) * (pi / count))


def _basis(degree: int, count: int) -> FloatArray:
    """The Bernstein basis at Chebyshev nodes, (count, degree + 1)."""
    return BASES.array(
        ("basis at Chebyshev nodes", degree, count),
        lambda: bernstein(degree, (1 + np.cos(_angles(count))) / 2),
    )


def _transform(count: int) -> FloatArray:
    """The matrix from values at Chebyshev nodes to Chebyshev coefficients, (count, count)."""

    def build() -> FloatArray:
        matrix = np.cos(np.arange(count)[:, np.newaxis] * _angles(count)) * (2 / count)
        matrix[0] /= 2
        return np.asarray(matrix)

    return BASES.array(("Chebyshev transform", count), build)
