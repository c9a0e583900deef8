"""Work arrays that are used again: fresh memory costs more than the arithmetic done in it."""

from math import prod
from threading import local
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.engine.mesh import RealArray

Real: TypeAlias = type[np.float32] | type[np.float64]

_arena = local()


def scratch(name: str, shape: tuple[int, ...], dtype: Real) -> RealArray:
    """An array of this shape with undefined contents.

    The same memory is handed out again for the same name in the same thread: use it up before the
    next call. The system zeroes every page of fresh memory, which takes longer than a dozen
    multiplications a number.
    """
    size = prod(shape) * np.dtype(dtype).itemsize
    memory: NDArray[np.uint8] | None = getattr(_arena, name, None)
    if memory is None or len(memory) < size:
        memory = np.empty(size, np.uint8)
        setattr(_arena, name, memory)
    numbers: RealArray = memory[:size].view(dtype)
    return numbers.reshape(shape)
