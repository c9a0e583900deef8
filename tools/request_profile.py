"""A profile of one request: how often functions of the service are called for a small mesh.

`python -m tools.request_profile [--format glb]` posts a net of 4 × 4 control points at resolution
16, a mesh of 17 × 17 vertices, to the application in this process. It prints the number of calls
for each file of `service`, for all files, and for those outside the mathematics. It counts the
calls that `sys.setprofile` reports; these include comprehensions and resumed generators.
"""

import argparse
import asyncio
import gc
import logging
import sys
import threading
from collections import Counter
from pathlib import Path
from types import FrameType

import httpx
import orjson
from starlette.types import ASGIApp

from service.api.app import create_app
from service.settings.values import Settings

SERVICE = f"{Path(__file__).parents[1] / 'service'}/"
MATHEMATICS = ("engine/", "surface/", "bases/", "encoders/")
WARM = 20
"""Requests before the counted one, to fill the caches."""

NET = [[[u, v, u * v % 3] for v in range(4)] for u in range(4)]
BODY = orjson.dumps({"surface": {"control_net": NET}, "resolution": 16})
HEADERS = {"Content-Type": "application/json"}


def profile(name: str) -> Counter[str]:
    """Calls of a request for the named format, by the file's path below `service`."""
    return asyncio.run(_profile(create_app(Settings(), lambda _: None), name))


def outside(calls: Counter[str]) -> Counter[str]:
    """The calls of files outside the mathematics."""
    return Counter({path: n for path, n in calls.items() if not path.startswith(MATHEMATICS)})


async def _profile(app: ASGIApp, name: str) -> Counter[str]:
    calls: Counter[str] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        path = frame.f_code.co_filename
        if event == "call" and path.startswith(SERVICE):
            calls[path.removeprefix(SERVICE)] += 1

    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(transport=transport, base_url="http://service") as client:
        del client.headers["Accept-Encoding"]
        for number in range(WARM + 1):
            await asyncio.sleep(0)  # the event loop begins another round
            if number == WARM:
                gc.collect()  # so that finalizers of older objects do not run and count
                logging.disable()  # else handlers of the service would log the client
                threading.setprofile(count)
                sys.setprofile(count)
            try:
                response = await client.post(
                    f"/v1/mesh?format={name}", content=BODY, headers=HEADERS
                )
            finally:
                sys.setprofile(None)
                threading.setprofile(None)
                logging.disable(logging.NOTSET)
            response.raise_for_status()
    return calls


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
