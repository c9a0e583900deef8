"""Values of many arrays in the cache of plans: shared, read-only, and counted in bytes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.bases.cache import MESH_PLANS
from service.bases.kept import count_bytes, find_arrays, keep


@dataclass(frozen=True, eq=False)
class Columns:
    """Arrays at several depths; one is computed when it is first used."""

    points: FloatArray
    groups: tuple[dict[str, FloatArray], ...] = ()

    @cached_property
    def squares(self) -> FloatArray:
        return self.points**2


def build_columns() -> Columns:
    """Columns of three arrays of 800 bytes, two of which are parts of one array of 1,600 bytes."""
    both = np.ones(200)
    return Columns(np.zeros(100), ({"low": both[:100], "high": both[100:]},))


def test_a_value_is_built_once_for_equal_keys() -> None:
    """The second call has the object of the first; another key has another one."""
    first = keep(("columns", 1), build_columns)
    assert keep(("columns", 1), build_columns) is first
    assert keep(("columns", 2), build_columns) is not first


def test_the_arrays_are_read_only_at_any_depth() -> None:
    """Requests share them."""
    columns = keep(("columns", 3), build_columns)
    with pytest.raises(ValueError, match="read-only"):
        columns.points[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        columns.groups[0]["high"][0] = 1.0


def test_the_bytes_are_those_of_whole_arrays_each_once() -> None:
    """Views count with the array that they are parts of, and later properties count, too."""
    columns = build_columns()
    arrays, _ = find_arrays((columns, columns))
    assert len(arrays) == 3
    assert count_bytes(arrays) == 2400
    assert columns.squares.nbytes == 800
    assert count_bytes(find_arrays(columns)[0]) == 3200


def test_the_cache_counts_them() -> None:
    """With room for properties that are computed later."""
    before = MESH_PLANS.nbytes
    columns = keep(("columns", 4), build_columns)
    assert columns.squares.nbytes
    assert MESH_PLANS.nbytes - before >= count_bytes(find_arrays(columns)[0])
