"""Generated pages agree with the code."""

from pathlib import Path

import pytest

from tools.pages import PAGES


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.name)
def test_a_page_is_that_of_the_code(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert text == PAGES[file](text), "run `make generated`"
