"""What a store was asked to do, how often that went wrong, and how long it took."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from service.errors import DamagedObject, StoreFailed, StoreFull


@dataclass(slots=True)
class Done:
    """How many operations of one kind came to one end, and the seconds that they took."""

    count: int = 0
    seconds: float = 0.0


class Operations:
    """What was done so far, by kind and end: `done`, `refused` for want of room, or `failed`."""

    def __init__(self) -> None:
        self.so_far: dict[tuple[str, str], Done] = {}

    @contextmanager
    def told(self, kind: str) -> Iterator[None]:
        """Counts what is done within. What is not there is no failure of the store."""
        start, end = time.perf_counter(), "done"
        try:
            yield
        except StoreFull:
            end = "refused"
            raise
        except (StoreFailed, DamagedObject):
            end = "failed"
            raise
        finally:
            done = self.so_far.setdefault((kind, end), Done())
            done.count += 1
            done.seconds += time.perf_counter() - start
