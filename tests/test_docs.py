"""The pages of docs/ show what there is."""

from pathlib import Path

import pytest

from service.surface.examples import EXAMPLES
from tests.web.picture import listing

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_of_the_examples_lists_them_all() -> None:
    assert (DOCS / "examples.md").read_text(encoding="utf-8") == listing()


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_has_its_picture(example: str) -> None:
    assert (DOCS / "examples" / f"{example}.png").read_bytes()[:4] == b"\x89PNG"


def test_no_picture_is_of_nothing() -> None:
    assert {path.stem for path in (DOCS / "examples").iterdir()} == set(EXAMPLES)
