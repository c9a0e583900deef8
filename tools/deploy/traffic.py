"""Random requests of all kinds, and checks of their responses, for tests under load."""

import hashlib
import json
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

from service.engine.mesh.mesh import ENGINE

SEED = 1963

JSON = {"Content-Type": "application/json"}

LONG_SIDE, LONG_TRIANGLES = 10, 5_000
"""Control points in each direction, and triangles, of a mesh that takes about two seconds."""


@dataclass(frozen=True)
class Response:
    """A response of a server, with its complete, decoded body."""

    status: int
    location: str | None
    body: bytes


@dataclass(frozen=True)
class Request:
    """A request, and the statuses that its response may have."""

    kind: str
    method: str
    target: str
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""
    statuses: frozenset[int] = frozenset({200})


class Traffic:
    """Random requests of all kinds from a seed, and checks of their responses.

    Equal requests must get equal bytes: from every instance, before and after a restart, from a
    cache or computed.
    """

    def __init__(self, seed: int = SEED) -> None:
        self._random = random.Random(seed)
        self._seen: dict[tuple[str, str, bytes], str] = {}
        # Other numbers than those of the patches in other requests.
        self._stores = count(10_000)
        self.stored: dict[str, bytes] = {}
        """The bodies of the stored surfaces that the service confirmed, by id."""

    def requests(self, kinds: dict[str, int]) -> Iterator[Request]:
        """An endless sequence of random requests of these kinds.

        `kinds` has a weight for each kind; the kind `small_hit` is made by the method `_small_hit`.
        """
        names, weights = list(kinds), list(kinds.values())
        while True:
            (kind,) = self._random.choices(names, weights)
            yield getattr(self, f"_{kind}")()

    def find_fault(self, request: Request, response: Response) -> str | None:
        """The fault of a response in words, or None; notes which surfaces are stored."""
        if response.status not in request.statuses:
            return f"{response.status} {response.body[:300]!r}"
        if request.kind == "store":
            id = json.loads(response.body)["id"]
            if response.location != f"/v1/surfaces/{id}":
                return "the URL does not have the id"
            self.stored[id] = request.body
            return None
        if response.status == 304:
            return None
        if response.body[:4] == b"glTF" and int.from_bytes(response.body[8:12], "little") != len(
            response.body
        ):
            return "the length in the binary glTF is wrong"
        digest = hashlib.sha256(response.body).hexdigest()
        first_digest = self._seen.setdefault((request.method, request.target, request.body), digest)
        return (
            None
            if digest == first_digest
            else "other bytes than an earlier response to the same request"
        )

    def _small_hit(self) -> Request:
        """A small mesh that is requested often, so that the proxy's cache has it."""
        coding = self._random.choice(({}, {"Accept-Encoding": "gzip"}))
        return Request(
            "small hit",
            "GET",
            write_mesh_url("utah-teapot", f"resolution=8&engine={ENGINE}"),
            coding,
        )

    def _large_hit(self) -> Request:
        """A mesh that is too large for the proxy's cache, but in the cache of the instances."""
        return Request(
            "large hit", "GET", write_mesh_url("utah-teapot", f"resolution=40&engine={ENGINE}")
        )

    def _unchanged(self) -> Request:
        """A mesh that the client has already, so the response is 304."""
        target = write_mesh_url("torus", "resolution=32")
        return Request("304", "GET", target, {"If-None-Match": "*"}, statuses=frozenset({304}))

    def _cold(self) -> Request:
        """A mesh that is rarely in a cache."""
        name = self._random.choice(("utah-teapot", "torus", "nurbs-goblet", "trefoil-tube"))
        u, v = self._random.randrange(2, 40), self._random.randrange(2, 16)
        return Request("cold", "GET", write_mesh_url(name, f"resolution={u},{v}"))

    def _small_post(self) -> Request:
        body = write_body(
            build_patch(self._random.randrange(5000)), resolution=self._random.randrange(2, 20)
        )
        return Request("small post", "POST", "/v1/mesh?format=glb", JSON, body)

    def _points(self) -> Request:
        uv = [[self._random.random(), self._random.random()] for _ in range(50)]
        body = write_body(build_patch(self._random.randrange(5000)), uv=uv, derivatives=2)
        return Request("points", "POST", "/v1/points", JSON, body)

    def _long_post(self) -> Request:
        """A request for two seconds of work: the best mesh within a number of triangles."""
        budget = LONG_TRIANGLES + self._random.randrange(5)
        body = write_body(build_hills(LONG_SIDE), max_triangles=budget)
        return Request("long post", "POST", "/v1/mesh?format=glb", JSON, body)

    def _store(self) -> Request:
        """Stores a surface that no earlier request stored."""
        body = write_body(build_patch(next(self._stores)))
        statuses = frozenset({200, 201})
        return Request("store", "POST", "/v1/surfaces", JSON, body, statuses)

    def _stored(self) -> Request:
        """A mesh of a surface that was stored before."""
        if not self.stored:
            return self._small_hit()
        id = self._random.choice(list(self.stored))
        return Request("stored", "GET", write_mesh_url(id, f"resolution=4&engine={ENGINE}"))


def write_mesh_url(id: str, query: str) -> str:
    """The path and query of the URL of a mesh."""
    return f"/v1/surfaces/{id}/mesh.glb?{query}"


def write_body(surface: dict[str, object], **options: object) -> bytes:
    """The JSON body of a request."""
    return json.dumps({"surface": surface, **options}).encode("ascii")


def build_patch(number: int) -> dict[str, object]:
    """The JSON of a bilinear patch, which differs for each number."""
    return {"control_net": [[[0, 0, number], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}


def build_hills(side: int) -> dict[str, object]:
    """The JSON of a B-spline of `side` × `side` points, curved everywhere."""
    rows = range(side)
    net = [[[u, v, math.sin(0.7 * u) * math.cos(0.9 * v)] for v in rows] for u in rows]
    return {
        "type": "bspline",
        "control_net": net,
        "degree": [3, 3],
        "knots": ["clamped", "clamped"],
    }
