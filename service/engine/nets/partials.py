"""Points of nets, and partials up to the first or second order, at one point of each net."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.nets.query_nets import QueryNets

MAX_NUMBERS = 1 << 20
"""The most numbers in the control nets of one chunk: this limits the memory."""

_PARTIAL_ORDERS = {
    1: ([0, 1, 0], [0, 0, 1]),
    2: ([0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]),
}
"""For the highest order 1 or 2: the orders in u, and the orders in v, of all partials."""


def net_partials(nets: QueryNets, net: Ints, parameters: FloatArray, order: int = 2) -> FloatArray:
    """Points S and partials S_u, S_v, S_uu, S_uv, S_vv; result k belongs to the net `net[k]`.

    Parameters
    ----------
    nets : QueryNets
    net : ndarray of int, shape (m,)
    parameters : ndarray of float64, shape (2, m)
        The parameters (u, v) in each net, from 0 to 1.
    order : int
        The highest order: 1, or 2 for second partials, too.

    Returns
    -------
    ndarray of float64, shape (6, 3, m), or (3, 3, m) for the first order

    Notes
    -----
    The rounding error of S is at most 4 (p + q + 2) u M, with the largest coordinate M and the unit
    roundoff u, because bases are sums of products that are not negative. The error of a partial of
    order (i, j) is at most this times (2 p)^i (2 q)^j; for rational nets the ratio of weights is
    another factor.
    """
    partials = np.empty((len(_PARTIAL_ORDERS[order][0]), 3, len(net)))
    for group in nets.groups:
        k = len(group.nets)
        rows = np.arange(len(net))
        if len(nets.groups) > 1:
            rows = np.flatnonzero((net >= group.first) & (net < group.first + k))
        step = max(1, MAX_NUMBERS // group.nets[0].size)
        for first in range(0, len(rows), step):
            chunk = rows[first : first + step]
            u, v = parameters[:, chunk]
            partials[:, :, chunk] = _evaluate_group(
                group.nets[net[chunk] - group.first], u, v, order
            )
    return partials


def _evaluate_group(nets: FloatArray, u: FloatArray, v: FloatArray, order: int) -> FloatArray:
    """Evaluate nets (m, p+1, q+1, 3 or 4) of one degree, each at its own u and v (m,)."""
    m, rows, columns, width = nets.shape
    basis_u, basis_v = _compute_bases(rows - 1, u, order), _compute_bases(columns - 1, v, order)
    # Two matrix products for each net: with more and smaller products, the calls would take longer
    # than the arithmetic.
    lines = np.matmul(nets.reshape(m, rows, -1).transpose(0, 2, 1), basis_u.transpose(0, 2, 1))
    x = np.matmul(basis_v, lines.reshape(m, columns, -1)).reshape(m, order + 1, width, order + 1)
    # x[:, j, :, i] is the partial of order i in u and j in v. Indexed by two lists of orders, the
    # axis of the lists comes first.
    in_u, in_v = _PARTIAL_ORDERS[order]
    partials = np.ascontiguousarray(x[:, in_v, :, in_u].transpose(0, 2, 1))
    return partials if width == 3 else project_partials(partials)


def project_partials(partials: FloatArray) -> FloatArray:
    """Partials (n, 3, m) of S = X/w from those of (X, w), (n, 4, m); n is 1, 3 or 6.

        S_u = (X_u − w_u S)/w,  S_uv = (X_uv − w_uv S − w_u S_v − w_v S_u)/w

    The coordinates should be relative to a point near the surface: rounding errors are then
    smallest.
    """
    w, x = partials[:, 3], partials[:, :3]
    s = np.empty_like(x)
    s[0] = x[0] / w[0]
    for k in range(1, min(len(x), 3)):
        s[k] = (x[k] - w[k] * s[0]) / w[0]
    if len(x) > 3:
        s[3] = (x[3] - w[3] * s[0] - 2 * w[1] * s[1]) / w[0]
        s[4] = (x[4] - w[4] * s[0] - w[1] * s[2] - w[2] * s[1]) / w[0]
        s[5] = (x[5] - w[5] * s[0] - 2 * w[2] * s[2]) / w[0]
    return s


def _compute_bases(degree: int, t: FloatArray, order: int) -> FloatArray:
    """Bernstein polynomials and their derivatives up to `order`, shape (m, order + 1, n+1)."""
    basis = np.zeros((len(t), order + 1, degree + 1))
    basis[:, 0] = bernstein(degree, t)
    if degree > 0:
        lower_basis = degree * bernstein(degree - 1, t)
        basis[:, 1, 1:] = lower_basis
        basis[:, 1, :-1] -= lower_basis
    if degree > 1 and order > 1:
        lower_basis = degree * (degree - 1) * bernstein(degree - 2, t)
        basis[:, 2, 2:] = lower_basis
        basis[:, 2, 1:-1] -= 2 * lower_basis
        basis[:, 2, :-2] += lower_basis
    return basis
