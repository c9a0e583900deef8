"""Runs the service under uvicorn, or a small HTTP server, in a thread and on a free port."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from starlette.types import ASGIApp

from service.api.app import create_app
from service.server.run import make_server
from service.settings.values import Settings


@contextmanager
def run_service(
    settings: Settings | None = None, wrap: Callable[[ASGIApp], ASGIApp] = lambda app: app
) -> Iterator[str]:
    """The URL of a service that runs in a thread of this process until the block ends.

    By default the service keeps its surfaces in memory. `wrap` returns the application that gets
    the requests: for example one that counts requests, and then calls the service.
    """
    settings = settings or Settings()
    app = wrap(create_app(settings))
    server = make_server(app, settings, host="127.0.0.1", port=0)
    thread = threading.Thread(target=server.run, name="service")
    thread.start()
    try:
        while not server.started:
            if not thread.is_alive():
                raise RuntimeError("the service did not start; see the error printed above")
            time.sleep(0.01)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def serve(handler: Callable[..., BaseHTTPRequestHandler]) -> Iterator[str]:
    """The URL of an HTTP server with this handler, which runs until the block ends."""
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as httpd:
        thread = threading.Thread(target=httpd.serve_forever, args=(0.02,), name="server")
        thread.start()
        try:
            yield f"http://127.0.0.1:{httpd.server_port}"
        finally:
            httpd.shutdown()
            thread.join()
