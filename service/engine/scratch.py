"""Work arrays that are used again: fresh memory costs more than the arithmetic done in it."""

from collections.abc import Callable
from math import prod
from threading import local
from typing import Any, Generic, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray

Real: TypeAlias = type[np.float32] | type[np.float64]

CACHE_LINE = 64
"""Vector instructions take twice as long for numbers that lie across two lines."""


MOST_HELD = 4
"""Workspaces of one kind that a thread keeps."""

Work = TypeVar("Work")


class _Arena(local):
    """The work memory of one thread by name, and its last view in each precision."""

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

    The same memory is handed out again for the same name in the same thread: use it up before the
    next call. The system zeroes every page of fresh memory, which takes longer than a dozen
    multiplications a number.
    """
    views = _arena.views
    view = views.get((name, dtype))
    if view is not None and view.shape == shape:
        return view
    size = prod(shape) * np.dtype(dtype).itemsize
    memory = _arena.memory.get(name)
    if memory is None or len(memory) < size:
        memory = _arena.memory[name] = _aligned(size)
    numbers: RealArray = memory[:size].view(dtype)
    views[name, dtype] = numbers.reshape(shape)
    return views[name, dtype]


class Workspaces(local, Generic[Work]):
    """Memory that is cut once into all the arrays of a piece of work, for each thread by itself.

    Parameters
    ----------
    make : callable
        Makes the workspace of a key from the parts of the key.
    """

    def __init__(self, make: Callable[..., Work]) -> None:
        self._make = make
        self._held: dict[tuple[Any, ...], Work] = {}

    def get(self, *key: Any) -> Work:
        """The workspace of this key, with undefined contents: use it up before the next call."""
        work = self._held.get(key)
        if work is None:
            if len(self._held) >= MOST_HELD:
                del self._held[next(iter(self._held))]
            work = self._held[key] = self._make(*key)
        return work


def _aligned(size: int) -> NDArray[np.uint8]:
    """Fresh memory that begins at a cache line."""
    room = np.empty(size + CACHE_LINE, np.uint8)
    begin = -room.ctypes.data % CACHE_LINE
    return room[begin : begin + size]
