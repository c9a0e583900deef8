"""Gauss–Legendre sums over cells, and bounds of their rounding.

    area    Σ ω_k ω_l |N|                       N = S_u × S_v
    flux    Σ ω_k ω_l (S − o) · N               moment  Σ ω_k ω_l (S − o) ((S − o) · N)
    length  Σ ω_k |S_u|

**Rounding.** With the bounds of `local_nets`, η = ε + 16 (n + 2) u M of each net, A ≥ |S_u|,
B ≥ |S_v|, r ≥ |S − c| and w ≥ w₀ over the cell,

    |error of S − c| ≤ (η_X + r η_w) / w₀ + 8 u r =: σ
    |error of S_u|   ≤ (η_Xu + r η_wu + σ |w_u| + A η_w) / w₀ + 8 u (A + r |w_u| / w₀) =: α

The bound β for S_v has the same form. The error of N is at most ν = A β + α B + α β + 8 u A B. With
R = |c − o| + r, the error of a term is at most ν + 4 u A B for the area, R ν + (σ + 4 u R) A B for
the flux, and R² ν + (2 σ + 8 u R) R A B for the moment. The relative error of a weight is at most 2
u. The errors of the weights and of the sum of m² terms, and for the area the 4 u A B, are together
at most (m² + 16) u times the largest term.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.cells import along
from service.engine.measures.local_nets import UPWARDS, CellNets, Net, lengths
from service.engine.measures.remainders import Kind
from service.engine.measures.tables import basis_at_nodes, weights_at_nodes
from service.engine.vectors import UNIT, cross


def apply_rule(nets: CellNets, kind: Kind, count: int) -> tuple[FloatArray, FloatArray]:
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
    errors = bound_rounding(nets, kind, count)
    if kind == "size":
        return np.asarray(node_weights @ lengths(normal))[np.newaxis], errors
    position += nets.center[:, np.newaxis]  # from S − c to S: the origin o is 0
    flux = (position * normal).sum(axis=0)
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


def bound_rounding(nets: CellNets, kind: Kind, count: int) -> FloatArray:
    """Bound the rounding of sums: shape (1, K), or (2, K) for a flux and its moment."""
    n, reach, min_weight = max(nets.degree), nets.reach, nets.least_weight

    def error_of(net: Net) -> FloatArray:
        return np.asarray(net.noise + 16 * (n + 2) * UNIT * net.largest)

    position_error = error_of(nets.x)
    if nets.w is not None:
        position_error = (position_error + reach * error_of(nets.w)) / min_weight
    position_error = position_error + 8 * UNIT * reach
    partial_errors = []
    for k, (x, max_partial) in enumerate(zip(nets.x_partials, nets.stretches, strict=True)):
        error = error_of(x)
        if nets.w is not None:
            w = nets.w_partials[k]
            slope = w.largest / min_weight
            error = (error + reach * error_of(w) + max_partial * error_of(nets.w)) / min_weight
            error = error + position_error * slope + 8 * UNIT * reach * slope
        partial_errors.append(error + 8 * UNIT * max_partial)
    # A bound of |N| and of its error; of |S_u| and its error for curves.
    max_normal, normal_error = nets.stretches[0], partial_errors[0]
    if len(partial_errors) > 1:
        (a, b), (alpha, beta) = nets.stretches, partial_errors
        max_normal = a * b
        normal_error = a * beta + alpha * b + alpha * beta + 8 * UNIT * max_normal
    sum_rounding = (count**2 + 16) * UNIT
    if kind == "size":
        return np.asarray((normal_error + sum_rounding * max_normal) * UPWARDS)[np.newaxis]
    max_distance = lengths(nets.center) + reach
    flux = (
        max_distance * normal_error
        + (position_error + (sum_rounding + 4 * UNIT) * max_distance) * max_normal
    )
    moment = max_distance * (
        max_distance * normal_error
        + (2 * position_error + (sum_rounding + 8 * UNIT) * max_distance) * max_normal
    )
    return np.asarray(np.stack([flux, moment]) * UPWARDS)
