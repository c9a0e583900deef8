"""What rounding depends on is told apart."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

PROGRAM = "from service.pipeline.arithmetic import arithmetic; print(arithmetic())"


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
    architectures = {library.get("architecture") for library in threadpool_info()}
    if not architectures & {"SkylakeX", "Haswell", "Zen", "Cooperlake", "Sapphirerapids"}:
        pytest.skip("no OpenBLAS for processors with AVX2")
    assert told("Haswell") == told("Haswell")
    assert told("Haswell") != told("Nehalem")
