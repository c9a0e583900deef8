"""Nets of the surface over boxes and triangles of parameters, by blossoming.

A polynomial F of degree (p, q) has a blossom f(u_1 … u_p; v_1 … v_q), symmetric in the u and in the
v, affine in each, with f(u, …, u; v, …, v) = F(u, v). Its values at mixtures of a few arguments are
control points:

    box [a, b] × [c, d]:      P_ij = f(a …, b i times; c …, d j times)
    triangle of n = p + q:    b_ijk = mean of f over all ways of dealing i copies of the first
                              corner, j of the second and k of the third to the p + q arguments,
                              corners giving their u to the first p and their v to the others.

All is computed by (1 − t) a + t b with 0 ≤ t ≤ 1, and means: combinations of the given points with
no negative factor, each factor right to some units in the last place. Hence rounding moves a point
by a few units in the last place of the net's size, also where homogeneous points are divided by
their weights.

Ramshaw, Blossoms are polar forms, CAGD 6 (1989); DeRose, Goldman, Hagen and Mann, Functional
composition algorithms via blossoming, ACM TOG 12 (1993).
"""

from collections.abc import Sequence
from functools import lru_cache
from math import comb, prod
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray

Exponents: TypeAlias = tuple[int, ...]
Place: TypeAlias = tuple[int, int]


@lru_cache(maxsize=256)
def mixtures(arguments: int, degree: int) -> tuple[Exponents, ...]:
    """How often each argument is taken, in the order of `blossoms`.

    Those that end in the first argument come first: they are made of those that have no other.
    """
    if degree == 0:
        return ((0,) * arguments,)
    shorter = mixtures(arguments, degree - 1)
    return tuple(
        (*one[:last], one[last] + 1, *one[last + 1 :])
        for last in range(arguments)
        for one in shorter[: comb(degree - 1 + last, last)]
    )


def blossoms(net: FloatArray, arguments: Sequence[FloatArray]) -> FloatArray:
    """Blossoms of curves at all mixtures of some arguments.

    Parameters
    ----------
    net : ndarray of float64, shape (n+1, …, m)
        Control points along axis 0.
    arguments : ndarrays of float64, shape (m,)
        Each in [0, 1]; 1 − t must be exact, as it is for multiples of 2^-53.

    Returns
    -------
    ndarray of float64, shape (mixtures, …, m)
    """
    rests = [1.0 - t for t in arguments]
    rows = net[np.newaxis]
    for degree in range(1, len(net)):
        count = comb(degree + len(arguments) - 1, degree)
        mixed = np.empty((count, rows.shape[1] - 1, *rows.shape[2:]))
        first = 0
        for last, (t, rest) in enumerate(zip(arguments, rests, strict=True)):
            known = comb(degree - 1 + last, last)
            target = mixed[first : first + known]
            np.multiply(rows[:known, :-1], rest, out=target)
            target += rows[:known, 1:] * t
            first += known
        rows = mixed
    return rows[:, 0]


def box_nets(
    nets: FloatArray, u: tuple[FloatArray, FloatArray], v: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Nets (p+1, q+1, D, m) over the boxes u_0 … u_1 × v_0 … v_1, whichever way they run."""
    along_u = blossoms(nets, u)
    # Mixtures of two arguments: first all of the first, last all of the second.
    both = blossoms(along_u.swapaxes(0, 1), v)
    return both.swapaxes(0, 1)


def triangle_nets(nets: FloatArray, u: Sequence[FloatArray], v: Sequence[FloatArray]) -> FloatArray:
    """Nets (N, D, m) over the triangles with corners (u_k, v_k), in the order of `exponents`."""
    p, q = nets.shape[0] - 1, nets.shape[1] - 1
    both = blossoms(blossoms(nets, u).swapaxes(0, 1), v)
    terms, shares = _dealt(p, q)
    both *= shares
    made = np.empty((len(terms), *nets.shape[2:]))
    for number, (first, *others) in enumerate(terms):
        point = made[number]
        point[...] = both[first]
        for place in others:
            np.add(point, both[place], out=point)
    return made


def half_nets(boxes: FloatArray) -> FloatArray:
    """Nets (N, D, m) over the triangles (0, 0), (1, 0), (0, 1) of boxes."""
    p, q = boxes.shape[0] - 1, boxes.shape[1] - 1
    terms = _halved(p, q)
    made = np.empty((len(terms), *boxes.shape[2:]))
    share = np.empty(boxes.shape[2:])
    for number, ((first, factor), *others) in enumerate(terms):
        point = made[number]
        np.multiply(boxes[first], factor, out=point)
        for place, other in others:
            np.multiply(boxes[place], other, out=share)
            np.add(point, share, out=point)
    return made


@lru_cache(maxsize=256)
def exponents(degree: int) -> tuple[Exponents, ...]:
    """(i, j, k) of the points of a triangular net, in its order."""
    return tuple((degree - j - k, j, k) for k in range(degree + 1) for j in range(degree + 1 - k))


@lru_cache(maxsize=64)
def _dealt(p: int, q: int) -> tuple[tuple[tuple[Place, ...], ...], FloatArray]:
    """Which blossoms (v, u) make each point of a triangle, and their shares (V, U, 1, 1)."""
    along_u, along_v = mixtures(3, p), mixtures(3, q)
    place = {key: number for number, key in enumerate(exponents(p + q))}
    terms: list[list[Place]] = [[] for _ in place]
    shares = np.empty((len(along_v), len(along_u), 1, 1))
    for j, b in enumerate(along_v):
        for i, a in enumerate(along_u):
            both = tuple(x + y for x, y in zip(a, b, strict=True))
            terms[place[both]].append((j, i))
            ways = prod(comb(n, k) for n, k in zip(both, a, strict=True))
            shares[j, i] = ways / comb(p + q, p)
    shares.flags.writeable = False
    return tuple(map(tuple, terms)), shares


@lru_cache(maxsize=64)
def _halved(p: int, q: int) -> tuple[tuple[tuple[Place, float], ...], ...]:
    """Which points (b, c) of a box make each point of its half, and their shares.

        b_ijk = Σ_bc C(i, p−b−k+c) C(j, b) C(k, c) / C(p+q, p) P_bc

    Of the j copies of the corner (1, 0) b give their u, of the k of (0, 1) c give their v.
    """
    made = []
    for i, j, k in exponents(p + q):
        terms = []
        for b in range(min(j, p) + 1):
            for c in range(min(k, q) + 1):
                rest = p - b - (k - c)
                if 0 <= rest <= i:
                    ways = comb(i, rest) * comb(j, b) * comb(k, c)
                    terms.append(((b, c), ways / comb(p + q, p)))
        made.append(tuple(terms))
    return tuple(made)
