"""The cache of arrays: bounded in bytes, read-only, safe between threads."""

import time
from collections.abc import Callable
from threading import Barrier, Event, Thread

import numpy as np
import pytest
from numpy.typing import NDArray

from service.bases.cache import ArrayCache
from service.cancellation import Cancellation, OutOfTime, cancelled_by

KIB = 1024


def make_builder(size: int, value: float = 0.0) -> Callable[[], NDArray[np.float64]]:
    """A function that builds an array of `size` bytes, every element equal to `value`."""
    return lambda: np.full(size // 8, value)


def fail_to_build() -> NDArray[np.float64]:
    """A function for calls that must find their array in the cache."""
    raise AssertionError("built again although it was cached")


def test_an_array_is_built_once_and_is_read_only() -> None:
    """The second call returns the array of the first."""
    cache = ArrayCache(64 * KIB)
    first = cache.array("key", make_builder(KIB))
    assert cache.array("key", fail_to_build) is first
    assert not first.flags.writeable


def test_the_least_recently_used_array_is_evicted_first() -> None:
    """Getting an array makes it the most recently used."""
    cache = ArrayCache(8 * KIB)
    for name in range(8):
        cache.array(name, make_builder(KIB, name))
    cache.array(0, fail_to_build)
    cache.array(8, make_builder(KIB))
    cache.array(0, fail_to_build)
    with pytest.raises(AssertionError, match="built again"):
        cache.array(1, fail_to_build)


def test_arrays_never_take_more_than_the_capacity() -> None:
    """`nbytes` is the sum of the sizes of the arrays that are still cached."""
    cache = ArrayCache(10 * KIB)
    for name in range(100):
        cache.array(name, make_builder(8 * (1 + name)))
        assert cache.nbytes <= cache.capacity
    # The arrays of the last names are still cached.
    assert cache.nbytes == sum(8 * (1 + name) for name in range(100)[-len(cache) :])


def test_nothing_is_cached_if_the_builder_raises() -> None:
    """The next call builds again."""
    cache = ArrayCache(8 * KIB)
    with pytest.raises(AssertionError):
        cache.array("key", fail_to_build)
    assert (len(cache), cache.nbytes) == (0, 0)
    assert cache.array("key", make_builder(KIB, 5))[0] == 5


def test_threads_get_the_right_arrays_while_others_evict() -> None:
    """Four threads use more keys than the cache has room for; each gets the array of its key."""
    cache = ArrayCache(16 * KIB)
    start, wrong_keys = Barrier(4), []

    def request_arrays(offset: int) -> None:
        start.wait()
        for step in range(2000):
            name = (step * 7 + offset) % 40
            array = cache.array(name, make_builder(KIB, name))
            if array[0] != name or array[-1] != name or array.flags.writeable:
                wrong_keys.append(name)

    threads = [Thread(target=request_arrays, args=(11 * k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong_keys
    assert cache.nbytes == KIB * len(cache) <= cache.capacity


def test_a_thread_that_waits_for_another_can_be_cancelled() -> None:
    """It ends at its own deadline, not when the other thread has built the value."""
    cache, is_building, may_end = ArrayCache(8 * KIB), Event(), Event()

    def build_slowly() -> NDArray[np.float64]:
        is_building.set()
        assert may_end.wait(30)
        return np.zeros(8)

    builder = Thread(target=cache.array, args=("key", build_slowly))
    builder.start()
    assert is_building.wait(30)
    with cancelled_by(Cancellation(time.monotonic())), pytest.raises(OutOfTime):
        cache.array("key", fail_to_build)
    may_end.set()
    builder.join()
    assert cache.array("key", fail_to_build) is not None
