"""Rate limits: how many requests a minute each caller may make.

The method is the "generic cell rate algorithm": a token bucket, stored as one number for each
caller, the time at which the bucket will be full again. With a limit of n requests a minute, each
request moves this time 60/n seconds further. A request is refused if it would move the time to more
than 60 seconds from now. So a caller may make n requests at once, and then one request every 60/n
seconds.
"""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from ipaddress import IPv6Address, ip_address
from math import ceil

from service.api.caching.cached_response import RawHeaders

WINDOW = 60
"""Seconds over which the limit applies."""

MAX_CALLERS = 20_000
"""The most callers that are counted, in 5 MB; beyond it, the least recent ones are forgotten."""

_POLICY = "requests"


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
        Seconds until the next request is allowed; 0 if this request is.
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

    def __init__(self, limit: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.limit = limit
        self._interval = WINDOW / limit
        self._clock = clock
        self._full_at: OrderedDict[str, float] = OrderedDict()
        self._policy = (b"ratelimit-policy", f'"{_POLICY}";q={limit};w={WINDOW}'.encode())

    def __len__(self) -> int:
        return len(self._full_at)

    def count(self, name: str) -> RateDecision:
        """Counts a request of a caller, or refuses it; a refused request does not count."""
        now = self._clock()
        full = max(self._full_at.get(name, now), now)
        after = full + self._interval
        # Rounding: the sum of n intervals may be slightly more than 60 seconds.
        excess = after - now - WINDOW - self._interval * 1e-3
        if excess > 0:
            self._full_at.move_to_end(name)
            return RateDecision(False, 0, ceil(full - now), ceil(excess))
        self._full_at[name] = after
        self._full_at.move_to_end(name)
        if len(self._full_at) > MAX_CALLERS:
            self._full_at.popitem(last=False)
        remaining = int((WINDOW - (after - now)) / self._interval + 1e-3)
        return RateDecision(True, remaining, ceil(after - now), 0)

    def headers(self, decision: RateDecision) -> RawHeaders:
        """The headers of the result (draft-ietf-httpapi-ratelimit-headers, version 10)."""
        now = f'"{_POLICY}";r={decision.remaining};t={decision.reset}'
        return (self._policy, (b"ratelimit", now.encode()))


def caller_name(key: str | None, client: str | None) -> str:
    """The name under which requests are counted together: that of the key, or else the address.

    A client with IPv6 usually has 2⁶⁴ addresses, so these count together, by their /64 network.
    """
    return f"key {key}" if key is not None else _network(client)


@lru_cache(4096)
def _network(client: str | None) -> str:
    """The name under which requests from an address are counted: an IPv4 address, or a network."""
    try:
        address = ip_address(client or "")
    except ValueError:
        return "unknown"
    if not isinstance(address, IPv6Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(IPv6Address(int(address) >> 64 << 64))
