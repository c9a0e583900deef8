"""Rates: how many requests a minute somebody may make.

A token bucket, kept as the one moment at which it will be full again ("generic cell rate"): each
request moves that moment on by its share of a minute, and who would move it further than a minute
from now has to wait. So a minute's requests may come at once, and after that one each share.
"""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from ipaddress import IPv6Address, ip_address
from math import ceil

from service.api.caching.entries import RawHeaders

WINDOW = 60
"""Seconds for which a rate is told."""

MOST = 20_000
"""Callers that are remembered, the latest ones. A flood of addresses takes 5 MB and no more."""

_POLICY = "requests"


@dataclass(frozen=True, slots=True)
class Taken:
    """One request, counted.

    Attributes
    ----------
    allowed : bool
    remaining : int
        Requests that could follow at once.
    reset : int
        Seconds until the whole quota is there again.
    wait : int
        Seconds until the next one is allowed; 0 if it is.
    """

    allowed: bool
    remaining: int
    reset: int
    wait: int


class Rates:
    """The requests of everybody who asked lately.

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
        """Counts one request. What is refused costs nothing: to wait helps."""
        now = self._clock()
        full = max(self._full.get(who, now), now)
        after = full + self._share
        # A thousandth of a share is for rounding: sixty sixtieths are a minute.
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
        """The headers that tell of it (draft-ietf-httpapi-ratelimit-headers, version 10)."""
        now = f'"{_POLICY}";r={taken.remaining};t={taken.reset}'
        return (self._policy, (b"ratelimit", now.encode()))


def caller(key: str | None, client: str | None) -> str:
    """Whose requests are counted together: those of one key, else of one address.

    Somebody with one IPv6 address has 2⁶⁴ of them, so there the network is meant.
    """
    return f"key {key}" if key is not None else _network(client)


@lru_cache(4096)
def _network(client: str | None) -> str:
    """What an address is counted as."""
    try:
        address = ip_address(client or "")
    except ValueError:
        return "somebody"
    if not isinstance(address, IPv6Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(IPv6Address(int(address) >> 64 << 64))
