"""Programs of other projects that check our files. A test without its program is skipped.

With TESTS_REQUIRE_TOOLS=1, as in `.ci/run`, a skipped test counts as a failed one
(`tests/conftest.py`), because `.ci/run` installs all programs first.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NODE_MODULES = Path(__file__).parent / "web" / "node_modules"


def find_program(*names: str) -> str:
    """Path of the first of these programs on PATH or beside Python; without any, skips the test."""
    path = os.pathsep.join((os.environ.get("PATH", os.defpath), str(Path(sys.executable).parent)))
    for name in names:
        if result := shutil.which(name, path=path):
            return result
    pytest.skip(f"not installed: {' or '.join(names)}")


def find_chromium() -> str:
    """Path of Chromium; without it, skips the test."""
    return find_program("chromium", "chromium-browser", "google-chrome")


def find_node_package(name: str) -> Path:
    """Folder of a package of `tests/web/package.json`; without it, skips the test."""
    folder = NODE_MODULES / name
    if not folder.is_dir():
        pytest.skip(f"not installed: {name} ('make test' fetches it from the npm registry)")
    return folder


def run_python(
    *arguments: str, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Runs this Python; returns the ended process with its output."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=check, **options)
