"""The Bézier nets of spans of curves, in groups of one degree, and intervals of parameters."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.nets.subdivision import elevate
from service.engine.vectors import Items, project


@dataclass(frozen=True, eq=False)
class SpanNets:
    """The Bézier spans of curves, as nets of one degree n, all polynomial or all rational.

    Attributes
    ----------
    values : ndarray of float64, shape (n+1, D, k)
        Control points; or, if rational, (w P, w), D + 1 numbers. The spans of a curve follow one
        another.
    is_rational : bool
    """

    values: FloatArray
    is_rational: bool

    @property
    def degree(self) -> int:
        """Degree n."""
        return len(self.values) - 1

    @property
    def dimension(self) -> int:
        """Coordinates of a point, D."""
        return int(self.values.shape[1]) - self.is_rational

    @cached_property
    def nets(self) -> FloatArray:
        """One net after another, (k, n+1, D) or (k, n+1, D + 1), for products with matrices."""
        return np.ascontiguousarray(self.values.transpose(2, 0, 1))

    @property
    def points(self) -> FloatArray:
        """Control points without weights, (n+1, D, k)."""
        return project(self.values, dimension=self.dimension)


@dataclass(frozen=True, eq=False, slots=True)
class Intervals(Items):
    """m intervals of parameters, each within one span of a curve.

    Attributes
    ----------
    source : ndarray of int, shape (m,)
        For each interval, the row of the interval from which it was cut, in ascending order.
    curve : ndarray of int, shape (m,)
    low, high : ndarray of float64, shape (m,)
        The ends: low ≤ high.
    span : ndarray of int, shape (m,)
        The number of the span among those of its curve.
    """

    source: Ints
    curve: Ints
    low: FloatArray
    high: FloatArray
    span: Ints


_BANDS = (1, 2, 3, 7, 11, 15, 23, 31, 47, 64)
"""Curves whose degrees are between two of these numbers, with the greater one, are one group."""


def merge_groups(
    groups: Sequence[SpanNets], group: Ints, row: Ints
) -> tuple[tuple[SpanNets, ...], Ints, Ints]:
    """Groups of similar degrees as one: its nets have the highest degree of its members.

    A part of many degrees would otherwise need every array operation for each of them.

    Parameters
    ----------
    group, row : ndarray of int, shape (n,)
        The group of each curve, and the column of its first span there.

    Returns
    -------
    groups, group, row
        The same for the groups that remain.
    """
    members: dict[tuple[int, bool], list[int]] = {}
    for number, nets in enumerate(groups):
        key = bisect_left(_BANDS, nets.degree), nets.is_rational
        members.setdefault(key, []).append(number)
    if len(members) == len(groups):
        return tuple(groups), group, row
    merged: list[SpanNets] = []
    to_group, shift = np.zeros((2, len(groups)), np.intp)
    for numbers in members.values():
        degree = max(groups[number].degree for number in numbers)
        parts = []
        column = 0
        for number in numbers:
            values = groups[number].values
            while len(values) <= degree:
                values = elevate(values)
            to_group[number], shift[number] = len(merged), column
            column += values.shape[2]
            parts.append(values)
        merged.append(SpanNets(np.concatenate(parts, axis=2), groups[numbers[0]].is_rational))
    return tuple(merged), to_group[group], row + shift[group]


def interpolate(points: FloatArray, x: FloatArray, order: int) -> list[FloatArray]:
    """Values (D, m) of Bézier curves (n+1, D, m) at x (m,), and derivatives in x up to `order`.

    De Casteljau's algorithm; derivative k is n (n − 1) … times the k-th difference of its points
    before the last k steps.
    """
    degree, complement = len(points) - 1, 1.0 - x
    levels: list[FloatArray] = [points]
    for _ in range(degree):
        mixed = points[:-1] * complement
        mixed += points[1:] * x
        points = mixed
        levels.append(points)
    results = [points[0]]
    factor = 1.0
    for k in range(1, order + 1):
        factor *= degree - k + 1
        if k > degree:
            results.append(np.zeros_like(points[0]))
            continue
        differences = levels[degree - k]
        for _ in range(k):
            differences = differences[1:] - differences[:-1]
        results.append(factor * differences[0])
    return results


def project_levels(levels: list[FloatArray]) -> list[FloatArray]:
    """Derivatives of C = X / w from those of (X, w): C′ = (X′ − w′ C) / w and so on."""
    x, w = [level[:-1] for level in levels], [level[-1] for level in levels]
    results = [x[0] / w[0]]
    if len(levels) > 1:
        results.append((x[1] - w[1] * results[0]) / w[0])
    if len(levels) > 2:
        results.append((x[2] - 2 * w[1] * results[1] - w[2] * results[0]) / w[0])
    return results
