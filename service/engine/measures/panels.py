"""Panels: signed parts of patches between a line u = const and the border of a trimmed face.

A panel is where u is between a base line and a piece c = (c_u, c_v) of the border:

    φ(τ, t) = (b + τ (c_u(t) − b), c_v(t)),   ∫∫ g du dv = ∫∫ g(φ) (c_u − b) c_v′ dτ dt

with a sign if c_v falls. By Green's theorem the panels of all pieces add up to the trimmed region.
The integrand is a function g of the surface, which is smooth, times a height (c_u − b) c_v′ that
may change its sign. Panels are halved along τ and along t; g is bounded over the box about a panel.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.measures.area_models import AreaModels
from service.engine.measures.border_curves import AXES, RADII, BorderCurves, grow_chebyshev
from service.engine.measures.box_nets import BoxNets, MeasuredPatches
from service.engine.measures.cells import UPWARDS, Net, build_halving_matrix, lengths
from service.engine.measures.patch_cells import CHUNK
from service.engine.measures.quadrature import Integrand, bound_rounding, gauss, weights_at_nodes
from service.engine.measures.remainders import bound_spreads
from service.engine.vectors import UNIT, Items, cross, dot

ALIKE = 100.0
"""Errors along τ and t are alike up to this factor."""

LEAST_WIDTH = 2.0**-30
"""Boxes about panels are at least this wide, in the parameters of patches."""


@dataclass(frozen=True, eq=False, slots=True)
class PanelRows(Items):
    """K panels beside curves of degree k.

    Attributes
    ----------
    curves : ndarray of float64, shape (2, k+1, K), or (3, k+1, K) if rational
        Nets in the parameters of the patches, within [0, 1]; if rational, (w u, w v, w).
    base, begin, end : ndarray of float64, shape (K,)
        u of the base line, and the values of τ at both sides of the panel, from 0 to 1.
    row : ndarray of int, shape (K,)
        Numbers of patches.
    patch : ndarray of int, shape (K,)
        The face for whose sums each panel counts.
    sign : ndarray of float64, shape (K,)
        By which integrals are multiplied, if t increases.
    side : ndarray of float64, shape (K,)
        1 or −1: by which a flux is multiplied, too.
    depth : ndarray of int, shape (K,)
        Number of halvings along t.
    """

    curves: FloatArray
    base: FloatArray
    begin: FloatArray
    end: FloatArray
    row: Ints
    patch: Ints
    sign: FloatArray
    side: FloatArray
    depth: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Panels:
    """Panels of patches of one degree."""

    patches: MeasuredPatches
    rows: PanelRows

    @property
    def patch(self) -> Ints:
        """The face for whose sums each panel counts, (K,)."""
        return self.rows.patch

    @property
    def size(self) -> int:
        """Number of control points of all panels."""
        p, q = self.patches.degree
        return len(self) * ((p + 1) * (q + 1) + int(self.rows.curves.shape[1]))

    def __len__(self) -> int:
        return len(self.rows.patch)

    def take(self, index: Ints | Bools | slice) -> "Panels":
        """The panels with these indices, or those that a mask marks."""
        return Panels(self.patches, self.rows.take(index))

    @classmethod
    def join(cls, parts: Sequence["Panels"]) -> "Panels":
        """The panels of several records of the same patches."""
        return cls(parts[0].patches, PanelRows.join([part.rows for part in parts]))

    def halve(self, axis: int) -> "Panels":
        """Both halves of every panel, along τ (axis 0) or t (axis 1): first halves come first."""
        rows = self.rows
        if axis == 0:
            middle = rows.begin + (rows.end - rows.begin) / 2
            halves = [replace(rows, end=middle), replace(rows, begin=middle)]
            return Panels(self.patches, PanelRows.join(halves))
        d, count, k = rows.curves.shape
        curves = (build_halving_matrix(count - 1) @ rows.curves).reshape(d, 2, count, k)
        first, second = (np.ascontiguousarray(curves[:, half]) for half in range(2))
        halves = [replace(rows, curves=each, depth=rows.depth + 1) for each in (first, second)]
        return Panels(self.patches, PanelRows.join(halves))

    def find_exact_rule(self, _: Integrand) -> int:
        """No rule is exact."""
        return 0

    def chunks(self, count: int) -> list[slice]:
        """Runs of panels whose arrays fit the cache."""
        p, q = self.patches.degree
        numbers = 4 * max(count * count, (p + 1) * (q + 1), len(RADII) * (max(p, q) + 1))
        step = max(1, CHUNK // numbers)
        return [slice(k, k + step) for k in range(0, len(self), step)]

    def bound_remainders(self, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
        """Bounds of the errors of rules of `count` nodes, and along which axis to halve."""
        # The rounding of nets, as of other surfaces, is among that of sums.
        return _LocalPanels(self.patches, self.rows, rounded=True).bound_remainders(
            integrand, count
        )

    def apply_rule(self, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
        """Sums by rules of `count` nodes, and bounds of their rounding."""
        return _LocalPanels(self.patches, self.rows).apply_rule(integrand, count)


class _LocalPanels:
    """A few panels, with the nets and curves over the boxes about them."""

    def __init__(self, patches: MeasuredPatches, rows: PanelRows, *, rounded: bool = False) -> None:
        self.rows, self.orientation = rows, patches.orientation
        x, y = rows.curves[:2]
        w = rows.curves[2] if len(rows.curves) > 2 else None
        sides = _find_sides(rows, x, w)
        at_sides, at_y = (sides, y) if w is None else (sides / w, y / w)
        corners = [at_sides.min(axis=(0, 1)), at_y.min(axis=0)]
        corners += [at_sides.max(axis=(0, 1)), at_y.max(axis=0)]
        low, high = widen_boxes(np.array(corners).reshape(2, 2, -1))
        width = high - low
        self.nets: BoxNets = patches.restrict(rows.row, low, high, rounded=rounded)
        one = 1.0 if w is None else w
        self.curves = BorderCurves(
            (sides - low[0] * one) / width[0],
            (y - low[1] * one) / width[1],
            w,
            np.asarray(8 * UNIT * (1 + 1 / width)),
        )
        # By how much halving along t moved the curve, in the box.
        self.moved = rows.depth * ((4 * self.curves.degree + 8) * UNIT) / width
        if w is not None:
            self.moved = self.moved / self.curves.least_weight

    @cached_property
    def height(self) -> FloatArray:
        """Bounds of |(x_1 − x_0) y′|, (K,)."""
        return np.asarray(self.curves.width * self.curves.steepness[1] * UPWARDS)

    @np.errstate(all="ignore")
    def bound_remainders(self, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
        """See `Panels`."""
        nets, curves = self.nets, self.curves
        factors = (32 / 15 * UPWARDS * RADII ** (-2.0 * count) / (1 - RADII**-2.0))[:, np.newaxis]
        # The half axes of ellipses for u and v, first if τ is complex, then if t is.
        excess = 1 + 8 * curves.node_error
        axis = excess[0] + curves.width * (AXES[:, np.newaxis] - 1)
        real = np.broadcast_to(excess[1], axis.shape)
        axes = np.concatenate([np.stack([axis, real]), np.stack(curves.find_axes())], axis=1)
        height = np.broadcast_to(self.height, axis.shape)
        heights = np.stack([height, curves.find_heights().largest])
        largest = self._bound_integrands(integrand, axes[0], axes[1])
        scaled = largest.reshape(-1, *heights.shape) * heights * factors * UPWARDS
        errors = np.where(np.isfinite(scaled), scaled, np.inf).min(axis=2)
        limits = 2 * UPWARDS * np.prod(nets.stretches, axis=0)[np.newaxis] * self.height
        if integrand == "flux":
            distance = lengths(nets.center) + nets.radius
            limits = limits * np.stack([distance, distance * distance])
        errors_of_both = np.minimum(errors.sum(axis=1), limits) * np.abs(self.rows.sign)
        return errors_of_both, self._choose_directions(errors[0], np.isfinite(heights[1, 0]))

    def _choose_directions(self, errors: FloatArray, is_bounded: Bools) -> Bools:
        """Whether to halve along t, from the errors (2, K) along τ and along t.

        If both are alike, or not known, the direction is that along which partials change more.
        `is_bounded` (K,) says whether heights have a bound for complex t.
        """
        along_tau, along_t = errors
        along_u, along_v = self.nets.changes
        is_more = along_v + along_u * self.curves.sway > along_u * self.curves.width
        is_known = np.isfinite(along_tau) & np.isfinite(along_t)
        is_more[is_known & (along_t > ALIKE * along_tau)] = True
        is_more[is_known & (along_tau > ALIKE * along_t)] = False
        return np.asarray(is_more | ~is_bounded)

    def _bound_integrands(
        self, integrand: Integrand, axis_u: FloatArray, axis_v: FloatArray
    ) -> FloatArray:
        """Bounds (1 or 2, R, K) of g on ellipses for u and for v with these half axes, (R, K)."""
        if integrand == "size":
            return AreaModels(self.nets).bound(axis_u, axis_v)[np.newaxis]
        n = max(self.nets.degree)
        powers_u, powers_v = grow_chebyshev(axis_u, n), grow_chebyshev(axis_v, n)
        spread = partial(self.nets.spread, powers_u=powers_u, powers_v=powers_v)
        partials, radius = bound_spreads(self.nets, spread)
        normal = np.prod([lengths(each.value) + each.deviation for each in partials], axis=0)
        distance = lengths(self.nets.center) + radius
        return np.stack([distance * normal, distance * distance * normal]) * UPWARDS

    def apply_rule(self, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
        """See `Panels`."""
        nets = self.nets
        p, q = nets.degree
        (x_0, x_1), y, (_, slope) = self.curves.at_nodes(count)
        nodes, _ = gauss(count)
        tau = np.concatenate([nodes, 1 - nodes[: count // 2][::-1]])
        x = x_0 + tau[:, np.newaxis, np.newaxis] * (x_1 - x_0)
        weights = weights_at_nodes(count)
        # The weights of the rule, (m, 1), times those along t and the height, (m, K).
        heights = (x_1 - x_0) * slope * weights[:, np.newaxis]
        along_u = find_bases(p, x)
        along_v = find_bases(q, y)
        position = evaluate_net(nets.x, along_u[0], along_v[0])
        partials = [
            evaluate_net(net, along_u[axis == 0], along_v[axis == 1])
            for axis, net in enumerate(nets.x_partials)
        ]
        if nets.w is not None:
            w = evaluate_net(nets.w, along_u[0], along_v[0])
            position /= w
            for axis, net in enumerate(nets.w_partials):
                slope = evaluate_net(net, along_u[axis == 0], along_v[axis == 1])
                partials[axis] = (partials[axis] - position * slope) / w
        normal = cross(partials[0], partials[1], -4)
        if integrand == "size":
            values = lengths(normal)[np.newaxis]
        else:
            position += nets.center[:, np.newaxis, np.newaxis]
            flux = dot(position, normal, -4) * (self.orientation * self.rows.side)
            values = np.concatenate([flux[np.newaxis], position * flux])
        # First the sums along τ, then those along t.
        rows = np.einsum("i,dijk->djk", weights, values)
        sums = np.einsum("djk,jk->dk", rows, heights) * self.rows.sign
        return sums, self._bound_rounding(integrand, count) * np.abs(self.rows.sign)

    def _bound_rounding(self, integrand: Integrand, count: int) -> FloatArray:
        """Bounds of the rounding of sums: shape (1, K), or (2, K) for a flux and its moment."""
        curves, nets = self.curves, self.nets
        # Of g, if heights are at most `height`.
        errors = bound_rounding(nets, integrand, count, curves.node_error)
        errors = errors * self.height
        # Of heights, and of the border.
        height_error = curves.width * curves.slope_error[1]
        height_error = height_error + 2 * curves.node_error[0] * curves.steepness[1]
        height_error = height_error + 8 * UNIT * self.height
        x, y = self.moved
        border = 2 * x * curves.steepness[1] + (4 * curves.degree + 2) * y
        largest = np.prod(nets.stretches, axis=0) * UPWARDS
        if integrand == "size":
            bounds = largest[np.newaxis]
        else:
            distance = lengths(nets.center) + nets.radius
            bounds = largest * np.stack([distance, distance * distance])
        return np.asarray((errors + bounds * (height_error + border)) * UPWARDS)


def _find_sides(rows: PanelRows, x: FloatArray, w: FloatArray | None) -> FloatArray:
    """The nets (2, k+1, K) of both sides, times the weights."""
    base = rows.base if w is None else rows.base * w
    away = x - base
    return np.stack([base + rows.begin * away, np.where(rows.end == 1, x, base + rows.end * away)])


def widen_boxes(corners: FloatArray) -> FloatArray:
    """Boxes (2, 2, K) within [0, 1]², at least `LEAST_WIDTH` wide, such that 1 − low is exact."""
    low, high = corners
    low = np.minimum(np.maximum(low, 0.0), 1 - LEAST_WIDTH)
    high = np.minimum(np.maximum(high, low + LEAST_WIDTH), 1.0)
    exact: FloatArray = 1 - (1 - np.array([low, high]))
    return exact


def find_bases(degree: int, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The Bernstein bases of a degree n ≥ 1, (n+1, …), and of degree n − 1 at parameters t (…)."""
    complement = 1 - t
    lower = basis = np.ones((1, *t.shape))
    for n in range(1, degree + 1):
        lower = basis
        raised = np.empty((n + 1, *t.shape))
        np.multiply(basis, complement, out=raised[:n])
        raised[n] = 0.0
        raised[1:] += basis * t
        basis = raised
    return basis, lower


def evaluate_net(net: Net, along_u: FloatArray, along_v: FloatArray) -> FloatArray:
    """Values (d, i, j, K) of a net (d, a+1, b+1, K); bases (a+1, i, j, K) and (b+1, j, K)."""
    lines = net.values[:, :, 0, np.newaxis] * along_v[0]
    for k in range(1, len(along_v)):
        lines += net.values[:, :, k, np.newaxis] * along_v[k]
    values = lines[:, 0, np.newaxis] * along_u[0]
    for k in range(1, len(along_u)):
        values += lines[:, k, np.newaxis] * along_u[k]
    result: FloatArray = values
    return result
