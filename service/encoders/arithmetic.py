"""The libraries and the processor, on which the bytes of a file depend.

BLAS and NumPy add up products and sums in an order that suits the processor, and rounding depends
on the order. So two machines may compute meshes of the same surface that differ in some last
digits; both are valid.
"""

import platform
from functools import cache

import numpy as np
from threadpoolctl import threadpool_info

from service.encoders.compression import find_version
from service.encoders.format import Compression


def written_by(compression: Compression) -> str:
    """Names the libraries and the processor, for entity tags: other names may mean other bytes."""
    return f"{arithmetic()} {find_version(compression)}"


@cache
def arithmetic() -> str:
    """Versions of the libraries, and the processor kinds that their code is chosen for."""
    extensions = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    blas = {
        f"{library['internal_api']} {library['version']} {library.get('architecture')}"
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }
    machine = (platform.machine(), *platform.libc_ver())
    return "; ".join([" ".join(machine), f"numpy {np.__version__}", *extensions, *sorted(blas)])
