"""Counts a store's operations by kind and outcome, and adds up their seconds."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from service.errors import DamagedObject, StoreFailed, StoreFull


@dataclass(slots=True)
class Total:
    """The number of operations of one kind with one outcome, and the sum of their seconds."""

    count: int = 0
    seconds: float = 0.0


class Operations:
    """Totals by kind and outcome: `done`, `refused` (the store is full) or `failed`."""

    def __init__(self) -> None:
        self.totals: dict[tuple[str, str], Total] = {}

    @contextmanager
    def count(self, kind: str) -> Iterator[None]:
        """Counts the operation in the `with` block. A missing object is not a failure."""
        start, outcome = time.perf_counter(), "done"
        try:
            yield
        except StoreFull:
            outcome = "refused"
            raise
        except (StoreFailed, DamagedObject):
            outcome = "failed"
            raise
        finally:
            total = self.totals.setdefault((kind, outcome), Total())
            total.count += 1
            total.seconds += time.perf_counter() - start
