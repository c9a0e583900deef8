"""Where the time of a request went: the header Server-Timing (W3C), in named steps."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from service.api.observing.record import current_record


class Timing:
    """Steps and how long each took, in the order in which they ended first.

    Parameters
    ----------
    mark : str
        What stands before the steps and has no length.
    before : Timing
        Its steps come first.
    """

    def __init__(self, mark: str = "", before: "Timing | None" = None) -> None:
        self._mark = mark
        self._steps: dict[str, float] = {} if before is None else before._steps.copy()

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Measures what is done within, also where it fails; several of one name are added up."""
        start = time.perf_counter()
        try:
            yield
        finally:
            seconds = time.perf_counter() - start
            self._steps[name] = self._steps.get(name, 0.0) + seconds
            record = current_record.get()
            if record is not None:
                record.steps.append((name, start, seconds))

    def __str__(self) -> str:
        """The header, in milliseconds."""
        steps = [f"{name};dur={seconds * 1e3:.3f}" for name, seconds in self._steps.items()]
        return ", ".join([self._mark, *steps] if self._mark else steps)
