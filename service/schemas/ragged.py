"""The rows of a triangle in a document, and the one run of numbers that they are elsewhere."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.bases.triangle import degree_of, degree_or_none, row_starts
from service.errors import InvalidRequest, Issue


def rows_of(values: NDArray[Any]) -> list[NDArray[Any]]:
    """The rows of n+1, n, … 1 entries that an array over a triangle stands for."""
    starts = row_starts(degree_of(len(values)))
    return np.split(values, starts[1:-1])


def in_rows(error: InvalidRequest, prefix: str, count: int) -> InvalidRequest:
    """The same error, entry k below `prefix` (a pattern) pointed at as entry j of row m.

    `count` is the number of entries of the triangle.
    """
    degree = degree_or_none(count)
    if degree is None:
        return error
    starts = row_starts(degree)

    def moved(issue: Issue) -> Issue:
        found = re.match(rf"({prefix})/(\d+)(/.*)?\Z", issue.pointer)
        if found is None:
            return issue
        entry = int(found[2])
        row = int(np.searchsorted(starts, entry, side="right")) - 1
        where = f"{found[1]}/{row}/{entry - int(starts[row])}{found[3] or ''}"
        return replace(issue, pointer=where)

    return InvalidRequest(*map(moved, error.issues))
