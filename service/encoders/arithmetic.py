"""What the bytes of a file depend on beside its mesh: libraries, the processor.

Products of matrices and sums are added up in an order that suits the processor: BLAS and NumPy
bring code of their own for each kind, and rounding depends on the order. So two machines may make
meshes of the same surface that differ in some last digits, each as good as the other.
"""

import platform
from functools import cache

import numpy as np
from threadpoolctl import threadpool_info

from service.encoders.compression import made_by
from service.encoders.format import Compression


def written_by(compression: Compression) -> str:
    """What else the bytes depend on, beside surface, options and engine: libraries, processor."""
    return f"{arithmetic()} {made_by(compression)}"


@cache
def arithmetic() -> str:
    """Versions of the libraries, and the kinds of processor that they have chosen."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    blas = {
        f"{library['internal_api']} {library['version']} {library.get('architecture')}"
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }
    machine = (platform.machine(), *platform.libc_ver())
    return "; ".join([" ".join(machine), f"numpy {np.__version__}", *found, *sorted(blas)])
