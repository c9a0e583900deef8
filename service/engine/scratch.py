"""Work arrays that are reused, because new memory costs more time than the arithmetic."""

from collections.abc import Callable
from math import prod
from threading import local
from typing import Any, Generic, TypeAlias, TypeVar, overload

import numpy as np

from service.bases.arrays import Bytes, FloatArray, RealArray

Real: TypeAlias = type[np.float32] | type[np.float64]

CACHE_LINE = 64
"""Bytes in a cache line. Vector instructions take twice as long for numbers that span two lines."""


MAX_WORKSPACES = 4
"""The most workspaces of one kind that a thread keeps, so that unusual sizes do not fill memory."""

Work = TypeVar("Work")


class _Arena(local):
    """The work memory of one thread: a block of bytes for each name, and the last array in it."""

    def __init__(self) -> None:
        self.memory: dict[str, Bytes] = {}
        self.views: dict[tuple[str, Real], RealArray] = {}


_arena = _Arena()


@overload
def scratch(name: str, shape: tuple[int, ...], dtype: type[np.float64]) -> FloatArray: ...
@overload
def scratch(name: str, shape: tuple[int, ...], dtype: Real) -> RealArray: ...
def scratch(name: str, shape: tuple[int, ...], dtype: Real) -> RealArray:
    """An array of this shape with undefined contents.

    The next call with this name in the same thread returns the same memory, so the caller must
    finish with the array before that call. New memory would be slower: the operating system zeroes
    each of its pages, which takes longer than a dozen multiplications for each number.
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
    build : callable
        Builds the workspace of a key from the parts of the key.
    """

    def __init__(self, build: Callable[..., Work]) -> None:
        self._build = build
        self._workspaces: dict[tuple[Any, ...], Work] = {}

    def get(self, *key: Any) -> Work:
        """The workspace of this key, with undefined contents, valid until the key is used again."""
        work = self._workspaces.get(key)
        if work is None:
            if len(self._workspaces) >= MAX_WORKSPACES:
                del self._workspaces[next(iter(self._workspaces))]
            work = self._workspaces[key] = self._build(*key)
        return work


def _allocate_aligned(size: int) -> Bytes:
    """New memory that begins at a cache line."""
    padded = np.empty(size + CACHE_LINE, np.uint8)
    begin = -padded.ctypes.data % CACHE_LINE
    return padded[begin : begin + size]
