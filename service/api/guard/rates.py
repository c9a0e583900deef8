"""Rate limits: how many requests a minute each caller may make.

A token bucket, kept as one number, the time at which it will be full again ("generic cell rate
algorithm"): each request moves that time on by its share of a minute, and a caller who would move
it further than a minute from now must wait. So the requests of a minute may come at once, and after
that one in each share.
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

MOST = 20_000
"""Callers remembered, the latest ones. A flood of addresses takes at most 5 MB."""

_POLICY = "requests"


@dataclass(frozen=True, slots=True)
class Taken:
    """The result of counting one request.

    Attributes
    ----------
    allowed : bool
    remaining : int
        Requests that the caller may make at once.
    reset : int
        Seconds until the caller may make all requests of a minute at once.
    wait : int
        Seconds until the next request is allowed; 0 if this one is.
    """

    allowed: bool
    remaining: int
    reset: int
    wait: int


class Rates:
    """Counts the requests of each recent caller.

    Parameters
    ----------
    limit : int
        Requests a minute.
    """

    def __init__(self, limit: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.limit = limit
        self._share = WINDOW / limit
        self._clock = clock
        self._full: OrderedDict[str, float] = OrderedDict()
        self._policy = (b"ratelimit-policy", f'"{_POLICY}";q={limit};w={WINDOW}'.encode())

    def __len__(self) -> int:
        return len(self._full)

    def take(self, who: str) -> Taken:
        """Counts one request. A refused request does not count."""
        now = self._clock()
        full = max(self._full.get(who, now), now)
        after = full + self._share
        # 1/1000 of a share for rounding: 60 sixtieths are a minute.
        over = after - now - WINDOW - self._share * 1e-3
        if over > 0:
            self._full.move_to_end(who)
            return Taken(False, 0, ceil(full - now), ceil(over))
        self._full[who] = after
        self._full.move_to_end(who)
        if len(self._full) > MOST:
            self._full.popitem(last=False)
        remaining = int((WINDOW - (after - now)) / self._share + 1e-3)
        return Taken(True, remaining, ceil(after - now), 0)

    def headers(self, taken: Taken) -> RawHeaders:
        """The headers of the result (draft-ietf-httpapi-ratelimit-headers, version 10)."""
        now = f'"{_POLICY}";r={taken.remaining};t={taken.reset}'
        return (self._policy, (b"ratelimit", now.encode()))


def caller(key: str | None, client: str | None) -> str:
    """The name under which requests are counted together: a key, else an address.

    A client with one IPv6 address usually has 2⁶⁴ of them, so these count by their /64 network.
    """
    return f"key {key}" if key is not None else _network(client)


@lru_cache(4096)
def _network(client: str | None) -> str:
    """The address or network that a client's requests count for."""
    try:
        address = ip_address(client or "")
    except ValueError:
        return "unknown"
    if not isinstance(address, IPv6Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(IPv6Address(int(address) >> 64 << 64))
