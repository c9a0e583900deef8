"""`surface serve`: answers over HTTP."""

import argparse
from contextlib import ExitStack

from service.cli.refusals import OK, Refused
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """The command and its flags."""
    serve = commands.add_parser("serve", help="answer over HTTP")
    serve.add_argument("--host", help="address to listen at (SURFACE_HOST, 127.0.0.1)")
    serve.add_argument("--port", help="port to listen at (SURFACE_PORT, 8000)")
    serve.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.api.app import create_app
    from service.server.listening import CannotListen
    from service.server.logs import held, logs
    from service.server.run import serve
    from service.settings.environment import from_environment, with_flags

    given = {"host": arguments.host, "port": arguments.port}
    flags = {name: text for name, text in given.items() if text is not None}
    with ExitStack() as stack:
        with held():
            settings = with_flags(from_environment(), flags)
            log = stack.enter_context(logs(settings))
        app = create_app(settings, log.requests.write)
        app.state.observed.dropped = log.dropped
        try:
            serve(app, settings, app.state)
        except CannotListen as error:
            place = f"{settings.host}, port {settings.port}"
            raise Refused(f"cannot serve at {place}: {error}") from None
        except SystemExit as stop:
            if stop.code:
                # It has logged why; its exit code would mean something else here.
                raise Refused("cannot serve; the reason stands above") from None
    return OK
