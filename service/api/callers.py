"""Callers: the names under which requests are counted, and computing time is charged."""

from functools import lru_cache
from ipaddress import IPv6Address, ip_address

from starlette.types import Scope

from service.api.record import record_of


def caller_of(scope: Scope) -> str:
    """The caller of a request: the name of its key, or without a valid key the client's address.

    The guard has set both, if there is a guard: the address is that of a trusted proxy's client.
    """
    client = scope.get("client")
    # The record has an empty text for a request without a key.
    return caller_name(record_of(scope).key or None, client[0] if client else None)


def caller_name(key: str | None, client: str | None) -> str:
    """The name of a caller: `key` and its name, or the address.

    A client with IPv6 usually has 2⁶⁴ addresses, so all addresses of a /64 network share a name.
    """
    return f"key {key}" if key is not None else _network(client)


@lru_cache(4096)
def _network(client: str | None) -> str:
    """The name of the caller at an address: an IPv4 address, or a network."""
    try:
        address = ip_address(client or "")
    except ValueError:
        return "unknown"
    if not isinstance(address, IPv6Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(IPv6Address(int(address) >> 64 << 64))
