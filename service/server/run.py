"""How the service runs: uvicorn, what it is told, and how it ends.

Its event loop is uvloop, which it takes where that is installed.
"""

from typing import Any

import uvicorn
from starlette.types import ASGIApp

from service.server.protocol import BoundedProtocol
from service.settings.values import Settings


def options(settings: Settings) -> dict[str, Any]:
    """What uvicorn is told, wherever it listens."""
    return {
        "http": BoundedProtocol,
        # Its records are written as all others are, and of requests the application tells itself.
        "log_config": None,
        "access_log": False,
        "timeout_graceful_shutdown": round(settings.drain_timeout),
        # Nobody need know what serves; and nothing here asks who a proxy says that the client is.
        "server_header": False,
        "proxy_headers": False,
    }


def serve(app: ASGIApp, settings: Settings) -> None:
    """Answers until the process is told to stop; `service.server.logs` says where the log goes."""
    uvicorn.run(app, host=settings.host, port=settings.port, **options(settings))
