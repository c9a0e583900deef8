"""Who asks, where proxies stand in front: the address that the last trusted one saw.

Everybody may write `X-Forwarded-For`. Every proxy adds whom it got the request from at the right,
so what stands there is read from the right, as long as the one who wrote it is trusted: the first
address that is none of a trusted proxy is the client's. What stands left of it is hearsay.
"""

from collections.abc import Sequence
from functools import lru_cache
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from typing import TypeAlias

from starlette.types import Scope

Address: TypeAlias = IPv4Address | IPv6Address

UNIX = "unix"
"""Stands for whoever connects to a Unix socket, and has no address."""

MOST_HOPS = 32
"""Proxies behind each other that are followed."""

LONGEST = 64
"""Bytes of an address: one of IPv6 with its zone and its port has less."""

REMEMBERED = 4096
"""Addresses that are not read anew: most requests come from somebody who was here before."""

_SCHEMES = {b"http": "http", b"https": "https"}


class InvalidProxies(ValueError):
    """What should be addresses of proxies is something else."""


class Proxies:
    """The proxies that are trusted; raises `InvalidProxies` for what names none."""

    def __init__(self, listed: Sequence[str]) -> None:
        self._unix = UNIX in listed
        try:
            self._networks = tuple(ip_network(text) for text in listed if text != UNIX)
        except ValueError:
            raise InvalidProxies(
                "needed addresses, or networks without bits of hosts, such as 10.0.0.0/8, "
                f"fd00::/8 or {UNIX}."
            ) from None

    def introduce(self, scope: Scope) -> None:
        """Puts the client, and the scheme that it uses, into the scope where a proxy tells them."""
        client = scope.get("client")
        peer = address_in(client[0].encode()) if client else None
        if not self._trusts(peer):
            return
        said = [value for name, value in scope["headers"] if name == b"x-forwarded-for"]
        # From the right; the oldest of too many hops are left together, as one that is no address.
        hops = b",".join(said).rsplit(b",", MOST_HOPS)
        for hop in reversed(hops):
            address = address_in(hop)
            if address is None:
                break  # nobody whom we could name: the one who says so is the nearest we know
            peer = address
            if not self._trusts(peer):
                break
        if peer is not None:
            scope["client"] = (str(peer), 0)
        schemes = [value for name, value in scope["headers"] if name == b"x-forwarded-proto"]
        if schemes:
            nearest = schemes[-1].rpartition(b",")[2].strip().lower()
            scope["scheme"] = _SCHEMES.get(nearest, scope["scheme"])

    def _trusts(self, peer: Address | None) -> bool:
        return self._unix if peer is None else _within(peer, self._networks)


def address_in(text: bytes) -> Address | None:
    """The address in one part of the header, which may have a port; None if it is none.

    An IPv4 address that is written as one of IPv6 is the IPv4 address that it is. The zone of an
    address, any text, means something on the machine that wrote it alone, and is left out.
    """
    word = text.strip()
    return _address(word) if len(word) <= LONGEST else None


@lru_cache(REMEMBERED)
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


@lru_cache(REMEMBERED)
def _within(address: Address, networks: tuple[IPv4Network | IPv6Network, ...]) -> bool:
    return any(address in network for network in networks)
