"""How the service runs: uvicorn, what it is told, and how it ends.

Its event loop is uvloop, which it takes where that is installed.
"""

import asyncio
import logging
import socket
from collections.abc import Sequence
from functools import partial
from typing import Any

import uvicorn
from starlette.types import ASGIApp

from service.server.connections import Connections
from service.server.descriptors import raise_limit
from service.server.draining import Server, end_process, end_threads
from service.server.listening import is_private, listen, notice_the_vanished
from service.server.protocol import BoundedProtocol
from service.settings.process import collect_rarely
from service.settings.values import Settings

_log = logging.getLogger(__name__)


def make_server(app: ASGIApp, settings: Settings, state: Any = None, **other: Any) -> Server:
    """Uvicorn, told what it is told wherever it listens; `state` is the application's."""
    connections = Connections(settings)
    if state is not None:
        state.connections = connections
        if hasattr(state, "observed"):
            connections.refused = state.observed.refused
    told: dict[str, Any] = {
        "http": partial(BoundedProtocol, connections),
        "ws": "none",
        # Its records are written as all others are, and of requests the application tells itself.
        "log_config": None,
        "access_log": False,
        # Nobody need know what serves; and nothing here asks who a proxy says that the client is.
        "server_header": False,
        "proxy_headers": False,
        **other,
    }
    return Server(uvicorn.Config(app, **told), connections, settings, state)


def serve(app: ASGIApp, settings: Settings, state: Any = None) -> None:
    """Answers until the process is told to stop; may end it, if threads go on computing.

    `service.server.logs` says where the log goes.

    Raises
    ------
    CannotListen
    """
    sockets = listen(settings.host, settings.port)
    notice_the_vanished(sockets, settings.send_timeout)
    server = make_server(app, settings, state)
    raise_limit(settings.max_connections)
    warn_if_open(sockets, settings)
    collect_rarely()
    with asyncio.Runner(loop_factory=server.config.get_loop_factory()) as runner:
        runner.run(_until_told(server, sockets))
    end_threads()


def warn_if_open(sockets: Sequence[socket.socket], settings: Settings) -> None:
    """Says in the log that everybody who can connect may do everything, if that is so."""
    if not is_private(sockets) and not settings.api_keys and not settings.api_keys_file:
        _log.warning(
            "Whoever reaches this service may compute and store: it has no API keys "
            "(SURFACE_API_KEYS)"
        )


async def _until_told(server: Server, sockets: list[socket.socket]) -> None:
    await server.serve(sockets)
    if server.unfinished:
        end_process()
