"""Counts the calls of functions of the service during one request for a small mesh.

`python -m tools.request_profile [--format glb]` sends a request to the application in this process:
a net of 4 × 4 control points at resolution 16, which gives a mesh of 17 × 17 vertices. It prints
the number of calls for each file of `service`, for all files, and for all files except those of the
mathematics. It counts the calls that `sys.setprofile` reports, among them resumed generators and,
before Python 3.12, comprehensions.
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
WARM_UP_REQUESTS = 20
"""Number of requests that fill the caches, before the request whose calls are counted."""

NET = [[[u, v, u * v % 3] for v in range(4)] for u in range(4)]
BODY = orjson.dumps({"surface": {"control_net": NET}, "resolution": 16})
HEADERS = {"Content-Type": "application/json"}


def count_calls(format_name: str) -> Counter[str]:
    """Numbers of calls during a request for this format, by path of the file below `service`."""
    app = create_app(Settings(), log=lambda _: None)  # makes the lines of the access log, as usual
    return asyncio.run(_count_calls(app, format_name))


def exclude_mathematics(calls: Counter[str]) -> Counter[str]:
    """The calls without those of the files of the mathematics."""
    return Counter({path: n for path, n in calls.items() if not path.startswith(MATHEMATICS)})


async def _count_calls(app: ASGIApp, format_name: str) -> Counter[str]:
    calls: Counter[str] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        path = frame.f_code.co_filename
        if event == "call" and path.startswith(SERVICE):
            calls[path.removeprefix(SERVICE)] += 1

    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(transport=transport, base_url="http://service") as client:
        del client.headers["Accept-Encoding"]  # the service then compresses nothing
        for number in range(WARM_UP_REQUESTS + 1):
            # Another round of the event loop: after much work in one round, small requests wait.
            await asyncio.sleep(0)
            if number == WARM_UP_REQUESTS:
                gc.collect()  # otherwise finalizers of older objects may run and be counted
                logging.disable()  # otherwise handlers of the service log the requests of httpx
                threading.setprofile(count)
                sys.setprofile(count)
            try:
                response = await client.post(
                    f"/v1/mesh?format={format_name}", content=BODY, headers=HEADERS
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
    calls = count_calls(parser.parse_args().format)
    for path, count in sorted(calls.items(), key=lambda pair: (-pair[1], pair[0])):
        print(f"{count:5}  {path}")
    other_calls = exclude_mathematics(calls)
    print(f"in all: {calls.total()} calls in {len(calls)} files")
    print(f"outside the mathematics: {other_calls.total()} calls in {len(other_calls)} files")


if __name__ == "__main__":
    main()
