"""The pages of docs/ show what there is."""

from pathlib import Path

from service.api.openapi.curve import REQUESTS
from service.surface.examples import EXAMPLES
from tools.picture import listing

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_of_the_examples_lists_them_all() -> None:
    assert (DOCS / "examples.md").read_text(encoding="utf-8") == listing()


def test_every_example_has_its_picture_and_no_picture_is_of_nothing() -> None:
    for folder, names in (("examples", EXAMPLES), ("curves", REQUESTS)):
        pictures = [path.read_bytes()[:4] for path in (DOCS / folder).iterdir()]
        assert pictures == [b"\x89PNG"] * len(names)
        assert {path.stem for path in (DOCS / folder).iterdir()} == set(names)
