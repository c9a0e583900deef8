"""Strips: ruled surfaces that close the gaps between borders of faces and edges.

Between P = S(c(t)) on a surface and the point E(t) of an edge at the same parameter, a strip is
X = P + s (E − P), 0 ≤ s ≤ 1. With d = E − P its flux, and its moment, about the origin are

    ∫ P · (d × (P′ + E′) / 2) dt       ∫ P (a + b/2) + d (a/2 + b/3) dt
    a = P · (d × P′),  b = P · (d × d′)

Proof in docs/proofs.md: "Closing the gaps of edges".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.measures.border_curves import RADII, BorderCurves, bound_powers, grow_chebyshev
from service.engine.measures.box_nets import BoxNets, MeasuredPatches
from service.engine.measures.cells import UPWARDS, build_halving_matrix, lengths
from service.engine.measures.panels import evaluate_net, find_bases, widen_boxes
from service.engine.measures.patch_cells import CHUNK
from service.engine.measures.quadrature import (
    Integrand,
    basis_at_nodes,
    bound_value_errors,
    weights_at_nodes,
)
from service.engine.measures.remainders import bound_spreads, chebyshev
from service.engine.vectors import UNIT, Items, cross, dot


@dataclass(frozen=True, eq=False, slots=True)
class StripRows(Items):
    """K strips between curves c of degree k and edges of degree n.

    Attributes
    ----------
    curves : ndarray of float64, shape (2, k+1, K), or (3, k+1, K) if rational
        As in `PanelRows`.
    edges : ndarray of float64, shape (4, n+1, K)
        Homogeneous nets (w x, w y, w z, w) of the edges.
    gaps : ndarray of float64, shape (K,)
        Bounds of |E − P|, or infinity.
    row, patch, depth : ndarray of int, shape (K,)
        As in `PanelRows`.
    side : ndarray of float64, shape (K,)
        As in `PanelRows`.
    """

    curves: FloatArray
    edges: FloatArray
    gaps: FloatArray
    row: Ints
    patch: Ints
    side: FloatArray
    depth: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """Strips beside patches of one degree."""

    patches: MeasuredPatches
    rows: StripRows

    @property
    def patch(self) -> Ints:
        """The face for whose sums each strip counts, (K,)."""
        return self.rows.patch

    @property
    def size(self) -> int:
        """Number of control points of all strips."""
        p, q = self.patches.degree
        curves = int(self.rows.curves.shape[1] + self.rows.edges.shape[1])
        return len(self) * ((p + 1) * (q + 1) + curves)

    def __len__(self) -> int:
        return len(self.rows.patch)

    def take(self, index: Ints | Bools | slice) -> "Strips":
        """The strips with these indices, or those that a mask marks."""
        return Strips(self.patches, self.rows.take(index))

    @classmethod
    def join(cls, parts: Sequence["Strips"]) -> "Strips":
        """The strips of several records of the same patches."""
        return cls(parts[0].patches, StripRows.join([part.rows for part in parts]))

    def halve(self, _: int) -> "Strips":
        """Both halves of every strip, along t: first halves come first."""
        rows = self.rows
        curves, edges = (
            (build_halving_matrix(nets.shape[1] - 1) @ nets).reshape(
                len(nets), 2, nets.shape[1], -1
            )
            for nets in (rows.curves, rows.edges)
        )
        halves = [
            replace(
                rows,
                curves=np.ascontiguousarray(curves[:, half]),
                edges=np.ascontiguousarray(edges[:, half]),
                depth=rows.depth + 1,
            )
            for half in range(2)
        ]
        return Strips(self.patches, StripRows.join(halves))

    def bound_gaps(self) -> FloatArray:
        """Bounds of |E − P| over each strip, (K,)."""
        parts: list[FloatArray] = [
            _LocalStrips(self.patches, self.rows.take(rows)).bound_real()[1]
            for rows in self.chunks(1)
        ]
        return np.concatenate(parts)

    def find_exact_rule(self, _: Integrand) -> int:
        """No rule is exact."""
        return 0

    def chunks(self, count: int) -> list[slice]:
        """Runs of strips whose arrays fit the cache."""
        p, q = self.patches.degree
        step = max(1, CHUNK // (4 * max(4 * count, (p + 1) * (q + 1))))
        return [slice(k, k + step) for k in range(0, len(self), step)]

    def bound_remainders(self, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
        """Bounds of the errors of rules of `count` nodes; strips are halved along t alone."""
        assert integrand == "flux"
        errors = _LocalStrips(self.patches, self.rows, rounded=True).bound_remainders(count)
        return errors, np.ones(len(self), bool)

    def apply_rule(self, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
        """Sums by rules of `count` nodes, and bounds of their rounding."""
        assert integrand == "flux"
        return _LocalStrips(self.patches, self.rows).apply_rule(count)


class _LocalStrips:
    """A few strips, with the nets over the boxes about their curves."""

    def __init__(self, patches: MeasuredPatches, rows: StripRows, *, rounded: bool = False) -> None:
        self.rows = rows
        w = rows.curves[2] if len(rows.curves) > 2 else None
        points = rows.curves[:2] if w is None else rows.curves[:2] / w
        low, high = widen_boxes(np.array([points.min(axis=1), points.max(axis=1)]))
        width = high - low
        self.nets: BoxNets = patches.restrict(rows.row, low, high, rounded=rounded)
        one = 1.0 if w is None else w
        x, y = ((rows.curves[k] - low[k] * one) / width[k] for k in range(2))
        moved = rows.depth * ((4 * len(x) + 8) * UNIT)
        self.curves = BorderCurves(
            np.stack([x, x]), y, w, np.asarray((moved + 8 * UNIT) * (1 + 1 / width))
        )
        # Edges about the middles of their control points, as far as nets of curves go.
        weights = rows.edges[3]
        self.middle = (rows.edges[:3] / weights).mean(axis=1)
        self.edges = rows.edges[:3] - self.middle[:, np.newaxis] * weights
        self.weights = weights
        self.edge_error = (rows.depth * (2 * len(weights) + 6) + 64) * UNIT

    @cached_property
    def least_weight(self) -> FloatArray:
        """Lower bounds of the weights of edges, (K,)."""
        return np.asarray(self.weights.min(axis=0) * (1 - 2.0**-30))

    def bound_remainders(self, count: int) -> FloatArray:
        """Bounds of the errors of the flux and of the moment, (2, K)."""
        with np.errstate(all="ignore"):
            factors = 32 / 15 * UPWARDS * RADII ** (-2.0 * count) / (1 - RADII**-2.0)
            largest = self._bound_integrands() * factors[:, np.newaxis] * UPWARDS
            remainders = np.where(np.isfinite(largest), largest, np.inf).min(axis=1)
        distance, apart, steps = self.bound_real()
        flux = distance * apart * steps
        limits = 2 * UPWARDS * np.stack([flux, flux * (distance + apart)])
        return np.asarray(np.minimum(remainders, limits))

    def bound_real(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Bounds (K,) of |P|, of |E − P|, and of |P′| and |E′| for real parameters."""
        nets, curves, k = self.nets, self.curves, len(self.weights) - 1
        distance = (lengths(nets.center) + nets.radius) * UPWARDS
        reach = lengths(self.edges).max(axis=0) / self.least_weight
        apart = lengths(self.middle - nets.center) + nets.radius + reach
        apart = np.minimum(apart, self.rows.gaps) * UPWARDS
        along = (np.stack(nets.stretches) * curves.steepness).sum(axis=0)
        edge = k * lengths(np.diff(self.edges, axis=1)).max(axis=0)
        edge = edge + reach * k * np.abs(np.diff(self.weights, axis=0)).max(axis=0)
        steps: FloatArray = np.maximum(along, edge / self.least_weight) * UPWARDS
        return distance, apart, steps

    def _bound_integrands(self) -> FloatArray:
        """Bounds (2, R, K) of the integrands of flux and moment if t is complex."""
        nets, curves = self.nets, self.curves
        n = max(nets.degree)
        powers = [grow_chebyshev(axis, n) for axis in curves.find_axes()]
        spread = partial(nets.spread, powers_u=powers[0], powers_v=powers[1])
        partials, radius = bound_spreads(nets, spread)
        s_u, s_v = (lengths(each.value) + each.deviation for each in partials)
        slopes = curves.find_slopes()
        along = s_u * slopes[0].largest + s_v * slopes[1].largest
        # The edge: |E − e| and |E′| from the norms of X = w (E − e), of w and their derivatives.
        degree = len(self.weights) - 1
        matrices = chebyshev(degree), chebyshev(max(degree - 1, 0))
        growth = bound_powers(degree)

        def norm(net: FloatArray, matrix: FloatArray) -> FloatArray:
            coefficients = lengths(np.tensordot(matrix, net, (1, 1)).swapaxes(0, 1))
            error = 64 * (degree + 2) * UNIT * lengths(net).max(axis=0)
            return np.asarray(growth[:, : len(coefficients)] @ (coefficients + error))

        weights = self.weights[np.newaxis]
        x, w = norm(self.edges, matrices[0]), matrices[0] @ self.weights
        varying = growth[:, 1:] @ (np.abs(w[1:]) + 64 * (degree + 2) * UNIT)
        least = w[0] * (1 - 2.0**-40) - varying * UPWARDS
        least = np.where(least > 0, least, np.nan)
        reach = x / least
        steps = norm(degree * np.diff(self.edges, axis=1), matrices[1])
        steps = steps + reach * norm(degree * np.diff(weights, axis=1), matrices[1])
        distance = lengths(nets.center) + radius
        apart = lengths(self.middle - nets.center) + radius + reach
        flux = distance * apart * np.maximum(along, steps / least)
        return np.asarray(np.stack([flux, flux * (distance + apart)]) * UPWARDS)

    def apply_rule(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Sums (4, K) by rules of `count` nodes, and bounds (2, K) of their rounding."""
        nets = self.nets
        p, q = nets.degree
        (_, x), y, (x_slope, y_slope) = self.curves.at_nodes(count)
        along_u, along_v = find_bases(p, x[np.newaxis]), find_bases(q, y)
        position = evaluate_net(nets.x, along_u[0], along_v[0])[:, 0]
        partials = [
            evaluate_net(net, along_u[axis == 0], along_v[axis == 1])[:, 0]
            for axis, net in enumerate(nets.x_partials)
        ]
        if nets.w is not None:
            w = evaluate_net(nets.w, along_u[0], along_v[0])[:, 0]
            position = position / w
            for axis, net in enumerate(nets.w_partials):
                slope = evaluate_net(net, along_u[axis == 0], along_v[axis == 1])[:, 0]
                partials[axis] = (partials[axis] - position * slope) / w
        step = partials[0] * x_slope + partials[1] * y_slope  # P′
        degree = len(self.weights) - 1
        basis, lower = basis_at_nodes(degree, count), basis_at_nodes(max(degree - 1, 0), count)
        weight = basis @ self.weights
        edge = (basis @ self.edges) / weight
        slope = lower @ (degree * np.diff(self.weights, axis=0))
        edge_step = (lower @ (degree * np.diff(self.edges, axis=1)) - edge * slope) / weight  # E′
        gap = edge - position + (self.middle - nets.center)[:, np.newaxis]
        position = position + nets.center[:, np.newaxis]
        first = dot(position, cross(gap, step, -3), -3)
        second = dot(position, cross(gap, edge_step - step, -3), -3)
        values = np.concatenate(
            [
                (first + second / 2)[np.newaxis],
                position * (first + second / 2) + gap * (first / 2 + second / 3),
            ]
        )
        sums: FloatArray = np.einsum("i,dik->dk", weights_at_nodes(count), values)
        return sums * self.rows.side, self._bound_rounding(count)

    def _bound_rounding(self, count: int) -> FloatArray:
        """Bounds of the rounding of flux and moment, (2, K)."""
        curves, degree = self.curves, len(self.weights) - 1
        position, (error_u, error_v) = bound_value_errors(self.nets, curves.node_error)
        distance, apart, steps = self.bound_real()
        reach = lengths(self.edges).max(axis=0) / self.least_weight
        edge = (self.edge_error + 16 * (degree + 2) * UNIT) * (1 + reach) / self.least_weight
        point = position + edge + 8 * UNIT * distance
        step = (np.stack([error_u, error_v]) * curves.steepness).sum(axis=0)
        step = step + (np.stack(self.nets.stretches) * curves.slope_error).sum(axis=0)
        edge_step = 4 * degree * edge / self.least_weight + 32 * (degree + 2) * UNIT * steps
        step = step + edge_step
        rounding = (count + 64) * UNIT * distance * apart * steps
        flux = point * apart * steps + distance * (point * steps + apart * step) + rounding
        moment = flux * (distance + apart) + point * distance * apart * steps
        return np.asarray(np.stack([2 * flux, 2 * moment]) * UPWARDS)
