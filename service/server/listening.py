"""Where the service listens: its sockets, and why it may not have them."""

import errno
import ipaddress
import os
import socket
from collections.abc import Sequence

BACKLOG = 2048
"""Connections that may wait to be accepted; the system may allow fewer."""

_REASONS = {
    errno.EADDRINUSE: "the port is taken by another process",
    errno.EACCES: "the system does not allow it",
    errno.EADDRNOTAVAIL: "this machine has no such address",
}


class CannotListen(Exception):
    """The address is not to be had; says why."""


def listen(host: str, port: int) -> list[socket.socket]:
    """Sockets that listen: one for each address that a name has.

    From here on nobody else can have the port, and whoever connects waits until the service has
    started. `::` stands for all addresses of both kinds, other addresses for themselves.

    Raises
    ------
    CannotListen
    """
    sockets: list[socket.socket] = []
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, _, _, _, address in dict.fromkeys(found):
            # With port 0 the first address takes one that is free; the others follow it.
            chosen = sockets[0].getsockname()[1] if sockets else port
            sockets.append(_listening(family, (address[0], chosen, *address[2:])))
    except OSError as error:
        for each in sockets:
            each.close()
        raise CannotListen(_reason(error)) from None
    return sockets


def _listening(family: int, address: tuple[object, ...]) -> socket.socket:
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        if os.name == "posix":
            # Connections of a process that has just ended keep nobody from its port.
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, address[0] != "::")
        sock.bind(address)
        sock.listen(BACKLOG)
    except OSError:
        sock.close()
        raise
    return sock


def _reason(error: OSError) -> str:
    if isinstance(error, socket.gaierror):
        return "there is no such address"
    return _REASONS.get(error.errno or 0) or error.strerror or "the system does not say why"


def notice_the_vanished(sockets: Sequence[socket.socket], seconds: float) -> None:
    """Makes the system close connections whose other end does not answer it for so long.

    Neither who loses its network nor who stops reading says so. Connections inherit from the socket
    that accepts them (Linux; elsewhere the settings' own times are all there is). See tcp(7).
    """
    options = {
        "TCP_KEEPIDLE": 15,
        "TCP_KEEPINTVL": 5,
        "TCP_KEEPCNT": 3,
        "TCP_USER_TIMEOUT": max(1, round(seconds * 1000)),
    }
    for sock in sockets:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in options.items():
            if hasattr(socket, name):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def urls(sockets: Sequence[socket.socket]) -> list[str]:
    """The addresses as a browser takes them."""
    places = [sock.getsockname()[:2] for sock in sockets]
    return [f"http://{f'[{host}]' if ':' in host else host}:{port}" for host, port in places]


def is_private(sockets: Sequence[socket.socket]) -> bool:
    """Whether only this machine can connect."""
    return all(ipaddress.ip_address(sock.getsockname()[0]).is_loopback for sock in sockets)
