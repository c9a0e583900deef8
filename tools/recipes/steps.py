"""The types of recipes: steps in a checkout, and the tests that judge the result."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Step:
    """A step: writes a new file with a text, or inserts texts behind given texts of a file.

    `path` is relative to the checkout.
    """

    path: str
    text: str = ""
    behind: tuple[tuple[str, str], ...] = ()

    def do(self, checkout: Path) -> None:
        """Carries out the step in a checkout."""
        file = checkout / self.path
        text = file.read_text(encoding="utf-8") if self.behind else self.text
        for place, added in self.behind:
            before, separator, after = text.partition(place)
            assert separator, f"{self.path}: {place!r} is not there"
            text = before + separator + added + after
        file.write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class Recipe:
    """Steps, the most files that they may touch, and tests in addition to the common ones."""

    most: int
    steps: tuple[Step, ...]
    tests: tuple[str, ...]
