"""Sends hostile requests to a service, and prints which files and connections the service opens.

`python -m tests.api.audited FOLDER` prints, as JSON, the events that Python reports to an audit
hook: files, connections and processes that any Python code opens. The store opens its files in
compiled code (obstore), which the hook does not see, so `test_no_way_out.py`, which runs this
program, also lists the files in FOLDER. At the end this program does some operations that the
service must not do, to show that the hook reports them.
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
from service.api.guard.keys import format_entry, make_key
from service.api.page_files import list_files
from service.encoders.registry import BY_SUFFIX
from service.settings.values import Settings

WATCHED = ("open", "socket.", "os.", "shutil.", "subprocess.", "urllib.", "ftplib.", "http.client.")
"""Beginnings of the names of events that are recorded."""

IGNORED = {"os.putenv", "os.unsetenv"}
"""Events that are not recorded: changes of environment variables open nothing."""

HOSTILE_NAMES = [
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
"""Texts that name a file or an address."""

URLS = [
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
    "/embed?src={}",
    "/metrics/{}",
]
"""URLs in which `{}` stands for a hostile name."""

_DOCUMENT_BUILDERS: list[Any] = [
    lambda name: {"surface": name},
    lambda name: {"surface": {"type": name, "control_net": name}},
    lambda name: {
        "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]], "name": name}
    },
    lambda name: {"url": name, "seconds": 9},
]
"""Functions that build the document of a request with a hostile name."""

KEY = make_key()


async def send_request(
    app: ASGIApp, method: str, url: str, body: bytes = b"", **headers: str
) -> int:
    """The status of the response to a request; decodes the path, as a server does.

    The names of `headers` have underscores in place of hyphens.
    """
    path, _, query = url.partition("?")
    headers = {"authorization": f"Bearer {KEY}", "host": "127.0.0.1", **headers}
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
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
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
    """Requests with each hostile name: method, URL, body and headers.

    To save time, each name is only in half of `URLS` and of the documents: its neighbours in
    `HOSTILE_NAMES` are in the other half.
    """
    for number, name in enumerate(HOSTILE_NAMES):
        for url in URLS[number % 2 :: 2]:
            yield "GET", url.format(name), b"", {}
        yield "DELETE", f"/v1/surfaces/{name}", b"", {}
        for build_document in _DOCUMENT_BUILDERS[number % 2 :: 2]:
            body = json.dumps(build_document(name)).encode()
            for path in ("/v1/mesh", "/v1/surfaces", "/v1/sign"):
                yield "POST", path, body, {"content_type": "application/json"}
        for media_type in ("application/x-npy", "model/x-oogl", "text/x-teapot", name):
            yield "POST", "/v1/surfaces", name.encode(), {"content_type": media_type}
        headers_of_proxies = {
            "x_forwarded_for": name,
            "x_forwarded_host": name,
            "forwarded": f"for={name}",
        }
        headers = {"host": name, "referer": name, "origin": name, "if_none_match": name}
        yield "GET", "/v1/surfaces/saddle/mesh.glb", b"", headers | headers_of_proxies


async def send_ordinary_requests(app: ASGIApp) -> None:
    """Sends valid requests. The service reads some files and modules only for the first of them."""
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
    body = json.dumps({"surface": {"control_net": net}}).encode()
    await send_request(app, "POST", "/v1/surfaces", body, content_type="application/json")
    for path in ("/", "/docs", "/openapi.json", "/docs/start.js", "/metrics"):
        await send_request(app, "GET", path)
    for name in list_files(dict, Settings()):
        await send_request(app, "GET", f"/{name}")
    for suffix in BY_SUFFIX:
        await send_request(app, "GET", f"/v1/surfaces/saddle/mesh.{suffix}")


def main(folder: Path) -> None:
    """Prints the statuses of all hostile requests, and the events that the audit hook recorded."""
    settings = Settings(
        store=str(folder / "store"),
        allow_delete=True,
        api_keys=(format_entry("alice", KEY),),
        signing_keys=(SecretStr("0123456789abcdef" * 2),),
        trusted_proxies=("127.0.0.1",),
    )
    events: list[tuple[str, list[str]]] = []
    is_recording = False

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if is_recording and event.startswith(WATCHED) and event not in IGNORED:
            events.append((event, [str(argument) for argument in arguments]))

    async def run() -> list[int]:
        nonlocal is_recording
        app = create_app(settings)
        await send_ordinary_requests(app)
        is_recording = True
        statuses = [
            await send_request(app, method, url, body, **headers)
            for method, url, body, headers in build_hostile_requests()
        ]
        is_recording = False
        return statuses

    sys.addaudithook(hook)
    statuses = asyncio.run(run())
    events_of_requests, events[:] = events.copy(), []
    is_recording = True
    (folder / "secret").read_bytes()
    with socket.socket() as connection:
        connection.connect_ex(("127.0.0.1", 9))
    os.listdir(folder)
    is_recording = False
    events_of_program = events
    document = {
        "statuses": statuses,
        "events": events_of_requests,
        "forbidden": [event for event, _ in events_of_program],
    }
    print(json.dumps(document))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
