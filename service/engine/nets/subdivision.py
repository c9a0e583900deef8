"""Halving of nets, and degree elevation: elementwise, so the bits of a net depend on it alone.

Proof in docs/proofs.md: "Halving".
"""

import numpy as np

from service.bases.arrays import FloatArray


def halve(nets: FloatArray, axis: int, halves: FloatArray) -> None:
    """Write nets over both halves of every cell, divided along u (axis 0) or v (axis 1).

    This is de Casteljau's algorithm at ½: means of neighbours, means of those means, and so on. The
    first mean of each row is a point of the first half, the last mean a point of the second half.
    Sums are multiplied by a power of two at the end, which is exact.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, …, m)
    halves : ndarray of float64, shape (p+1, q+1, …, 2, m)
        The array for the result, or a view of it.
    """
    rest, both = nets.swapaxes(0, axis), halves.swapaxes(0, axis)
    first, second, share = both[..., 0, :], both[::-1, ..., 1, :], 1.0
    first[0], second[0] = rest[0], rest[-1]
    for k in range(1, len(rest)):
        rest, share = rest[:-1] + rest[1:], share / 2
        np.multiply(rest[0], share, out=first[k])
        np.multiply(rest[-1], share, out=second[k])


def elevate(nets: FloatArray) -> FloatArray:
    """Nets (n+2, …) of degree n + 1 from nets (n+1, …): P*_i = i/(n+1) P_{i−1} + (1 − i/(n+1)) P_i.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 6.1.
    """
    count = len(nets)
    share = (np.arange(1, count) / count).reshape(-1, *[1] * (nets.ndim - 1))
    elevated = np.empty((count + 1, *nets.shape[1:]))
    elevated[0], elevated[-1] = nets[0], nets[-1]
    elevated[1:-1] = share * nets[:-1] + (1.0 - share) * nets[1:]
    return elevated
