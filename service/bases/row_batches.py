"""Rows of an array: runs of consecutive rows, and which rows are equal.

Work on one batch of rows at a time keeps temporary arrays small. Equal rows are found by a hash.
"""

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import AnyInts, Bools, FloatArray, IndexArray, Ints
from service.cancellation import checkpoint


def row_runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    """Ranges [begin, end) of `step` rows that cover `count` rows; the last may be shorter.

    A request can be cancelled before each range.
    """
    for begin in range(0, count, step):
        checkpoint()
        yield begin, min(begin + step, count)


def row_slices(count: int, width: int, max_size: int) -> Iterator[slice]:
    """Slices that cover `count` rows. A row has the size `width`, in numbers or in bytes.

    A slice has at most the size `max_size`, in the same unit, but at least one row. A request can
    be cancelled before each slice.
    """
    for begin, end in row_runs(count, max(1, max_size // width)):
        yield slice(begin, end)


def expand_runs(count: Ints, first: Ints | int = 0) -> tuple[Ints, Ints]:
    """The rows of n runs, one run after another: for each row its run and its number.

    Parameters
    ----------
    count : ndarray of int, shape (n,)
        How many rows each run has.
    first : ndarray of int, shape (n,), or int
        The number of the first row of each run; the rows of a run are numbered consecutively.

    Returns
    -------
    run, number : ndarray of int, shape (Σ count,)
    """
    run = np.arange(len(count)).repeat(count)
    number = np.arange(len(run))
    number += (first - count.cumsum() + count).take(run)
    return run, number


def mark_begins(values: NDArray[np.uint64] | Ints) -> Bools:
    """Whether each row of an array (n,) begins a run of equal values.

    This is faster than `numpy.diff` for a few hundred rows.
    """
    is_first = np.empty(len(values), np.bool_)
    is_first[:1] = True
    np.not_equal(values[1:], values[:-1], out=is_first[1:])
    return is_first


def find_begins(values: Ints) -> Ints:
    """The first rows (k,) of the runs of equal values of an array (n,)."""
    return mark_begins(values).nonzero()[0]


def count_runs(begins: Ints, count: int) -> Ints:
    """Numbers of rows (k,) of the runs that begin at these rows, of `count` rows."""
    counts = np.empty_like(begins)
    np.subtract(begins[1:], begins[:-1], out=counts[:-1])
    counts[-1:] = count - begins[-1:]
    return counts


def split_runs(is_break: Bools) -> list[slice]:
    """The runs of N rows, as slices: row k + 1 begins a new run if `is_break[k]`, (N − 1,)."""
    ends = [0, *(np.flatnonzero(is_break) + 1).tolist(), len(is_break) + 1]
    return [slice(begin, end) for begin, end in pairwise(ends)]


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
    sorted_values = values.take(order)
    is_first = mark_begins(sorted_values)
    number = np.empty(len(values), np.intp)
    number[order] = is_first.cumsum() - 1
    return order[is_first], number


def first_positions(numbers: AnyInts, count: int) -> IndexArray:
    """The first position of each of the numbers 0 … count − 1 in an array of them, (count,).

    Positions of numbers that do not occur are 0. Takes time in proportion to the sizes, without
    sorting.
    """
    first: IndexArray = np.zeros(count, np.uint32)
    # In reverse order, the first position of each number is written last, and stays.
    first[numbers[::-1]] = np.arange(len(numbers), dtype=np.uint32)[::-1]
    return first


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
