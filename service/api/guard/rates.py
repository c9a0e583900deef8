"""Rate limits: how many requests a minute each caller may make.

The method is the "generic cell rate algorithm": a token bucket, stored as one number for each
caller, the time at which the bucket will be full again. With a limit of n requests a minute, each
request moves this time 60/n seconds further. A request is refused if it would move the time to more
than 60 seconds from now. So a caller may make n requests at once, and then one request every 60/n
seconds.
"""

import time
from collections import OrderedDict
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
"""The name of the only rate limit, in the headers."""


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
        self._policy = (b"ratelimit-policy", f'"{_POLICY}";q={limit};w={WINDOW}'.encode())

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

    def headers(self, decision: RateDecision) -> RawHeaders:
        """The headers of the result (draft-ietf-httpapi-ratelimit-headers, version 10)."""
        state = f'"{_POLICY}";r={decision.remaining};t={decision.reset}'
        return (self._policy, (b"ratelimit", state.encode()))


def caller_name(key: str | None, client: str | None) -> str:
    """The name under which a caller's requests are counted: `key` and its name, or the address.

    A client with IPv6 usually has 2⁶⁴ addresses, so all addresses of a /64 network share a name.
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
