"""What rounding depends on is told apart."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

OLD_CORES = {"x86_64": ("Prescott", "Nehalem"), "aarch64": ("ARMV8", "NEOVERSEN1")}
"""Two kinds of processor whose code runs on all that are in use."""

PROGRAM = "from service.encoders.arithmetic import arithmetic; print(arithmetic())"


def told(core: str) -> str:
    """What a process says whose BLAS computes as for such a processor."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "OPENBLAS_CORETYPE": core},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        check=True,
        text=True,
    ).stdout


def test_another_processor_is_another_arithmetic() -> None:
    if not any(library["internal_api"] == "openblas" for library in threadpool_info()):
        pytest.skip("no OpenBLAS, which can be told to compute as for another processor")
    one, other = OLD_CORES[platform.machine()]
    assert told(one) == told(one)
    assert told(one) != told(other)
