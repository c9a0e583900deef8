"""Processors and libraries with other rounding have other names."""

import os
import platform
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

from tests.programs import run_python

OLD_CORES = {"x86_64": ("Prescott", "Nehalem"), "aarch64": ("ARMV8", "NEOVERSEN1")}
"""Two kinds of processor whose code runs on all that are in use."""

PROGRAM = "from service.encoders.arithmetic import describe_platform; print(describe_platform())"


def name_with_core(core: str) -> str:
    """The name in a process whose BLAS uses the code for another processor."""
    environment = {**os.environ, "OPENBLAS_CORETYPE": core}
    return run_python("-c", PROGRAM, env=environment, cwd=Path(__file__).parents[2]).stdout


def test_another_processor_is_another_arithmetic() -> None:
    if not any(library["internal_api"] == "openblas" for library in threadpool_info()):
        pytest.skip("only OpenBLAS can compute as for another processor")
    one, other = OLD_CORES[platform.machine()]
    assert name_with_core(one) != name_with_core(other)
