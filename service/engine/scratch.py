"""Work arrays that are reused, because new memory costs more time than the arithmetic."""

from collections.abc import Callable
from math import prod
from threading import local
from typing import Any, Generic, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray

Real: TypeAlias = type[np.float32] | type[np.float64]

CACHE_LINE = 64
"""Vector instructions take twice as long for numbers that span two lines."""


MOST_HELD = 4
"""The most workspaces of one kind that a thread keeps."""

Work = TypeVar("Work")


class _Arena(local):
    """The work memory of one thread by name, and its last views."""

    def __init__(self) -> None:
        self.memory: dict[str, NDArray[np.uint8]] = {}
        self.views: dict[tuple[str, Real], RealArray] = {}


_arena = _Arena()


@overload
def scratch(name: str, shape: tuple[int, ...], dtype: type[np.float64]) -> FloatArray: ...
@overload
def scratch(name: str, shape: tuple[int, ...], dtype: Real) -> RealArray: ...
def scratch(name: str, shape: tuple[int, ...], dtype: Real) -> RealArray:
    """An array of this shape with undefined contents.

    A second call with this name in the same thread returns the same memory, so the caller must
    finish with the array before that call. The system zeroes every page of new memory, which takes
    longer than a dozen multiplications for each number.
    """
    views = _arena.views
    view = views.get((name, dtype))
    if view is not None and view.shape == shape:
        return view
    size = prod(shape) * np.dtype(dtype).itemsize
    memory = _arena.memory.get(name)
    if memory is None or len(memory) < size:
        memory = _arena.memory[name] = _allocate_aligned(size)
    numbers: RealArray = memory[:size].view(dtype)
    views[name, dtype] = numbers.reshape(shape)
    return views[name, dtype]


class Workspaces(local, Generic[Work]):
    """Cached workspaces, separate for each thread; a workspace has all arrays of one computation.

    Parameters
    ----------
    make : callable
        Makes the workspace of a key from the parts of the key.
    """

    def __init__(self, make: Callable[..., Work]) -> None:
        self._make = make
        self._held: dict[tuple[Any, ...], Work] = {}

    def get(self, *key: Any) -> Work:
        """The workspace of this key, with undefined contents, valid until the next call."""
        work = self._held.get(key)
        if work is None:
            if len(self._held) >= MOST_HELD:
                del self._held[next(iter(self._held))]
            work = self._held[key] = self._make(*key)
        return work


def _allocate_aligned(size: int) -> NDArray[np.uint8]:
    """New memory that begins at a cache line."""
    room = np.empty(size + CACHE_LINE, np.uint8)
    begin = -room.ctypes.data % CACHE_LINE
    return room[begin : begin + size]
