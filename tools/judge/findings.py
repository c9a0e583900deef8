"""The findings of the judge of parts: counts, and a line for each of the first faults."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from service.bases.arrays import Bools

SHOWN = 3
"""Faults of one kind for which a line is written."""


@dataclass(eq=False)
class Findings:
    """Counts by name, lines about faults, and the largest width of intervals.

    `case` and `seed` make the questions again. A width is in units of the width that the question
    asks for.
    """

    case: str
    seed: int
    counts: Counter[str] = field(default_factory=Counter)
    lines: list[str] = field(default_factory=list)
    width: float = 0.0

    def add(self, text: str, rows: Bools, describe: Callable[[int], str]) -> None:
        """Adds a fault for each row (m,) that is true; `describe` says more about one."""
        numbers = np.flatnonzero(rows)
        self.counts["wrong"] += len(numbers)
        self.lines += [
            f"{self.case}, seed {self.seed}: {text} {n}: {describe(n)}"
            for n in numbers[:SHOWN].tolist()
        ]
