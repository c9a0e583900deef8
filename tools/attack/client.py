"""A well-behaved client sends small requests at a steady rate, and compares their responses.

Every response must have the same bytes as the first response to the same request. The client is a
process of its own, so that the attacks do not slow it down. For each request it writes a line to
standard output: `time kind seconds outcome`. The outcome is `ok` or the fault.
"""

import http.client
import itertools
import json
import sys
import time
from dataclasses import dataclass

INTERVAL = 0.012
"""Seconds from one request to the next."""

SOURCE = "127.0.0.3"
"""The address of the client: to the service, it is another caller than the attackers."""

PATIENCE = 5.0
"""Seconds after which the client gives up a request."""

REQUESTS_PER_CONNECTION = 25
"""Number of requests that the client sends on one connection."""

_NET = [[[i, j, (i * j) % 3] for j in range(4)] for i in range(4)]


@dataclass(frozen=True, slots=True)
class Request:
    """A request that the client sends; `status` is the expected status."""

    kind: str
    method: str
    url: str
    body: bytes | None = None
    status: int = 200


def _build_post(kind: str, url: str, **document: object) -> Request:
    return Request(kind, "POST", url, json.dumps(document).encode())


_SURFACE = {"control_net": _NET}

REQUESTS = (
    Request("health", "GET", "/health/live"),
    Request("hit", "GET", "/v1/surfaces/utah-teapot/mesh.glb?resolution=8"),
    _build_post("mesh", "/v1/mesh?format=glb", surface=_SURFACE, resolution=8),
    Request("hit", "GET", "/v1/surfaces/saddle/mesh.stl?resolution=16"),
    _build_post("points", "/v1/points", surface=_SURFACE, uv=[[0.5, 0.25], [0, 1]], derivatives=2),
    Request("get", "GET", "/v1/surfaces/torus"),
    _build_post("mesh", "/v1/mesh?format=json", surface=_SURFACE, resolution=6),
    _build_post("estimate", "/v1/estimate", surface=_SURFACE, resolution=64),
    Request("refused", "POST", "/v1/mesh", b'{"surface": {"control_net": [[1]]}}', 422),
)


def main(port: int) -> None:
    """Sends requests until the process is stopped."""
    connection = http.client.HTTPConnection(
        "127.0.0.1", port, timeout=PATIENCE, source_address=(SOURCE, 0)
    )
    expected = {request: _send_request(connection, request)[1] for request in REQUESTS}
    next_start = time.monotonic()
    for number in itertools.count():
        request = REQUESTS[number % len(REQUESTS)]
        if number % REQUESTS_PER_CONNECTION == 0:
            connection.close()  # the next request opens a new one
        start = time.monotonic()
        try:
            status, content = _send_request(connection, request)
            outcome = "other bytes" if content != expected[request] else "ok"
            if status != request.status:
                outcome = f"status {status}"
        except (OSError, http.client.HTTPException) as error:
            outcome = type(error).__name__
            connection.close()
        end = time.monotonic()
        print(f"{end:.6f} {request.kind} {end - start:.6f} {outcome}", flush=True)
        # After slow responses it skips requests; it makes up for at most two of them.
        next_start = max(next_start + INTERVAL, end - INTERVAL)
        time.sleep(max(0.0, next_start - time.monotonic()))


def _send_request(connection: http.client.HTTPConnection, request: Request) -> tuple[int, bytes]:
    headers = {"Content-Type": "application/json"} if request.body is not None else {}
    connection.request(request.method, request.url, request.body, headers)
    response = connection.getresponse()
    return response.status, response.read()


if __name__ == "__main__":
    main(int(sys.argv[1]))
