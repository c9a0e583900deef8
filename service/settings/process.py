"""What the process is told before it computes anything."""

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be told anything)
from threadpoolctl import threadpool_limits


def pin_blas() -> None:
    """Keeps BLAS on one thread for the rest of the process.

    The matrices of a surface are small: more threads only wait for each other, and under load
    the slowest requests take twenty times as long.
    """
    threadpool_limits(limits=1, user_api="blas")
