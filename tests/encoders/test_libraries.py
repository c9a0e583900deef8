"""`describe_platform`: another processor, which may round differently, has another text."""

import os
import platform
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

from tools.programs import run_python

OLD_CORES = {"x86_64": ("Prescott", "Nehalem"), "aarch64": ("ARMV8", "NEOVERSEN1")}
"""Two processors whose code in OpenBLAS runs on all processors of the same architecture."""

PROGRAM = "from service.encoders.libraries import describe_platform; print(describe_platform())"


def describe_with_core(core: str) -> str:
    """The text of `describe_platform` if OpenBLAS uses the code for the processor `core`."""
    environment = {**os.environ, "OPENBLAS_CORETYPE": core}
    return run_python("-c", PROGRAM, env=environment, cwd=Path(__file__).parents[2]).stdout


@pytest.mark.slow
def test_the_text_depends_on_the_processor() -> None:
    if not any(library["internal_api"] == "openblas" for library in threadpool_info()):
        pytest.skip("only OpenBLAS can use the code for another processor")
    first_core, second_core = OLD_CORES[platform.machine()]
    assert describe_with_core(first_core) != describe_with_core(second_core)
