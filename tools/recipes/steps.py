"""The types of a recipe and of its steps."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Step:
    """One step: writes a new file, or inserts texts into a file.

    `path` is the path of the file in the checkout, and `text` the text of a new file. `insertions`
    are pairs of a text of the file, and a text that is inserted after it.
    """

    path: str
    text: str = ""
    insertions: tuple[tuple[str, str], ...] = ()

    def apply(self, checkout: Path) -> None:
        """Writes or changes the file in a checkout."""
        file = checkout / self.path
        text = file.read_text(encoding="utf-8") if self.insertions else self.text
        for anchor, insertion in self.insertions:
            assert anchor in text, f"{self.path} does not contain {anchor!r}"
            text = text.replace(anchor, anchor + insertion, 1)
        file.write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class Recipe:
    """The steps of a recipe, the largest number of files that they may change, and its tests.

    `tests` are run in addition to the tests for all recipes.
    """

    max_files: int
    steps: tuple[Step, ...]
    tests: tuple[str, ...]
