"""Bounds of polynomials over a triangle: the quadratic part exactly, the remainder by its hull.

Let h be a triangular net of degree n ≥ 2. With m_k the value half-way along edge k,

    h = Q + R,  Q = 4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0),

and R, which vanishes half-way along the edges, is bounded by its own net, h minus the net of Q
elevated to degree n, of which point (i_0, i_1, i_2) is 4 Σ_k m_k i_k i_{k+1} / (n (n − 1)).

The greatest value of Q over the triangle has a closed form. Were the m_k the squared sides of a
triangle, Q would be four times Σ λ_a λ_b |P_a − P_b|² = ρ² − |P(λ) − O|², with O and ρ the middle
and radius of its circumscribed circle. If that triangle is acute, O is in it and the maximum
4 ρ² = m_c / sin² C, where m_c is the largest side and C its angle; else, and if there is no such
triangle, the maximum is the largest of 0 and the m_k. With m_a ≤ m_b ≤ m_c the law of cosines is

    cos² C = (m_a + m_b − m_c)² / (4 m_a m_b), at most 1/4, 0 instead where m_a + m_b ≤ m_c,

so that nothing cancels in 1 − cos² C.
"""

from functools import lru_cache
from math import comb

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.bounds.blossoms import list_exponents


def bound_heights(h: FloatArray, degree: int) -> FloatArray:
    """A bound of |h| over the triangle, nets (m, k, N): shape (m, k)."""
    halfway, elevated = _build_quadratic_tables(degree)
    values = h @ halfway
    rest = h - values @ elevated
    middles = values.transpose(2, 0, 1)
    both = maximize_quadratics(np.stack([middles, -middles], axis=1))
    up = both[0] + np.maximum(rest.max(axis=-1), 0.0)
    bound: FloatArray = np.maximum(up, both[1] - np.minimum(rest.min(axis=-1), 0.0))
    return bound


def maximize_quadratics(m: FloatArray) -> FloatArray:
    """max(0, 4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0)) over the triangle; m is (3, …)."""
    low, high = np.minimum(m[0], m[1]), np.maximum(m[0], m[1])
    a, c = np.minimum(low, m[2]), np.maximum(high, m[2])
    b = np.maximum(low, np.minimum(high, m[2]))
    cosine = np.maximum(a + (b - c), 0.0)
    acute = cosine > 0
    share = cosine / np.where(acute, 2.0 * a, 1.0) * (cosine / np.where(acute, 2.0 * b, 1.0))
    largest: FloatArray = np.maximum(c, 0.0) / (1.0 - share)
    return largest


@lru_cache(maxsize=64)
def _build_quadratic_tables(degree: int) -> tuple[FloatArray, FloatArray]:
    """Matrix (N, 3) from nets to their values half-way along edges; nets (3, N) of 4 λ_k λ_{k+1}.

    Half-way along an edge a net is Σ_i C(n, i) h_i / 2^n.
    """
    keys = list_exponents(degree)
    place = {key: number for number, key in enumerate(keys)}
    halfway = np.zeros((len(keys), 3))
    for k in range(3):
        for i in range(degree + 1):
            key = [0, 0, 0]
            key[k], key[(k + 1) % 3] = degree - i, i
            halfway[place[key[0], key[1], key[2]], k] = comb(degree, i) / 2**degree
    net = np.array(keys, dtype=np.float64).T
    elevated = 4.0 * net * net[[1, 2, 0]] / (degree * (degree - 1))
    for table in (halfway, elevated):
        table.flags.writeable = False
    return halfway, elevated
