"""Rate limits: how many requests a minute each caller may make; and the headers of all limits.

The method is the "generic cell rate algorithm": a token bucket, stored as one number for each
caller, the time at which the bucket will be full again. With a limit of n requests a minute, each
request moves this time 60/n seconds further. A request is refused if it would move the time to more
than 60 seconds from now. So a caller may make n requests at once, and then one request every 60/n
seconds.
"""

import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import TypeAlias

from service.api.caching.cached_response import RawHeaders
from service.fair.compute_limit import WINDOW as COMPUTE_WINDOW
from service.fair.compute_limit import ComputeState

WINDOW = 60
"""Seconds over which the limit applies."""

MAX_CALLERS = 20_000
"""The most callers that are counted, in 5 MB; beyond it, the least recent ones are forgotten."""

Item: TypeAlias = tuple[str, str]
"""A limit in the headers: its policy in `RateLimit-Policy`, and its state in `RateLimit`."""


@dataclass(frozen=True, slots=True)
class RateDecision:
    """The result of counting one request.

    Attributes
    ----------
    is_allowed : bool
    remaining : int
        Requests that the caller may make at once.
    reset : int
        Seconds until the caller may make all requests of a minute at once.
    retry_after : int
        Seconds until the next request is allowed; 0 if this request is allowed.
    """

    is_allowed: bool
    remaining: int
    reset: int
    retry_after: int


class Rates:
    """Counts the requests of each recent caller.

    Parameters
    ----------
    limit : int
        Requests a minute.
    """

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._interval = WINDOW / limit
        self._full_times: OrderedDict[str, float] = OrderedDict()

    def __len__(self) -> int:
        return len(self._full_times)

    def count(self, name: str) -> RateDecision:
        """Counts a request of a caller, or refuses it; a refused request does not count."""
        now = time.monotonic()
        full_time = max(self._full_times.get(name, now), now)
        next_full_time = full_time + self._interval
        # Rounding: the sum of n intervals may be slightly more than 60 seconds, so 1/1000 of an
        # interval more is allowed, here and in `remaining`; and 1e-6 s less is left for `reset`.
        excess = next_full_time - now - WINDOW - self._interval * 1e-3
        if excess > 0:
            self._full_times.move_to_end(name)
            return RateDecision(False, 0, ceil(full_time - now - 1e-6), ceil(excess))
        self._full_times[name] = next_full_time
        self._full_times.move_to_end(name)
        if len(self._full_times) > MAX_CALLERS:
            self._full_times.popitem(last=False)
        remaining = int((WINDOW - (next_full_time - now)) / self._interval + 1e-3)
        return RateDecision(True, remaining, ceil(next_full_time - now - 1e-6), 0)

    def item(self, decision: RateDecision) -> Item:
        """The result as an item of the headers."""
        return (
            f'"requests";q={self.limit};w={WINDOW}',
            f'"requests";r={decision.remaining};t={decision.reset}',
        )


def compute_item(seconds: int, state: ComputeState) -> Item:
    """The limit of thread seconds as an item of the headers; `qu` is their unit."""
    return (
        f'"compute";q={seconds};w={COMPUTE_WINDOW};qu="thread-seconds"',
        f'"compute";r={state.remaining};t={state.reset}',
    )


def rate_headers(items: Sequence[Item]) -> RawHeaders:
    """The headers of all limits (draft-ietf-httpapi-ratelimit-headers, version 10)."""
    policies, states = (", ".join(texts).encode() for texts in zip(*items, strict=True))
    return ((b"ratelimit-policy", policies), (b"ratelimit", states))
