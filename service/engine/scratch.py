"""Work arrays that are used again: fresh memory costs more than the arithmetic done in it."""

from math import prod
from threading import local
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray

Real: TypeAlias = type[np.float32] | type[np.float64]

CACHE_LINE = 64
"""Vector instructions take twice as long for numbers that lie across two lines."""


class _Arena(local):
    """What each thread holds: memory by name, and the last view of it in each precision."""

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


def _aligned(size: int) -> NDArray[np.uint8]:
    """Fresh memory that begins at a cache line."""
    room = np.empty(size + CACHE_LINE, np.uint8)
    begin = -room.ctypes.data % CACHE_LINE
    return room[begin : begin + size]
