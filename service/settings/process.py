"""What the process is told before it computes anything."""

import ctypes
import gc
import platform

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be told anything)
from threadpoolctl import threadpool_limits

M_MMAP_THRESHOLD = -3
"""Number of the parameter in glibc's `malloc.h`."""

OWN_PAGES = 1 << 18
"""Bytes from which a block of memory has pages of its own, which it gives back when it is freed."""


def pin_blas() -> None:
    """Keeps BLAS on one thread for the rest of the process.

    The matrices of a surface are small: more threads only wait for each other, and under load
    the slowest requests take twenty times as long.
    """
    threadpool_limits(limits=1, user_api="blas")


def free_at_once() -> None:
    """Makes large arrays give their memory back to the system when they are freed.

    By itself glibc takes ever larger blocks, up to 32 MiB, from heaps that shrink only at their
    ends: after a few large meshes on two threads 470 MB were resident where now 120 are. Fresh
    pages cost large meshes up to a fifth of their time. Elsewhere than on glibc nothing is done.

    References
    ----------
    mallopt(3): the threshold adjusts itself unless it is set.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(M_MMAP_THRESHOLD, OWN_PAGES)


def give_back() -> None:
    """Hands whole pages that nothing lies on back to the system: of blocks below `OWN_PAGES`.

    References
    ----------
    malloc_trim(3).
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)


def collect_rarely() -> None:
    """Looks for garbage that holds on to itself seldom, and not among what is there already.

    Python looks whenever some hundred objects more are alive: while a large document becomes lists
    that takes four times as long as the parsing, with everybody waiting. What is there at the
    start stays anyway.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)
