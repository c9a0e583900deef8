"""Generated pages agree with the code."""

import subprocess
import sys
from pathlib import Path

import pytest

from tools.pages import PAGES


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.name)
def test_generated_files_are_up_to_date(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert text == PAGES[file](text), "run `make generated`"


def test_importing_the_pages_does_not_import_the_command_line() -> None:
    # The command line reads the file of flags on import. If it were imported before this file is
    # written, the list of names would lack the flag of a new option until the next run.
    code = "import sys, tools.pages; sys.exit('service.cli.mesh' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
