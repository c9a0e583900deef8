"""The sockets of workers: for each one at the port of the service, and one for its metrics.

The process that starts the workers binds all sockets and keeps them open. So connections that wait
at the socket of a worker that died wait for its replacement.
"""

import logging
import socket
import sys

import uvicorn
from uvicorn.config import STARTUP_FAILURE

from service.settings.values import Settings

if sys.platform != "win32":  # Windows has no such limit of open files
    import resource

BACKLOG = 2048
"""Most connections that wait at a socket until its worker accepts them."""

METRICS_HOST = "127.0.0.1"
"""The address of the ports at `SURFACE_METRICS_PORT`."""

_log = logging.getLogger(__name__)


def bind_sockets(settings: Settings, count: int) -> list[list[socket.socket]]:
    """The sockets of each of `count` workers.

    Each of several workers has a socket of its own at the same port, and the system distributes new
    connections among these sockets by a hash of the client's address and port: with 16 connections
    or more, each worker gets about its share. If the workers shared one socket, the first to wake
    would accept up to 98 % of the connections.

    Raises
    ------
    SystemExit
        The system refuses an address; the log says why.

    References
    ----------
    socket(7), SO_REUSEPORT.
    """
    config = uvicorn.Config(
        "", host=settings.host, port=settings.port, log_config=None, log_level=settings.log_level
    )
    # Without SO_REUSEPORT: fails if another service listens at the port. With it, a second service
    # of the same user could join, and would get half of the connections.
    plain = config.bind_socket()
    services = [plain]
    try:
        if count > 1:
            services = [_join(plain) for _ in range(count)]
            plain.close()
        groups = [[sock] for sock in services]
        if settings.metrics_port:
            for number, group in enumerate(groups):
                group.append(socket.create_server((METRICS_HOST, settings.metrics_port + number)))
    except OSError as error:
        _log.error("cannot listen: %s", error)
        sys.exit(STARTUP_FAILURE)
    for group in groups:
        for sock in group:
            _watch_clients(sock, settings)
    return groups


def _join(plain: socket.socket) -> socket.socket:
    """A socket that listens at the address of `plain`, together with others.

    It listens at once: as long as it did not, the check of a second service would not find it.
    """
    sock = socket.socket(plain.family)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    sock.bind(plain.getsockname())
    sock.listen(BACKLOG)
    return sock


def _watch_clients(sock: socket.socket, settings: Settings) -> None:
    """Makes the system close a connection whose client has vanished or does not read.

    Accepted connections inherit these options (Linux; tcp(7)).
    """
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if sys.platform == "linux":
        milliseconds = max(1, round(settings.send_timeout * 1000))
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 15)  # seconds


def raise_file_limit(needed: int) -> None:
    """Raises the limit of open files; warns if the system does not allow it."""
    if sys.platform != "win32":
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        limit = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        if soft != resource.RLIM_INFINITY and soft < limit:
            resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
        if limit < needed:
            _log.warning("the service needs %d open files, and the system allows %d", needed, limit)
