"""A clock that tests set, in place of `time.monotonic`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from unittest.mock import patch


@dataclass
class Clock:
    """The time in seconds; it stands still until a test changes it."""

    now: float = 1000.0

    def __call__(self) -> float:
        return self.now


@contextmanager
def stop_clock() -> Iterator[Clock]:
    """Stops `time.monotonic` for the service and for the event loop, until the block ends."""
    with patch("time.monotonic", Clock()) as clock:
        yield clock
