"""Sends hostile requests to a service, and prints the files and connections that it opens.

`python -m tests.api.audited FOLDER` prints, as JSON, the events that Python's audit hooks reported:
they see all operations of the interpreter, in any library. The library of the store does not use
the interpreter, so the test checks the folder too. At the end the process does some forbidden
operations, to show that the hooks report them.
"""

import asyncio
import json
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from pydantic import SecretStr
from starlette.types import ASGIApp, Message

from service.api.app import create_app
from service.api.guard.keys import entry_line, new_key
from service.encoders.registry import BY_SUFFIX
from service.settings.values import Settings

WATCHED = ("open", "socket.", "os.", "shutil.", "subprocess.", "urllib.", "ftplib.", "http.client.")
QUIET = {"os.putenv", "os.unsetenv"}

NAMES = [
    "/etc/passwd",
    "../../../../etc/passwd",
    "..%2f..%2f..%2fetc%2fpasswd",
    "%2e%2e/%2e%2e/etc/passwd",
    "....//....//etc/passwd",
    "..\\..\\windows\\win.ini",
    "/proc/self/environ",
    "file:///etc/passwd",
    "http://127.0.0.1:9/",
    "//127.0.0.1:9/x",
    "\\\\127.0.0.1\\share",
    "s3://bucket/key",
    "saddle/../../../etc/passwd",
    "%00",
    "saddle%00.json",
    "0" * 64 + "/../../secret",
    "~root/.ssh/id_rsa",
    "$(touch secret)",
    "C:\\secret",
    "secret",
]

PLACES = [
    "/{}",
    "/v1/surfaces/{}",
    "/v1/surfaces/{}/mesh.glb",
    "/v1/surfaces/saddle/mesh.{}",
    "/v1/surfaces/saddle/mesh.glb?resolution={}",
    "/v1/surfaces/saddle/mesh.glb?signature={}&expires=1",
    "/v1/mesh?format={}",
    "/docs/{}",
    "/page/{}",
    "/?surface={}",
    "/metrics/{}",
]

_BODIES: list[Any] = [
    lambda name: {"surface": name},
    lambda name: {"surface": {"type": name, "control_net": name}},
    lambda name: {
        "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]], "name": name}
    },
    lambda name: {"url": name, "seconds": 9},
]

KEY = new_key()


async def ask(app: ASGIApp, method: str, url: str, body: bytes = b"", **headers: str) -> int:
    """The status of the response to a request, which has a decoded path, as from a server."""
    path, _, query = url.partition("?")
    named = {"authorization": f"Bearer {KEY}", "host": "127.0.0.1", **headers}
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": unquote(path, errors="replace"),
        "raw_path": path.encode(),
        "query_string": query.encode(),
        "root_path": "",
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in named.items()],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
    }
    status: list[int] = []

    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message: Message) -> None:
        if message["type"] == "http.response.start":
            status.append(message["status"])

    await app(scope, receive, send)
    return status[0]


def build_hostile_requests() -> Iterator[tuple[str, str, bytes, dict[str, str]]]:
    """Requests with each hostile name in each place of a request that can have a name."""
    for number, name in enumerate(NAMES):
        for place in PLACES[number % 2 :: 2]:
            yield "GET", place.format(name), b"", {}
        yield "DELETE", f"/v1/surfaces/{name}", b"", {}
        for make in _BODIES[number % 2 :: 2]:
            body = json.dumps(make(name)).encode()
            for path in ("/v1/mesh", "/v1/surfaces", "/v1/sign"):
                yield "POST", path, body, {"content_type": "application/json"}
        for kind in ("application/x-npy", "model/x-oogl", "text/x-teapot", name.encode().hex()):
            yield "POST", "/v1/surfaces", name.encode(), {"content_type": kind}
        reported = {"x_forwarded_for": name, "x_forwarded_host": name, "forwarded": f"for={name}"}
        forged = {"host": name, "referer": name, "origin": name, "if_none_match": name, **reported}
        yield "GET", "/v1/surfaces/saddle/mesh.glb", b"", forged


async def send_ordinary_requests(app: ASGIApp) -> None:
    """Sends ordinary requests first, because some files and modules are read only once."""
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
    body = json.dumps({"surface": {"control_net": net}}).encode()
    await ask(app, "POST", "/v1/surfaces", body, content_type="application/json")
    for path in ("/", "/docs", "/openapi.json", "/page/main.js", "/docs/start.js", "/metrics"):
        await ask(app, "GET", path)
    for suffix in BY_SUFFIX:
        await ask(app, "GET", f"/v1/surfaces/saddle/mesh.{suffix}")


def main(folder: Path) -> None:
    """All calls, and the events that the audit hooks recorded."""
    settings = Settings(
        store=str(folder / "store"),
        allow_delete=True,
        api_keys=(entry_line("alice", KEY),),
        signing_keys=(SecretStr("0123456789abcdef" * 2),),
        trusted_proxies=("127.0.0.1",),
    )
    events: list[tuple[str, list[str]]] = []
    watching = False

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if watching and event.startswith(WATCHED) and event not in QUIET:
            events.append((event, [str(argument) for argument in arguments]))

    async def run() -> list[int]:
        nonlocal watching
        app = create_app(settings)
        await send_ordinary_requests(app)
        watching = True
        statuses = [
            await ask(app, method, url, body, **headers)
            for method, url, body, headers in build_hostile_requests()
        ]
        watching = False
        return statuses

    sys.addaudithook(hook)
    statuses = asyncio.run(run())
    seen, events[:] = events.copy(), []
    watching = True
    (folder / "secret").read_bytes()
    with socket.socket() as connection:
        connection.connect_ex(("127.0.0.1", 9))
    os.listdir(folder)
    watching = False
    print(json.dumps({"statuses": statuses, "seen": seen, "would": [e for e, _ in events]}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
