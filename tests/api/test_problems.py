"""Problems: statuses, unknown URLs and methods, long and slow bodies, limits of the settings."""

import io
from collections.abc import AsyncIterator, Iterator
from typing import Any

import anyio
import numpy as np
import orjson
import pytest

from service.api.app import create_app
from service.api.problems import PROBLEMS, problem_of
from service.cancellation import OutOfTime
from service.errors import (
    DamagedObject,
    Issue,
    JobQuotaFull,
    PartCrashed,
    StoreFailed,
    StoreFull,
    SurfaceError,
)
from service.settings.values import Settings
from tools.client import Client, start_client

JSON = {"Content-Type": "application/json"}
NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]


FAILURES = (DamagedObject, JobQuotaFull, OutOfTime, PartCrashed, StoreFailed, StoreFull)
"""Errors that are not the client's."""


def list_subclasses(cls: type[SurfaceError]) -> Iterator[type[SurfaceError]]:
    for subclass in cls.__subclasses__():
        yield subclass
        yield from list_subclasses(subclass)


def test_every_error_has_a_status() -> None:
    for cls in list_subclasses(SurfaceError):
        lowest = 500 if cls in FAILURES else 400
        assert lowest <= problem_of(cls(Issue("code", "text"))).status < lowest + 100
    assert set(PROBLEMS) <= set(list_subclasses(SurfaceError))


@pytest.mark.parametrize(
    "url", ["/nothing", "/v1", "/v1/mesh/", "/v1/surfaces/", "/v1/surfaces/a/b", "/docs/x"]
)
def test_unknown_urls_are_not_found(client: Client, url: str) -> None:
    response = client.get(url)
    assert response.status_code == 404
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["code"] == "not_found"


@pytest.mark.parametrize(
    ("method", "url", "allowed"),
    [
        ("GET", "/v1/mesh", {"POST"}),
        ("HEAD", "/v1/mesh", {"POST"}),
        ("PUT", "/v1/mesh", {"POST"}),
        ("PUT", "/v1/surfaces", {"GET", "HEAD", "POST"}),
        ("DELETE", "/v1/surfaces/saddle", {"GET", "HEAD"}),
        ("PATCH", "/v1/surfaces/saddle/mesh.glb", {"GET", "HEAD"}),
        ("OPTIONS", "/v1/formats", {"GET", "HEAD"}),
        ("POST", "/health", {"GET", "HEAD"}),
        ("BREW", "/", {"GET", "HEAD"}),
    ],
)
def test_methods_that_a_url_does_not_have_are_refused(
    client: Client, method: str, url: str, allowed: set[str]
) -> None:
    response = client.request(method, url)
    assert response.status_code == 405
    assert response.headers["content-type"] == "application/problem+json"
    assert set(response.headers["allow"].split(", ")) == allowed


def test_not_acceptable_lists_the_acceptable_types(client: Client) -> None:
    response = client.post("/v1/mesh", {"surface": {"control_net": NET}}, {"Accept": "image/png"})
    assert response.status_code == 406
    assert response.json()["errors"][0]["header"] == "Accept"
    assert "model/gltf-binary" in response.json()["errors"][0]["needed"]


def test_a_body_with_too_high_a_length_is_refused_before_it_is_read() -> None:
    pieces: list[bytes] = []

    def yield_body() -> Iterator[bytes]:
        pieces.append(b" " * 1025)
        yield pieces[-1]

    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        response = client.request(
            "POST", "/v1/mesh", yield_body(), JSON | {"Content-Length": "1025"}
        )
    assert pieces == []
    assert response.status_code == 413
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["code"] == "body_too_large"


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        (Settings(max_json_bytes=2000), "body_too_large"),
        (Settings(max_json_values=1000), "too_many_values"),
    ],
)
def test_a_net_that_is_too_large_for_json_is_accepted_as_npy(settings: Settings, code: str) -> None:
    net = np.zeros((20, 20, 3))
    net[..., 0], net[..., 1] = np.indices((20, 20))
    body = orjson.dumps({"surface": {"control_net": net.tolist()}})
    file = io.BytesIO()
    np.save(file, net)
    with start_client(create_app(settings)) as client:
        response = client.request("POST", "/v1/mesh", [body], JSON)
        assert response.json()["errors"][0]["code"] == code
        assert ".npy" in response.json()["errors"][0]["needed"]
        npy = {"Content-Type": "application/x-npy"}
        assert client.request("POST", "/v1/mesh", [file.getvalue()], npy).status_code == 200


def test_a_body_of_unknown_length_is_refused_as_soon_as_it_is_too_long() -> None:
    read_pieces = 0

    def yield_forever() -> Iterator[bytes]:
        nonlocal read_pieces
        while True:
            read_pieces += 1
            yield b" " * 400

    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        response = client.request("POST", "/v1/mesh", yield_forever(), JSON)
    assert response.status_code == 413
    assert read_pieces == 3  # 1200 bytes; two pieces have 800, fewer than 1024


def test_a_body_of_the_largest_allowed_length_is_read() -> None:
    body = b'{"surface":{"control_net":[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]]]}}'.ljust(1024)
    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        assert client.request("POST", "/v1/mesh", body, JSON).status_code == 200


def test_a_slow_body_is_refused() -> None:
    async def yield_slowly() -> AsyncIterator[bytes]:
        yield b"{"
        await anyio.sleep(600)

    with start_client(create_app(Settings(body_timeout=1))) as client:
        response = client.request("POST", "/v1/mesh", yield_slowly(), JSON)
    assert response.status_code == 408
    assert response.json()["code"] == "body_too_slow"


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        (Settings(max_control_points=5), "too_many_control_points"),
        (Settings(max_degree=1), "degree_too_high"),
        (Settings(max_vertices=50), "too_many_vertices"),
        (Settings(max_response_bytes=1024), "too_many_bytes"),
    ],
)
def test_meshes_above_the_limits_of_the_settings_are_refused(settings: Settings, code: str) -> None:
    document = {"surface": {"control_net": [[[i, j, 0] for j in range(3)] for i in range(2)]}}
    with start_client(create_app(settings)) as client:
        response = client.post("/v1/mesh", {**document, "resolution": 8})
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == code


def test_the_limit_of_control_points_is_for_all_members_of_a_group() -> None:
    curve = {"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]}
    members = [
        {"surface": {"control_net": NET}},
        {"surface": {"type": "tube", "curve": curve, "radius": 1}},
        {"surface": {"type": "ribbon", "curve": curve, "width": 1}},
        {"surface": {"type": "triangle", "control_net": [NET[0], NET[1][:1]]}},
    ]
    body = {"surface": {"type": "group", "members": members}, "resolution": 1}
    for limit, status in ((15, 200), (14, 422)):
        with start_client(create_app(Settings(max_control_points=limit))) as client:
            response = client.post("/v1/mesh", body)
        assert response.status_code == status
    (error,) = response.json()["errors"]
    assert (error["code"], error["pointer"]) == ("too_many_control_points", "/surface/members")
    assert error["got"] == "15 control points"


@pytest.mark.parametrize(
    ("path", "document", "pointer"),
    [
        ("/v1/mesh", {"surface": {"degree": 3}}, "/surface/degree"),
        ("/v1/mesh", {"surface": {"degree": [2, 3]}}, "/surface/degree/1"),
        ("/v1/points", {"surface": {}, "uv": [[0, 0]]}, "/surface/degree"),
        ("/v1/convert", {"surface": {}, "operations": [{"op": "bezier"}]}, "/surface/degree"),
        ("/v1/curve", {"curve": {"degree": 4}}, "/curve/degree"),
    ],
)
def test_the_limit_of_degrees_applies_to_splines(
    path: str, document: dict[str, Any], pointer: str
) -> None:
    """A spline without `degree` has degree 3. The control points are the same in all cases."""
    points = [[i, i * i % 3, 0] for i in range(5)]
    for kind, net in (
        ("surface", {"type": "bspline", "control_net": [points] * 5}),
        ("curve", {"type": "bspline", "control_points": points}),
    ):
        if kind in document:
            document = {**document, kind: {**net, **document[kind]}}
    with start_client(create_app(Settings(max_degree=2))) as client:
        response = client.post(path, document)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["pointer"]) == ("degree_too_high", pointer)
    assert error["needed"] == "1 to 2"
