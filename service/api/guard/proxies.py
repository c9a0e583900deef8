"""Finds the client's address behind trusted proxies, from `X-Forwarded-For`.

Every client may send `X-Forwarded-For`. Each proxy appends the address of its own client on the
right. So the service reads the header from the right, and skips addresses of trusted proxies: the
first other address is the client's. The service ignores all addresses to the left of this address.
"""

from collections.abc import Sequence
from functools import lru_cache
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from typing import TypeAlias

from starlette.types import Scope

from service.errors import InvalidSettings

Address: TypeAlias = IPv4Address | IPv6Address

UNIX = "unix"
"""The item of the setting for clients of a Unix socket, which have no IP address."""

MAX_HOPS = 32
"""Most proxies in a chain that the service follows."""

MAX_ADDRESS_BYTES = 64
"""Longest text of an address, in bytes: IPv6 with a zone and a port is shorter."""

CACHED_ADDRESSES = 4096
"""Number of addresses whose parsed form is cached: most requests come from a recent client."""

_SCHEMES = {b"http": "http", b"https": "https"}


class Proxies:
    """The trusted proxies; raises `InvalidSettings` for an invalid address or network."""

    def __init__(self, trusted: Sequence[str]) -> None:
        self._trusts_unix = UNIX in trusted
        try:
            self._networks = tuple(ip_network(text) for text in trusted if text != UNIX)
        except ValueError:
            raise InvalidSettings(
                "SURFACE_TRUSTED_PROXIES: needed addresses, or networks without host bits, such as "
                f"10.0.0.0/8, fd00::/8 or {UNIX}."
            ) from None

    def set_client(self, scope: Scope) -> None:
        """Sets the scope's client and scheme as the trusted proxies report them."""
        client = scope.get("client")
        peer = parse_address(client[0].encode()) if client else None
        if not self._is_trusted(peer):
            return
        forwarded = [value for name, value in scope["headers"] if name == b"x-forwarded-for"]
        # Split from the right. Hops beyond MAX_HOPS stay in one item, which is then no address.
        hops = b",".join(forwarded).rsplit(b",", MAX_HOPS)
        for hop in reversed(hops):
            address = parse_address(hop)
            if address is None:
                break  # no address: `peer`, the proxy that sent this item, counts as the client
            peer = address
            if not self._is_trusted(peer):
                break
        if peer is not None:
            scope["client"] = (str(peer), 0)
        schemes = [value for name, value in scope["headers"] if name == b"x-forwarded-proto"]
        if schemes:
            nearest = schemes[-1].rpartition(b",")[2].strip().lower()
            scope["scheme"] = _SCHEMES.get(nearest, scope["scheme"])

    def _is_trusted(self, peer: Address | None) -> bool:
        """Whether a peer is a trusted proxy; None is a client of a Unix socket."""
        return self._trusts_unix if peer is None else _is_within(peer, self._networks)


def parse_address(text: bytes) -> Address | None:
    """The IP address in one item of the header, without its port; None if it has no address.

    An IPv4 address in IPv6 form becomes IPv4. The zone of an IPv6 address is left out: it has a
    meaning only on the machine that wrote it.
    """
    word = text.strip()
    return _address(word) if len(word) <= MAX_ADDRESS_BYTES else None


@lru_cache(CACHED_ADDRESSES)
def _address(word: bytes) -> Address | None:
    if word.startswith(b"["):
        word = word[1:].partition(b"]")[0]
    elif word.count(b":") == 1:
        word = word.partition(b":")[0]
    try:
        address = ip_address(word.decode("ascii"))
    except ValueError:
        return None
    if isinstance(address, IPv6Address):
        return address.ipv4_mapped or IPv6Address(int(address))
    return address


@lru_cache(CACHED_ADDRESSES)
def _is_within(address: Address, networks: tuple[IPv4Network | IPv6Network, ...]) -> bool:
    return any(address in network for network in networks)
