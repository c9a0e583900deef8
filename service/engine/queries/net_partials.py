"""Points and partials of nets up to the first or the second order, at one place each."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.queries.nets import QueryNets

ROOM = 1 << 20
"""Numbers in the control nets of one chunk."""


_CHOSEN = {
    1: ([0, 1, 0], [0, 0, 1]),
    2: ([0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]),
}
"""Orders in u and in v of the partials up to the first and the second."""


def net_partials(nets: QueryNets, net: Ints, place: FloatArray, order: int = 2) -> FloatArray:
    """S, S_u, S_v, and S_uu, S_uv, S_vv: row k is net `net[k]` at its place.

    Parameters
    ----------
    nets : QueryNets
    net : ndarray of int, shape (m,)
    place : ndarray of float64, shape (2, m)
        In [0, 1].
    order : int
        1 or 2.

    Returns
    -------
    ndarray of float64, shape (6, 3, m), or (3, 3, m) of the first order

    Notes
    -----
    S is wrong by at most 4 (p + q + 2) u M: bases are sums of products that are not negative. The
    error of a partial of order i, j is p^i q^j times larger; for rational nets the ratio of weights
    is another factor.
    """
    partials = np.empty((len(_CHOSEN[order][0]), 3, len(net)))
    for group in nets.groups:
        k = len(group.nets)
        rows = np.arange(len(net))
        if len(nets.groups) > 1:
            rows = np.flatnonzero((net >= group.first) & (net < group.first + k))
        step = max(1, ROOM // group.nets[0].size)
        for first in range(0, len(rows), step):
            chunk = rows[first : first + step]
            u, v = place[:, chunk]
            partials[:, :, chunk] = _evaluate_group(
                group.nets[net[chunk] - group.first], u, v, order
            )
    return partials


def _evaluate_group(nets: FloatArray, u: FloatArray, v: FloatArray, order: int) -> FloatArray:
    m, rows, columns, width = nets.shape
    basis_u, basis_v = _bases(rows - 1, u, order), _bases(columns - 1, v, order)
    # Two products for each net, because the calls of many small products cost more than the
    # arithmetic.
    lines = np.matmul(nets.reshape(m, rows, -1).transpose(0, 2, 1), basis_u.transpose(0, 2, 1))
    x = np.matmul(basis_v, lines.reshape(m, columns, -1)).reshape(m, order + 1, width, order + 1)
    # x[:, j, :, i] is the partial of order i in u and j in v.
    in_u, in_v = _CHOSEN[order]
    chosen = np.ascontiguousarray(x[:, in_v, :, in_u].transpose(0, 2, 1))
    if width == 3:
        return chosen
    w = chosen[:, 3]
    s = chosen[:, :3]
    s[0] /= w[0]
    s[1] = (s[1] - w[1] * s[0]) / w[0]
    s[2] = (s[2] - w[2] * s[0]) / w[0]
    if order > 1:
        s[3] = (s[3] - w[3] * s[0] - 2 * w[1] * s[1]) / w[0]
        s[4] = (s[4] - w[4] * s[0] - w[1] * s[2] - w[2] * s[1]) / w[0]
        s[5] = (s[5] - w[5] * s[0] - 2 * w[2] * s[2]) / w[0]
    return s


def _bases(degree: int, t: FloatArray, order: int) -> FloatArray:
    """Bernstein polynomials and their derivatives up to an order, (m, order + 1, n+1)."""
    basis = np.zeros((len(t), order + 1, degree + 1))
    basis[:, 0] = bernstein(degree, t)
    if degree > 0:
        low = degree * bernstein(degree - 1, t)
        basis[:, 1, 1:] = low
        basis[:, 1, :-1] -= low
    if degree > 1 and order > 1:
        low = degree * (degree - 1) * bernstein(degree - 2, t)
        basis[:, 2, 2:] = low
        basis[:, 2, 1:-1] -= 2 * low
        basis[:, 2, :-2] += low
    return basis
