"""The compute limit: how many thread seconds a minute each caller may use.

The method is that of the limit of requests (`service.api.guard.rates`), a token bucket stored as
the time at which it is full again. The seconds of work are known only afterwards, so work may begin
while anything is left, and its charge may overdraw the bucket; then the caller waits until the
bucket has been refilled above zero.
"""

import time
from collections import OrderedDict
from math import ceil, floor
from typing import NamedTuple

WINDOW = 60
"""Seconds over which the limit applies."""

MAX_CALLERS = 20_000
"""The most callers that are counted; beyond it, the least recent ones are forgotten."""


class ComputeState(NamedTuple):
    """The thread seconds that a caller may use now.

    Attributes
    ----------
    remaining : int
        Whole thread seconds that are left.
    reset : int
        Seconds until the caller may use the thread seconds of a whole minute at once.
    retry_after : int
        Seconds until work may begin; 0 if it may begin now.
    """

    remaining: int
    reset: int
    retry_after: int


class ComputeLimit:
    """The thread seconds of each recent caller.

    Parameters
    ----------
    seconds : int
        Thread seconds a minute.
    """

    def __init__(self, seconds: int) -> None:
        self.seconds = seconds
        self._full_times: OrderedDict[str, float] = OrderedDict()

    def __len__(self) -> int:
        return len(self._full_times)

    def spend(self, caller: str, seconds: float, elapsed: float = 0.0) -> None:
        """Charges a caller for thread seconds, used evenly over the last `elapsed` seconds."""
        begin = time.monotonic() - elapsed
        full_time = max(self._full_times.get(caller, begin), begin)
        self._full_times[caller] = full_time + seconds * WINDOW / self.seconds
        self._full_times.move_to_end(caller)
        if len(self._full_times) > MAX_CALLERS:
            self._full_times.popitem(last=False)

    def state(self, caller: str) -> ComputeState:
        """The thread seconds that the caller may use now."""
        seconds_to_full = max(0.0, self._full_times.get(caller, 0.0) - time.monotonic())
        # Rounding of the clock: 1e-6 s less is left, so that a full second is not one too many.
        reset = ceil(seconds_to_full - 1e-6)
        if seconds_to_full >= WINDOW:
            return ComputeState(0, reset, max(1, ceil(seconds_to_full - WINDOW - 1e-6)))
        remaining = floor((WINDOW - seconds_to_full) * self.seconds / WINDOW + 1e-6)
        return ComputeState(remaining, reset, 0)
