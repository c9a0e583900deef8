"""Gauss–Legendre quadrature over cells, and bounds of its rounding.

    area    Σ ω_k ω_l |N|                       N = S_u × S_v
    flux    Σ ω_k ω_l (S − o) · N               moment  Σ ω_k ω_l (S − o) ((S − o) · N)
    length  Σ ω_k |S_u|

Newton's method in 40 decimal digits finds the roots of the Legendre polynomials; nodes and weights
over [0, 1] are then rounded once. Nodes above ½ are the mirror images of those below, and so are
the values of a basis there, so that a node near 1 loses no digits.

Proofs in docs/proofs.md: "Nodes, weights and bases" and "Rounding of quadrature sums".
"""

from decimal import Decimal, localcontext
from math import cos, pi
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.bases.cache import BASES
from service.engine.measures.cells import UPWARDS, CellNets, Net, along, lengths
from service.engine.vectors import UNIT, cross, dot

Integrand: TypeAlias = Literal["size", "flux"]
"""Areas of surfaces and lengths of curves; or flux and its moments."""


def apply_rule(nets: CellNets, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
    """Compute sums over K cells, and bounds of their rounding.

    Returns
    -------
    sums : ndarray of float64, shape (1, K), or (4, K): the flux, and the moment's coordinates
    errors : ndarray of float64, shape (1, K), or (2, K): of the flux, and of the moment's length
    """
    axes = len(nets.x_partials)
    position = at_nodes(nets.x, count, axes)
    partials = [at_nodes(net, count, axes) for net in nets.x_partials]
    if nets.w is not None:
        w = at_nodes(nets.w, count, axes)
        position /= w
        for step, net in zip(partials, nets.w_partials, strict=True):
            np.subtract(step, position * at_nodes(net, count, axes), out=step)
            np.divide(step, w, out=step)
    normal = partials[0]
    node_weights = weights_at_nodes(count)
    if axes > 1:
        normal = cross(partials[0], partials[1], -3)
        node_weights = np.outer(node_weights, node_weights).ravel()
    errors = bound_rounding(nets, integrand, count)
    if integrand == "size":
        return np.asarray(node_weights @ lengths(normal))[np.newaxis], errors
    position += nets.center[:, np.newaxis]  # from S − c to S: the origin o is 0
    flux = dot(position, normal, -3)
    sums = np.empty((4, flux.shape[1]))
    sums[0] = node_weights @ flux
    sums[1:] = node_weights @ (position * flux)
    return sums, errors


def at_nodes(net: Net, count: int, axes: int) -> FloatArray:
    """Evaluate a net (d, a+1, b+1, K) at the nodes of a rule along 1 or 2 axes.

    The result has shape (d, nodes, K); v varies fastest.
    """
    d, rows, columns, cell_count = net.values.shape
    values = along(basis_at_nodes(rows - 1, count), net.values, 0)
    if axes > 1:
        values = along(basis_at_nodes(columns - 1, count), values, 1)
    return values.reshape(d, -1, cell_count)


def bound_rounding(
    nets: CellNets, integrand: Integrand, count: int, shifts: FloatArray | None = None
) -> FloatArray:
    """Bound the rounding of sums: shape (1, K), or (2, K) for a flux and its moment.

    `shifts` (2, K) bound the errors of the parameters u and v of nodes, by default 0.
    """
    max_distance = lengths(nets.center) + nets.radius
    position_error, partial_errors = bound_value_errors(nets, shifts)
    # A bound of |N| and of its error; of |S_u| and its error for curves.
    max_normal, normal_error = nets.stretches[0], partial_errors[0]
    if len(partial_errors) > 1:
        (a, b), (alpha, beta) = nets.stretches, partial_errors
        max_normal = a * b
        normal_error = a * beta + alpha * b + alpha * beta + 8 * UNIT * max_normal
    sum_rounding = (count**2 + 16) * UNIT
    if integrand == "size":
        return np.asarray((normal_error + sum_rounding * max_normal) * UPWARDS)[np.newaxis]
    flux = (
        max_distance * normal_error
        + (position_error + (sum_rounding + 4 * UNIT) * max_distance) * max_normal
    )
    moment = max_distance * (
        max_distance * normal_error
        + (2 * position_error + (sum_rounding + 8 * UNIT) * max_distance) * max_normal
    )
    return np.asarray(np.stack([flux, moment]) * UPWARDS)


def bound_value_errors(
    nets: CellNets, shifts: FloatArray | None = None
) -> tuple[FloatArray, list[FloatArray]]:
    """Bound the errors of S − c, and those of S_u and S_v, at nodes: shape (K,) each.

    `shifts` (2, K) bound the errors of the parameters u and v of nodes, by default 0.
    """
    n, radius, min_weight = max(nets.degree), nets.radius, nets.least_weight

    def error_of(net: Net) -> FloatArray:
        error = net.error + 16 * (n + 2) * UNIT * net.largest
        for axis, shift in enumerate(() if shifts is None else shifts, start=1):
            degree = net.values.shape[axis] - 1
            if degree:
                steps = lengths(np.diff(net.values, axis=axis)).max(axis=(0, 1))
                error = error + shift * degree * (steps + 2 * net.error)
        return np.asarray(error)

    position_error = error_of(nets.x)
    if nets.w is not None:
        position_error = (position_error + radius * error_of(nets.w)) / min_weight
    position_error = position_error + 8 * UNIT * radius
    partial_errors = []
    for k, (x, max_partial) in enumerate(zip(nets.x_partials, nets.stretches, strict=True)):
        error = error_of(x)
        if nets.w is not None:
            w = nets.w_partials[k]
            slope = w.largest / min_weight
            error = (error + radius * error_of(w) + max_partial * error_of(nets.w)) / min_weight
            error = error + position_error * slope + 8 * UNIT * radius * slope
        partial_errors.append(error + 8 * UNIT * max_partial)
    return position_error, partial_errors


def gauss(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes in [0, ½] and weights of the rule of `count` nodes over [0, 1]: ⌈count / 2⌉ each."""
    table = BASES.array(("Gauss-Legendre", count), lambda: np.array(_rule(count)).T)
    return table[0], table[1]


def _rule(count: int) -> list[tuple[float, float]]:
    """Compute pairs (node, weight) for the nodes in [0, ½], in decimal arithmetic."""
    rule = []
    with localcontext() as context:
        context.prec = 40
        for k in range((count + 1) // 2):
            x = Decimal(cos(pi * (k + 0.75) / (count + 0.5)))
            # Each step of Newton's method doubles the number of correct digits.
            for _ in range(6):
                value, slope = _legendre(count, x)
                x -= value / slope
            _, slope = _legendre(count, x)
            rule.append((float((1 - x) / 2), float(1 / ((1 - x * x) * slope * slope))))
    return rule


def _legendre(count: int, x: Decimal) -> tuple[Decimal, Decimal]:
    """P_m(x) and P_m′(x) for m = `count`, by the recurrence of three terms."""
    previous_value, value = Decimal(1), x
    for k in range(2, count + 1):
        previous_value, value = value, ((2 * k - 1) * x * value - (k - 1) * previous_value) / k
    return value, count * (previous_value - x * value) / (1 - x * x)


def weights_at_nodes(count: int) -> FloatArray:
    """The weights of all nodes, (count,)."""
    _, weights = gauss(count)
    return np.concatenate([weights, weights[: count // 2][::-1]])


def basis_at_nodes(degree: int, count: int) -> FloatArray:
    """Bernstein basis at the nodes of a rule, (count, degree + 1)."""

    def build() -> FloatArray:
        nodes, _ = gauss(count)
        lower = bernstein(degree, nodes)
        return np.concatenate([lower, lower[: count // 2][::-1, ::-1]])

    return BASES.array(("basis at nodes", degree, count), build)
