"""Names for the types of arrays."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
RealArray: TypeAlias = NDArray[np.floating[Any]]
"""An array in single or double precision."""
IndexArray: TypeAlias = NDArray[np.uint32]
"""Indices as file formats store them."""
Ints: TypeAlias = NDArray[np.intp]
AnyInts: TypeAlias = NDArray[np.intp] | NDArray[np.uint32]
"""Whole numbers, in 64 bits or, where many are kept, in 32."""
Bools: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
AnyArray: TypeAlias = NDArray[Any]
