"""A profile of one request: how often functions of the service are called for a small mesh.

`python -m tools.request_profile [--format glb]` posts a net of 4 × 4 control points at resolution
16, a mesh of 17 × 17 vertices, to the application in this process. It prints how often each file of
`service` is called, all of them together, and those outside the mathematics. A call is one that
`sys.setprofile` sees: to run a comprehension, or to go on with a generator, is a call, too.
"""

import argparse
import asyncio
import sys
import threading
from collections import Counter
from pathlib import Path
from types import FrameType

import orjson
from starlette.types import ASGIApp, Message, Scope

from service.api.app import create_app
from service.settings.values import Settings

SERVICE = f"{Path(__file__).parents[1] / 'service'}/"
MATHEMATICS = ("engine/", "surface/", "bases/", "encoders/")
WARM = 20
"""Requests before the one that is counted: caches are full then."""

NET = [[[u, v, u * v % 3] for v in range(4)] for u in range(4)]
BODY = orjson.dumps({"surface": {"control_net": NET}, "resolution": 16})
SCOPE: Scope = {
    "type": "http",
    "asgi": {"version": "3.0"},
    "http_version": "1.1",
    "method": "POST",
    "scheme": "http",
    "path": "/v1/mesh",
    "raw_path": b"/v1/mesh",
    "root_path": "",
    "headers": [
        (b"host", b"service"),
        (b"content-type", b"application/json"),
        (b"content-length", str(len(BODY)).encode()),
    ],
    "client": ("127.0.0.1", 1),
    "server": ("127.0.0.1", 8000),
}


def profile(name: str) -> Counter[str]:
    """Calls by file, its path below `service`, of a request for the format of that name."""
    return asyncio.run(_profile(create_app(Settings(), lambda _: None), name))


def outside(calls: Counter[str]) -> Counter[str]:
    """The calls of files outside the mathematics."""
    return Counter({path: n for path, n in calls.items() if not path.startswith(MATHEMATICS)})


async def _profile(app: ASGIApp, name: str) -> Counter[str]:
    for _ in range(WARM):
        await _post(app, name)
    calls: Counter[str] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        path = frame.f_code.co_filename
        if event == "call" and path.startswith(SERVICE):
            calls[path.removeprefix(SERVICE)] += 1

    threading.setprofile(count)
    sys.setprofile(count)
    try:
        await _post(app, name)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return calls


async def _post(app: ASGIApp, name: str) -> None:
    statuses = []

    async def receive() -> Message:
        return {"type": "http.request", "body": BODY, "more_body": False}

    async def send(message: Message) -> None:
        statuses.append(message.get("status"))

    query = f"format={name}".encode()
    await app({**SCOPE, "query_string": query, "state": {}}, receive, send)
    if statuses[0] != 200:
        raise SystemExit(f"the request was answered {statuses[0]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--format", default="glb", help="name of a format (glb)")
    calls = profile(parser.parse_args().format)
    for path, count in sorted(calls.items(), key=lambda pair: (-pair[1], pair[0])):
        print(f"{count:5}  {path}")
    others = outside(calls)
    print(f"in all: {calls.total()} calls in {len(calls)} files")
    print(f"outside the mathematics: {others.total()} calls in {len(others)} files")


if __name__ == "__main__":
    main()
