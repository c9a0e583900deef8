"""Local searches with 64 bits of mantissa: nearest points, and crossings with rays.

Partials are differences of points; a curve or surface is a function `at` that gives points (m, d)
at parameters (m, k), with k = 1 or 2, in the plane or in space.
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from oracles.brep_documents import Array, Index, Long

Evaluate: TypeAlias = Callable[[Array], Long]

STEP = 1e-5
"""The step of differences, as a share of the box of parameters."""

LONGEST = 0.2
"""The longest move, as a share of the box of parameters."""

LEAST = 1e-17
"""A move that brings a point nearer by less than this share of the distance ends the search."""


class Domain(NamedTuple):
    """A box of parameters (k,) each: the moves that are allowed, and which axes are closed."""

    low: Array
    high: Array
    move_inside: Callable[[Array], Array]


def descend(
    at: Evaluate, points: Long, places: Array, domain: Domain, rounds: int = 30
) -> tuple[Long, Array]:
    """Distances (m,) of points (m, d) from a curve or surface, and the places (m, k) there.

    From each place the search moves only to nearer places, by steps of Newton, of Gauss and Newton,
    and along the gradient.
    """
    places = places.copy()
    distances = _norm(at(places) - points)
    active = np.arange(len(places))
    for _ in range(rounds):
        if not len(active):
            break
        target, begin = points[active], places[active]
        moves = _list_moves(at, target, begin, domain)
        ends = np.stack([domain.move_inside(begin + move) for move in moves], axis=1)
        shape = ends.shape
        found = _norm(
            at(ends.reshape(-1, shape[2])).reshape(*shape[:2], points.shape[1])
            - target[:, np.newaxis]
        )
        best = found.argmin(axis=1)
        rows = np.arange(len(active))
        is_nearer = found[rows, best] < distances[active] * (1 - LEAST)
        active = active[is_nearer]
        places[active] = ends[rows, best][is_nearer]
        distances[active] = found[rows, best][is_nearer]
    return distances, places


def _list_moves(at: Evaluate, points: Long, places: Array, domain: Domain) -> list[Array]:
    """Moves (m, k) that may lead to nearer points."""
    value, first, second = differentiate(at, places, STEP * (domain.high - domain.low))
    offset = value - points
    gradient = np.einsum("mi,mki->mk", offset, first)
    gauss = np.einsum("mki,mli->mkl", first, first)
    newton = gauss + np.einsum("mi,mkli->mkl", offset, second)
    longest = LONGEST * (domain.high - domain.low)
    moves = []
    for matrix, share in ((newton, 1.0), (gauss, 1.0), (gauss, 0.3), (gauss, 0.03)):
        move = share * _solve(matrix, -gradient)
        moves.append(np.clip(move.astype(np.float64), -longest, longest))
    # Along the gradient, where both matrices are of no use.
    scale = np.einsum("mkk->mk", gauss) + np.abs(np.einsum("mkk->mk", newton))
    with np.errstate(all="ignore"):
        move = np.where(scale > 0, -gradient / scale, 0.0)
    moves.append(np.clip(move.astype(np.float64), -longest, longest))
    return moves


def _solve(matrix: Long, right: Long) -> Long:
    """The solution (m, k) of k = 1 or 2 equations; 0 where there is none."""
    with np.errstate(all="ignore"):
        if right.shape[1] == 1:
            result = right / matrix[:, 0]
        else:
            (a, b), (c, d) = matrix.transpose(1, 2, 0)
            x, y = right.T
            result = np.stack([d * x - b * y, a * y - c * x], axis=1)
            result /= (a * d - b * c)[:, np.newaxis]
    solution: Long = np.where(np.isfinite(result), result, 0.0)
    return solution


def differentiate(at: Evaluate, places: Array, step: Array) -> tuple[Long, Long, Long]:
    """Points (m, d), first partials (m, k, d) and second partials (m, k, k, d), by differences."""
    m, k = places.shape
    offsets = np.array(list(product((-1, 0, 1), repeat=k)))
    around = (places[:, np.newaxis] + offsets * step).reshape(-1, k)
    grid = at(around)
    d = grid.shape[1]
    grid = grid.reshape(m, *(3,) * k, d)
    # The differences of the rounded parameters are those that were asked for.
    first = np.zeros((m, k, d), np.longdouble)
    second = np.zeros((m, k, k, d), np.longdouble)
    h = step.astype(np.longdouble)
    if k == 1:
        low, middle, high = grid.transpose(1, 0, 2)
        first[:, 0] = (high - low) / (2 * h[0])
        second[:, 0, 0] = (high - 2 * middle + low) / h[0] ** 2
        return middle, first, second
    middle = grid[:, 1, 1]
    first[:, 0] = (grid[:, 2, 1] - grid[:, 0, 1]) / (2 * h[0])
    first[:, 1] = (grid[:, 1, 2] - grid[:, 1, 0]) / (2 * h[1])
    second[:, 0, 0] = (grid[:, 2, 1] - 2 * middle + grid[:, 0, 1]) / h[0] ** 2
    second[:, 1, 1] = (grid[:, 1, 2] - 2 * middle + grid[:, 1, 0]) / h[1] ** 2
    mixed = grid[:, 2, 2] - grid[:, 2, 0] - grid[:, 0, 2] + grid[:, 0, 0]
    second[:, 0, 1] = second[:, 1, 0] = mixed / (4 * h[0] * h[1])
    return middle, first, second


class Crossings(NamedTuple):
    """Hits of rays: number of the start (n,), t (n,), place (n, 2), and sine of the angle (n,)."""

    start: Index
    t: Array
    places: Array
    sines: Array


def cross(
    at: Evaluate, rays: tuple[Array, Array], places: Array, domain: Domain, rounds: int = 12
) -> Crossings:
    """Crossings of rays, origins and directions (m, 3), that Newton's method reaches from places.

    A start is given up if it leaves the domain, or does not converge.
    """
    origins, directions = (each.astype(np.longdouble) for each in rays)
    speed = _norm(directions)
    first, second = _build_frame(directions)
    places = places.copy()
    size = domain.high - domain.low
    active = np.arange(len(places))
    error, sine = np.full((2, len(places)), np.inf)
    scale = np.abs(origins).max(axis=1)
    for _ in range(rounds):
        if not len(active):
            break
        value, partials, _ = differentiate(at, places[active], STEP * size)
        offset = value - origins[active]
        scale[active] = np.maximum(scale[active], np.abs(value).max(axis=1))
        a, b = first[active], second[active]
        across = np.stack([(offset * a).sum(axis=1), (offset * b).sum(axis=1)], axis=1)
        error[active] = np.sqrt((across * across).sum(axis=1))
        normal = np.cross(partials[:, 0], partials[:, 1])
        with np.errstate(all="ignore"):
            turn = (normal * directions[active]).sum(axis=1) / speed[active] / _norm(normal)
        sine[active] = np.where(np.isfinite(turn), turn, 0.0)
        matrix = np.stack(
            [np.einsum("mki,mi->mk", partials, a), np.einsum("mki,mi->mk", partials, b)], axis=1
        )
        move = np.clip(_solve(matrix, -across).astype(np.float64), -LONGEST * size, LONGEST * size)
        begin = places[active]
        places[active] = domain.move_inside(begin + move)
        is_done = (np.abs(places[active] - begin) <= 1e-16 * size).all(axis=1)
        active = active[~is_done]
    value = at(places)
    offset = value - origins
    t = (offset * directions).sum(axis=1) / speed**2
    error = _norm(offset - t[:, np.newaxis] * directions)
    near = np.flatnonzero((error <= 1e-14 * scale) & (t >= 0))
    return Crossings(near, t[near].astype(np.float64), places[near], sine[near].astype(np.float64))


def _build_frame(directions: Long) -> tuple[Long, Long]:
    """Two unit vectors (m, 3) for each direction, orthogonal to it and to each other."""
    axis = np.eye(3)[np.abs(directions).argmin(axis=1)].astype(np.longdouble)
    first = np.cross(directions, axis)
    first /= _norm(first)[:, np.newaxis]
    second = np.cross(directions, first)
    return first, second / _norm(second)[:, np.newaxis]


def _norm(vectors: Long) -> Long:
    lengths: Long = np.sqrt((vectors * vectors).sum(axis=-1))
    return lengths
