"""A cache of read-only arrays, bounded by the bytes they hold."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Array = TypeVar("Array", bound=NDArray[Any])


class ArrayCache:
    """Least-recently-used arrays by key, at most `capacity` bytes of them.

    What is handed out is shared between requests and threads, hence read-only. An array larger
    than an eighth of the capacity is computed and given, not kept: one absurd request must not
    empty the cache for the others. Two threads that miss the same key at once both compute it and
    both get the same figures; holding the lock meanwhile would make every other request wait.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._arrays: OrderedDict[Hashable, NDArray[Any]] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    @property
    def nbytes(self) -> int:
        """Bytes held now."""
        return self._bytes

    def __len__(self) -> int:
        return len(self._arrays)

    def get(self, key: Hashable, build: Callable[[], Array]) -> Array:
        """The array of this key, built now if it is not held. The key must determine the array."""
        with self._lock:
            held = self._arrays.get(key)
            if held is not None:
                self._arrays.move_to_end(key)
                return cast(Array, held)
        array = np.ascontiguousarray(build())
        array.flags.writeable = False
        with self._lock:
            if key not in self._arrays and array.nbytes <= self.capacity // 8:
                self._arrays[key] = array
                self._bytes += array.nbytes
                while self._bytes > self.capacity:
                    _, dropped = self._arrays.popitem(last=False)
                    self._bytes -= dropped.nbytes
        return cast(Array, array)


PLANS = ArrayCache(64 << 20)
"""Everything that depends on degrees and samplings alone: bases, index patterns."""
