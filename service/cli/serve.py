"""`surface serve`: serves requests over HTTP."""

from __future__ import annotations

import argparse
import ipaddress
import logging
from contextlib import suppress
from logging.handlers import MemoryHandler
from typing import TYPE_CHECKING

from service.cli.refusals import Refused
from service.cli.source import Commands

if TYPE_CHECKING:
    from service.settings.values import Settings


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    serve = commands.add_parser("serve", help="serve requests over HTTP")
    serve.add_argument("--host", help="address to listen at (SURFACE_HOST, 127.0.0.1)")
    serve.add_argument("--port", help="port to listen at (SURFACE_PORT, 8000)")
    serve.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.api.app import create_app
    from service.server.logs import start_logs
    from service.server.run import serve
    from service.settings.environment import apply_flags, read_environment

    texts = {"host": arguments.host, "port": arguments.port}
    flags = {name: text for name, text in texts.items() if text is not None}
    # Keep log records in memory, whatever their level, until the settings say how to write them, or
    # until there are 1,000.
    memory_handler = MemoryHandler(
        capacity=1000, flushLevel=logging.CRITICAL + 1, target=logging.lastResort
    )
    logging.getLogger().addHandler(memory_handler)
    try:
        settings = apply_flags(read_environment(), flags)
        access_log, error_log = start_logs(settings)
        memory_handler.setTarget(error_log)
    finally:
        logging.getLogger().removeHandler(memory_handler)
        memory_handler.close()
    error_log.flush()
    app = create_app(settings, access_log.write)
    app.state.counters.count_dropped_lines = lambda: access_log.dropped + error_log.dropped
    _warn_if_open(settings)
    try:
        serve(app, settings, app.state)  # ends the process, so that this function does not return
    except SystemExit:
        error_log.flush()
        # uvicorn has logged the reason. Its exit code has another meaning in this program.
        address = f"{settings.host}, port {settings.port}"
        raise Refused(f"cannot serve at {address}; the lines above say why") from None


def _warn_if_open(settings: Settings) -> None:
    """Warns if other machines can connect and the service needs no key."""
    is_private = settings.host == "localhost"
    with suppress(ValueError):
        is_private = ipaddress.ip_address(settings.host).is_loopback
    if not (is_private or settings.api_keys or settings.api_keys_file):
        logging.getLogger(__name__).warning(
            "Every client that reaches this service may compute and store: it has no API keys "
            "(SURFACE_API_KEYS)"
        )
