"""Distinct rows of arrays, found by a hash."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints


def unique_values(values: NDArray[np.uint64] | Ints) -> tuple[Ints, Ints]:
    """First position of every distinct value, in ascending order, and the number of each value.

    The results are equal to `return_index` and `return_inverse` of `numpy.unique`, and take half
    the time for a few hundred values. Shapes (D,) and (len(values),).
    """
    order = values.argsort(kind="stable")
    ordered = values[order]
    begins = np.empty(len(values), np.bool_)
    begins[:1] = True
    np.not_equal(ordered[1:], ordered[:-1], out=begins[1:])
    number = np.empty(len(values), np.intp)
    number[order] = begins.cumsum() - 1
    return order[begins], number


def unique_rows(rows: FloatArray) -> tuple[Ints, Ints]:
    """First position of every distinct row, and the number of each row among these.

    Rows are equal if their numbers are equal; they must not contain −0. The rows are found by a
    hash of their bits, which is checked: if two different rows share a hash, the rows themselves
    are sorted instead.

    Returns
    -------
    first : ndarray of int, shape (D,)
    number : ndarray of int, shape (len(rows),)
        `rows[first[number]]` equals `rows`.
    """
    rows = np.ascontiguousarray(rows)
    bits = rows.view(np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * _multipliers(rows.shape[1])
    mixed ^= mixed >> np.uint64(32)
    first, number = unique_values(mixed.sum(axis=1))
    if not np.array_equal(rows[first[number]], rows):
        _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, number.reshape(-1)


def find_first_rows(rows: FloatArray) -> tuple[Ints, Ints]:
    """First place of every distinct row, ascending; and the number of each row among them."""
    first, number = unique_rows(rows)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[number]


@cache
def _multipliers(count: int) -> NDArray[np.uint64]:
    """Odd pseudo-random numbers (splitmix64), equal in every run."""
    state = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    state = (state ^ (state >> np.uint64(31))) | np.uint64(1)
    state.flags.writeable = False
    return state
