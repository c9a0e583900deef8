"""Generated pages agree with the code."""

import subprocess
import sys
from pathlib import Path

import pytest

from tools.pages import PAGES


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.name)
def test_a_page_is_that_of_the_code(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert text == PAGES[file](text), "run `make generated`"


def test_flags_are_written_before_the_command_line_reads_them() -> None:
    # Otherwise the list of names lacks the flag of a new option until the second `make generated`.
    code = "import sys, tools.pages; sys.exit('service.cli.mesh' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
