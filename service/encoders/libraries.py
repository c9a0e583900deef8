"""Describes the libraries and the processor, because the bytes of a file depend on them.

BLAS and NumPy add numbers in an order that suits the processor, and rounding depends on the order.
So two machines may compute meshes of the same surface that differ in some last digits. Both meshes
are valid. Which kinds of compression the service has depends on the installed libraries, too.
"""

import platform
from functools import cache

import numpy as np
from threadpoolctl import threadpool_info

from service.encoders.format import Compression
from service.encoders.gltf import meshopt


def list_compressions() -> tuple[Compression, ...]:
    """The kinds of compression whose library is installed, without `none`."""
    return ("meshopt",) if meshopt.is_available() else ()


def describe_writer(compression: Compression) -> str:
    """A text that names the libraries and the processor, for entity tags.

    If two machines have different texts, their files of the same mesh may differ. Another version
    of a library may compress the same content to other bytes.
    """
    version = f"meshopt {meshopt.library_version()}" if compression == "meshopt" else ""
    return f"{describe_platform()} {version}"


@cache
def describe_platform() -> str:
    """The versions of the libraries, and the kinds of processor for which their code was chosen."""
    extensions = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    blas = {
        f"{library['internal_api']} {library['version']} {library.get('architecture')}"
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }
    machine = (platform.machine(), *platform.libc_ver())
    return "; ".join([" ".join(machine), f"numpy {np.__version__}", *extensions, *sorted(blas)])
