"""Finds programs of other projects, for example browsers; a test without its program is skipped.

With TESTS_REQUIRE_TOOLS=1, as in `.ci/run`, a skipped test counts as failed
(`tests/conftest.py`), because `.ci/run` installs all programs first.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NODE_MODULES = Path(__file__).parents[1] / "tests" / "web" / "node_modules"


def find_program(*names: str) -> str:
    """The path of the first of these programs that is on PATH or in the folder of Python.

    If all are missing, the test is skipped.
    """
    path = os.pathsep.join((os.environ.get("PATH", os.defpath), str(Path(sys.executable).parent)))
    for name in names:
        if program := shutil.which(name, path=path):
            return program
    pytest.skip(f"not installed: {' or '.join(names)}")


def find_chromium() -> str:
    """The path of Chromium or Google Chrome; if both are missing, the test is skipped."""
    return find_program("chromium", "chromium-browser", "google-chrome")


def find_node_package(name: str) -> Path:
    """The folder of a package of `tests/web/package.json`; if missing, the test is skipped."""
    folder = NODE_MODULES / name
    if not folder.is_dir():
        pytest.skip(f"not installed: {name} ('make test' fetches it from the npm registry)")
    return folder


def run_python(
    *arguments: str, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Runs this Python with these arguments until it ends; returns its status and output.

    With `check`, a status other than 0 raises `CalledProcessError`.
    """
    command = [sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=check, **options)
