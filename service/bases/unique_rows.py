"""Which rows of an array are equal: rows are compared by a hash."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints


def unique_values(values: NDArray[np.uint64] | Ints) -> tuple[Ints, Ints]:
    """The distinct values of an array, by their positions.

    For a few hundred values this function takes half the time of `numpy.unique`.

    Returns
    -------
    first : ndarray of int, shape (D,)
        The first position of each distinct value; the values are in ascending order. It equals the
        result `return_index` of `numpy.unique`.
    number : ndarray of int, shape (len(values),)
        `values[first[number]]` equals `values`. It equals the result `return_inverse`.
    """
    order = values.argsort(kind="stable")
    sorted_values = values[order]
    is_first = np.empty(len(values), np.bool_)
    is_first[:1] = True
    np.not_equal(sorted_values[1:], sorted_values[:-1], out=is_first[1:])
    number = np.empty(len(values), np.intp)
    number[order] = is_first.cumsum() - 1
    return order[is_first], number


def unique_rows(rows: FloatArray) -> tuple[Ints, Ints]:
    """The distinct rows of an array, by their positions, in no particular order.

    The rows must not contain −0, because rows are compared by a hash of their bits. The result is
    checked: if two different rows have the same hash, the rows are sorted by their numbers
    in place of their hashes.

    Parameters
    ----------
    rows : ndarray of float64, shape (N, d)

    Returns
    -------
    first : ndarray of int, shape (D,)
        The first position of each distinct row.
    number : ndarray of int, shape (N,)
        `rows[first[number]]` equals `rows`.
    """
    rows = np.ascontiguousarray(rows)
    bits = rows.view(np.uint64)
    hashes = (bits ^ (bits >> np.uint64(29))) * _multipliers(rows.shape[1])
    hashes ^= hashes >> np.uint64(32)
    first, number = unique_values(hashes.sum(axis=1))
    if not np.array_equal(rows[first[number]], rows):
        _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, number.reshape(-1)  # NumPy 2.0 returns a column


def find_first_rows(rows: FloatArray) -> tuple[Ints, Ints]:
    """The distinct rows of an array, by their positions, in the order in which they first occur.

    Parameters
    ----------
    rows : ndarray of float64, shape (N, d)
        Without −0.

    Returns
    -------
    first : ndarray of int, shape (D,)
        The first position of each distinct row, ascending.
    number : ndarray of int, shape (N,)
        `rows[first[number]]` equals `rows`.
    """
    first, number = unique_rows(rows)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[number]


@cache
def _multipliers(count: int) -> NDArray[np.uint64]:
    """Odd pseudo-random numbers (splitmix64), the same in every process: shape (count,)."""
    state = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    state = (state ^ (state >> np.uint64(31))) | np.uint64(1)
    state.flags.writeable = False
    return state
