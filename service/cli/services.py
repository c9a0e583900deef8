"""Commands of a service: `serve`, `health`, `store`, `sign` and `key`.

`surface health`, for container checks, imports no slow modules, and so takes 1/20 of the time in
which the service starts.
"""

from __future__ import annotations

import argparse
import ipaddress
import logging
from contextlib import suppress
from logging.handlers import MemoryHandler
from typing import TYPE_CHECKING

from service.cli.files import FILE_FLAGS, SourceFile, read_field_flags
from service.cli.flags import Command, flag, read_values
from service.cli.output import print_lines
from service.cli.refusals import OK, Refused, UsageError
from service.cli.source import build_document, field_line, source_flag, surface_source
from service.errors import SurfaceError

if TYPE_CHECKING:
    from service.settings.values import Settings


def _serve(arguments: argparse.Namespace) -> int:
    from service.server.logs import start_logs
    from service.settings.environment import apply_flags, read_environment, summarize
    from service.settings.workers import count_workers

    texts = {"host": arguments.host, "port": arguments.port, "workers": arguments.workers}
    flags = {name: text for name, text in texts.items() if text is not None}
    # Keep log records in memory, whatever their level, until the settings say how to write them, or
    # until there are 1,000.
    memory_handler = MemoryHandler(
        capacity=1000, flushLevel=logging.CRITICAL + 1, target=logging.lastResort
    )
    logging.getLogger().addHandler(memory_handler)
    try:
        settings = apply_flags(read_environment(), flags)
        logs = start_logs(settings)
        memory_handler.setTarget(logs.errors)
    finally:
        logging.getLogger().removeHandler(memory_handler)
        memory_handler.close()
    logging.getLogger(__name__).info("Settings: %s", summarize(settings))
    logs.errors.flush()
    count = count_workers(settings)
    _warn_if_open(settings)
    has_stopped = False
    # The process of the server ends itself. uvicorn's `SystemExit` comes after a line in the log;
    # its exit code has another meaning in this program.
    with suppress(SystemExit):
        if count > 1:
            from service.server.supervisor import serve_with_workers

            has_stopped = serve_with_workers(settings, count)
        else:
            from service.api.app import create_app
            from service.server.run import serve

            app = create_app(settings, logs.access.write)
            app.state.counters.count_dropped_lines = logs.count_dropped
            serve(app, settings, app.state)
    logs.errors.flush()
    if not has_stopped:
        address = f"{settings.host}, port {settings.port}"
        raise Refused(f"cannot serve at {address}; the lines above say why")
    return OK


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


def _ask_health(arguments: argparse.Namespace) -> int:
    from http.client import HTTPConnection, HTTPException

    from service.settings.listening import find_address

    host, port = find_address(arguments.host, arguments.port)
    state = "live" if arguments.live else "ready"
    connection = HTTPConnection(host, port, timeout=2)
    try:
        connection.request("GET", f"/health/{state}")
        status = connection.getresponse().status
    except (OSError, HTTPException) as error:
        raise Refused(f"no response at {host}, port {port}: {type(error).__name__}") from None
    finally:
        connection.close()
    if status != 200:
        raise Refused(f"not {state}: the response at {host}, port {port} is {status}")
    print_lines([state])
    return OK


def _store(arguments: argparse.Namespace) -> int:
    from service.cli import remote
    from service.cli.documents import post_file

    source, path = surface_source(arguments), "/v1/surfaces"
    try:
        if isinstance(source, SourceFile):
            content = post_file(arguments.url, path, source, {})
        else:
            content = remote.post(arguments.url, path, build_document(source))
        urls = remote.store_urls(arguments.url, content)
    except SurfaceError as error:
        fields = read_field_flags(arguments)
        raise Refused(*(field_line(issue, fields) for issue in error.issues)) from None
    print_lines(f"{name:<5} {url}" for name, url in urls.items())
    return OK


def _sign(arguments: argparse.Namespace) -> int:
    import time

    from service.api.guard.guard import build_signer
    from service.api.guard.signatures import build_signed_url
    from service.schemas.request import SignRequest
    from service.schemas.validation import validate_document
    from service.settings.environment import read_environment

    signer = build_signer(read_environment())
    if signer is None:
        raise UsageError("SURFACE_SIGNING_KEYS: got nothing, needed a secret to sign with")
    ((name, text),) = read_values(arguments, SIGN.one_of).items()
    # Valid numbers have fewer than 20 digits; of thousands, `int` raises ValueError.
    if not (text.isascii() and text.isdigit() and len(text) < 20):
        raise UsageError(f"--{name}: needed a whole number")
    request = validate_document(SignRequest, {"url": arguments.path, name: int(text)})
    url, _ = build_signed_url(signer, request, root="", now=time.time())
    print_lines([url])
    return OK


def _make_key(arguments: argparse.Namespace) -> int:
    from service.api.guard import keys

    if not keys.is_key_name(arguments.name):
        raise UsageError(f"NAME: needed {keys.NAME_FORM}")
    is_default = arguments.scope is None
    scopes = keys.DEFAULT_SCOPES if is_default else keys.parse_scopes(arguments.scope)
    if scopes is None:
        raise UsageError(f"--scope: needed {keys.SCOPES_FORM}")
    key = keys.make_key()
    print_lines([f"key   {key}", f"line  {keys.format_entry(arguments.name, key, scopes)}"])
    return OK


SERVE = Command(
    "serve",
    "serve requests over HTTP",
    _serve,
    (
        flag("--host", "address to listen at (SURFACE_HOST, 127.0.0.1)"),
        flag("--port", "port to listen at (SURFACE_PORT, 8000)"),
        flag("--workers", "processes that serve; 0: one for each processor (SURFACE_WORKERS, 1)"),
    ),
)

HEALTH = Command(
    "health",
    "ask the service on this machine whether it is ready",
    _ask_health,
    (
        flag("--live", "ask only whether the process runs", action="store_true"),
        flag("--host", "address of the service (SURFACE_HOST, 127.0.0.1)"),
        flag("--port", "port of the service (SURFACE_PORT, 8000)"),
    ),
    description="Exit code 0 if the service is ready for requests, 1 if it is not or does not "
    "answer.",
)

STORE = Command(
    "store",
    "store a surface at a service and print its URLs",
    _store,
    (
        source_flag("no options"),
        flag("--url", "URL of the service that stores it", required=True),
    ),
    groups=(FILE_FLAGS,),
    has_exit_codes=True,
)

SIGN = Command(
    "sign",
    "sign a URL of a private surface",
    _sign,
    (flag("path", "surface or mesh, without the host: /v1/surfaces/ID/mesh.glb?engine=4", "URL"),),
    one_of=(
        flag("--seconds", "seconds from now until it expires", "N"),
        flag("--expires", "when it expires, in Unix time", "UNIXTIME"),
    ),
    description="Signs with the first secret of SURFACE_SIGNING_KEYS and prints the URL, "
    "which is valid at every service with that secret. It sends no request to a service.",
    has_exit_codes=True,
)

KEY = Command(
    "key",
    "make an API key",
    _make_key,
    (
        flag("name", "name of the client, for logs", "NAME"),
        flag("--scope", "what it permits (read+compute+store+delete); admin too", "SCOPES"),
    ),
    description="Prints a new key, for the client, and the line for SURFACE_API_KEYS or for "
    "the file SURFACE_API_KEYS_FILE, with the hash of the key. The key itself is not stored: "
    "it cannot be printed again.",
)
