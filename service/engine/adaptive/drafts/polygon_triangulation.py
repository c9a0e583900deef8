"""The best triangulations of convex polygons, many in one array operation.

The best triangles are near the surface, and of good shape. The surface over a leaf is treated as
quadratic (`Leaves.form`), so its distance to a triangle needs no evaluation. No triangle has three
places in a line.

For a polygon of few corners all ways to cut it are compared. For more corners the best way is built
from the best ways for smaller polygons: with the cost w_ijk of a triangle, the least cost of the
polygon between corners i and k is

    c_ik = min_j (c_ij + w_ijk + c_jk) for i < j < k,   c_i,i+1 = 0.

Klincsek, Minimal triangulations of polygonal domains, Annals of Discrete Mathematics 9 (1980).
"""

from collections.abc import Iterator
from functools import lru_cache
from math import comb

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.cutting.heights import NEARLY, maximize_heights
from service.engine.vectors import NEXT, dot

ALL = 9
"""Number of corners up to which all ways are compared; there are 429 ways for nine corners."""

SHAPE = 0.02
"""Cost of the best shape; the largest allowed deviation costs 1."""

WORST = 1e9
"""Largest shape number (`_find_costs`) of a triangle; its square is the cost of a triangle whose
places are in a line."""

CHUNK = 1 << 13
"""Number of triangles in one block of costs, unless a single polygon has more."""


@lru_cache(maxsize=64)
def list_triples(corners: int) -> Ints:
    """All triangles i < j < k of a convex polygon, (3, K), in ascending order of k − i."""
    triangles = [
        (i, j, i + gap)
        for gap in range(2, corners)
        for i in range(corners - gap)
        for j in range(i + 1, i + gap)
    ]
    table = np.array(triangles).T
    table.flags.writeable = False
    return table


@lru_cache(maxsize=ALL)
def list_triangulations(corners: int) -> Ints:
    """All triangulations of a convex polygon, (ways, n − 2), as columns of `list_triples`.

    Meshes have triangles in this order. Above seven corners it is the order of
    `_choose_step_by_step`, which formerly cut these polygons: so files of meshes keep their bytes.
    """
    number = {tuple(triple): row for row, triple in enumerate(list_triples(corners).T.tolist())}

    def list_ways(i: int, k: int) -> list[list[int]]:
        if k - i < 2:
            return [[]]
        return [
            [number[i, j, k], *right, *left] if corners > 7 else [*left, number[i, j, k], *right]
            for j in range(i + 1, k)
            for left in list_ways(i, j)
            for right in list_ways(j, k)
        ]

    table = np.array(list_ways(0, corners - 1))
    table.flags.writeable = False
    return table


def triangulate_polygons(
    size: Ints, x: FloatArray, y: FloatArray, points: FloatArray, form: FloatArray
) -> tuple[Ints, Ints]:
    """Triangles of m convex polygons.

    Parameters
    ----------
    size : ndarray of int, shape (m,)
        Number of corners of each. The n corners of all polygons are in one list.
    x, y : ndarray of float64, shape (n,)
        Parameters of the corners, counter-clockwise, scaled so that the leaf is [0, 1]². Corners
        on one side of a leaf have exactly the same x or y, so a line is recognised as one.
    points : ndarray of float64, shape (3, n)
        Positions of the corners.
    form : ndarray of float64, shape (7, m)
        See `Leaves`.

    Returns
    -------
    triangles : ndarray of int, shape (T, 3)
        Corners, as numbers in the list of all corners.
    polygon : ndarray of int, shape (T,)
        The polygon of each triangle.
    """
    start = np.cumsum(size) - size
    triangles, polygon = [np.empty((0, 3), dtype=np.intp)], [start[:0]]
    for batch in _split_into_batches(size):
        corners = [start[rows] + list_triples(n)[:, :, np.newaxis] for n, rows in batch]
        owner = [
            rows[np.arange(triples[0].size) % len(rows)]
            for (_, rows), triples in zip(batch, corners, strict=True)
        ]
        all_triples = np.concatenate([triples.reshape(3, -1) for triples in corners], axis=1)
        # Rows a, b, c: the height of a chord is a dx² + 2 b dx dy + c dy². Last row: the allowed
        # deviation.
        own_form = form[3:].take(np.concatenate(owner), axis=1)
        costs = _find_costs(
            x[all_triples], y[all_triples], points.take(all_triples, axis=1), own_form
        )
        first = 0
        for (n, rows), triples in zip(batch, corners, strict=True):
            # The costs of these polygons: (triples, polygons).
            own = costs[first : first + triples[0].size].reshape(triples.shape[1:])
            first += own.size
            chosen = _choose_among_all(own, n) if n <= ALL else _choose_step_by_step(own, n)
            triangles.append(triples[:, chosen, np.arange(len(rows))].reshape(3, -1).T)
            polygon += [rows] * (n - 2)
    return np.concatenate(triangles), np.concatenate(polygon)


def _split_into_batches(size: Ints) -> Iterator[list[tuple[int, Ints]]]:
    """Batches of (number of corners, polygons with this number), with about `CHUNK` triangles."""
    batch: list[tuple[int, Ints]] = []
    total = 0
    for n in np.bincount(size).nonzero()[0].tolist():
        rows = (size == n).nonzero()[0]
        step = max(1, CHUNK // comb(n, 3))
        for begin in range(0, len(rows), step):
            chunk = rows[begin : begin + step]
            total += len(chunk) * comb(n, 3)
            if total > CHUNK and batch:
                yield batch
                batch, total = [], len(chunk) * comb(n, 3)
            batch.append((n, chunk))
    if batch:
        yield batch


def _choose_among_all(costs: FloatArray, corners: int) -> Ints:
    """The cheapest way to cut each polygon, (n − 2, m), given costs of `list_triples` (K, m)."""
    ways = list_triangulations(corners)
    total = costs[ways].sum(axis=1)
    # The first of the ways whose costs are nearly the least: rounding does not choose.
    chosen: Ints = ways[(total * NEARLY <= total.min(axis=0)).argmax(axis=0)].T
    return chosen


def _choose_step_by_step(costs: FloatArray, corners: int) -> Ints:
    """The cheapest way to cut each polygon, as in `_choose_among_all`, for any number of corners.

    It is built from smaller polygons to larger ones, as described at the top of this file.
    """
    many = costs.shape[1]
    # Between corners i and k: the least cost c_ik, and the triple (i, j, k) of that cost, as the
    # number of a column of `list_triples`.
    least = np.zeros((corners, corners, many))
    best = np.empty((corners, corners, many), dtype=np.intp)
    begin = 0
    for gap in range(2, corners):
        i, step = np.arange(corners - gap), np.arange(1, gap)
        j = i[:, np.newaxis] + step
        end = begin + j.size
        total = costs[begin:end].reshape(*j.shape, many) + least[i[:, np.newaxis], j]
        total += least[j, i[:, np.newaxis] + gap]
        lowest = total.min(axis=1)
        # As in `_choose_among_all`, the first that is nearly the lowest.
        chosen = (total * NEARLY <= lowest[:, np.newaxis]).argmax(axis=1)
        least[i, i + gap] = lowest
        best[i, i + gap] = begin + i[:, np.newaxis] * (gap - 1) + chosen
        begin = end
    every = np.arange(many)
    result, (_, middle, _) = np.empty((corners - 2, many), dtype=np.intp), list_triples(corners)
    # For each polygon a stack of pairs of corners between which it is still to be cut, at most
    # n − 2 pairs; `depth` is the number of pairs.
    stack = np.zeros((corners, 2, many), dtype=np.intp)
    stack[0, 1] = corners - 1
    depth = np.ones(many, dtype=np.intp)
    for row in range(corners - 2):
        depth -= 1
        low, high = stack[depth, :, every].T
        result[row] = best[low, high, every]
        j = middle[result[row]]
        for one, other in ((low, j), (j, high)):
            wide = (other - one > 1).nonzero()[0]
            stack[depth[wide], :, wide] = np.stack([one[wide], other[wide]], axis=1)
            depth[wide] += 1
    return result


def _find_costs(x: FloatArray, y: FloatArray, points: FloatArray, form: FloatArray) -> FloatArray:
    """Costs of triangles (K,): r⁴ plus `SHAPE` times the shape number.

    r is the deviation divided by the allowed deviation. The shape number of a triangle with sides e
    and area A is Σ e² / (4 √3 A); it is 1 for an equilateral triangle, and larger for all others.
    By Heron's formula 16 A² = 4 e_0² e_1² − (e_0² + e_1² − e_2²)².

    Parameters
    ----------
    x, y : ndarray of float64, shape (3, K)
        Scaled parameters of the corners, as in `triangulate_polygons`.
    points : ndarray of float64, shape (3, 3, K)
        Coordinates first.
    form : ndarray of float64, shape (4, K)
        Rows a, b, c of `Leaves.form`, and the allowed deviation.
    """
    dx, dy = x[NEXT] - x, y[NEXT] - y
    # The heights over the middles of the three sides give the greatest height over the triangle.
    ratio = maximize_heights((form[0] * dx + 2.0 * form[1] * dy) * dx + form[2] * dy * dy) / form[3]
    square = ratio * ratio
    steps = (points[:, NEXT] - points).swapaxes(0, 1)
    squares = dot(steps, steps)
    total = squares.sum(axis=0)
    short = total - 2.0 * squares[2]
    # 4 √3 A = 2 √(0.75 · 16 A²)
    scaled = 2.0 * np.sqrt(np.maximum(0.75 * (4.0 * squares[0] * squares[1] - short * short), 0.0))
    shape = total / np.maximum(scaled, total / WORST + np.finfo(float).tiny)
    # The places of a triangle turn to the left unless they are in a line.
    turns = dx[0] * dy[1] > dx[1] * dy[0]
    return np.where(turns, square * square + SHAPE * shape, WORST * WORST)
