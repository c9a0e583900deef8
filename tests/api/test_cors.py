"""Pages of other origins: which of them may read cached and computed responses."""

from collections.abc import Iterator

import httpx
import pytest

from service.api.app import create_app
from service.api.cors import EXPOSED
from service.settings.values import Settings
from tests.api.client import Client, start_client

MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
OURS, OTHER = "https://example.com", "https://example.org"
PREFLIGHT = {
    "Access-Control-Request-Method": "POST",
    "Access-Control-Request-Headers": "content-type",
}


def origin_header(origin: str) -> dict[str, str]:
    return {"Origin": origin}


def send_requests(client: Client, headers: dict[str, str]) -> Iterator[httpx.Response]:
    """Responses: a mesh, the same from the cache, a 304, other files, a problem."""
    first = client.get(MESH, headers)
    yield first
    yield client.get(MESH, headers)
    yield client.get(MESH, {**headers, "If-None-Match": first.headers["etag"]})
    for url in ("/health", "/v1/surfaces", "/v1/surfaces/none", "/nothing"):
        yield client.get(url, headers)


@pytest.mark.parametrize("headers", [{}, origin_header(OURS), origin_header("null")])
def test_any_origin_may_read_and_requests_without_origin_get_the_same_headers(
    headers: dict[str, str],
) -> None:
    """A browser may give a response that it cached on a visit to scripts of other origins."""
    with start_client(create_app(Settings())) as client:
        for response in send_requests(client, headers):
            assert response.headers["access-control-allow-origin"] == "*"
            exposed = response.headers["access-control-expose-headers"].split(", ")
            assert exposed == list(EXPOSED)
            assert response.headers["timing-allow-origin"] == "*"
            assert "Origin" not in response.headers.get("vary", "")
            assert len(response.headers.get_list("access-control-allow-origin")) == 1


def test_every_header_of_ours_is_exposed() -> None:
    with start_client(create_app(Settings())) as client:
        headers = client.get(MESH).headers
    ours = {name for name in headers if name.startswith("surface-")}
    assert len(ours) == 3
    named = {"etag", "link", "content-disposition", "server-timing"}
    assert ours | named <= {name.lower() for name in EXPOSED}


def test_some_origins_may_read() -> None:
    settings = Settings(cors_origins=(OURS, "https://example.net"))
    with start_client(create_app(settings)) as client:
        for response in send_requests(client, origin_header(OURS)):
            assert response.headers["access-control-allow-origin"] == OURS
            assert response.headers["access-control-expose-headers"]
            assert response.headers["timing-allow-origin"] == f"{OURS}, https://example.net"
            assert "Origin" in response.headers["vary"]
        for headers in ({}, origin_header(OTHER)):
            for response in send_requests(client, headers):
                assert "access-control-allow-origin" not in response.headers
                assert "timing-allow-origin" not in response.headers
                assert "Origin" in response.headers["vary"], "else caches mix them up"


def test_no_origin_may_read() -> None:
    with start_client(create_app(Settings(cors_origins=()))) as client:
        for response in send_requests(client, origin_header(OURS)):
            assert response.headers["cross-origin-resource-policy"] == "same-origin"
            assert not [n for n in response.headers if "origin" in n and not n.startswith("cross-")]
            assert "Origin" not in response.headers.get("vary", "")
        headers = client.request(
            "OPTIONS", "/v1/mesh", headers={**origin_header(OURS), **PREFLIGHT}
        )
        assert headers.status_code == 405


def test_an_internal_error_is_readable_and_reveals_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(_example: object) -> None:
        raise RuntimeError("not for clients")

    monkeypatch.setattr("service.surface.examples.Example.surface", fail)
    with start_client(create_app(Settings())) as client:
        response = client.get("/v1/surfaces/tveit/mesh.glb", origin_header(OURS))
    assert (response.status_code, response.json()["code"]) == (500, "internal_error")
    assert response.headers["content-type"] == "application/problem+json"
    assert response.headers["access-control-allow-origin"] == "*"
    assert response.headers["cache-control"] == "no-store"
    assert "not for clients" not in response.text


@pytest.mark.parametrize("url", ["/v1/mesh", MESH, "/nothing"])
def test_preflight_requests_of_browsers(client: Client, url: str) -> None:
    response = client.request("OPTIONS", url, headers={**origin_header(OURS), **PREFLIGHT})
    assert (response.status_code, response.content) == (204, b"")
    assert response.headers["access-control-allow-origin"] == "*"
    assert response.headers["access-control-allow-methods"] == "GET, HEAD, POST"
    allowed = response.headers["access-control-allow-headers"].lower().split(", ")
    assert {"content-type", "if-none-match"} <= set(allowed)
    assert int(response.headers["access-control-max-age"]) == 86400


def test_preflight_requests_of_other_origins_are_refused() -> None:
    with start_client(create_app(Settings(cors_origins=(OURS,)))) as client:
        ours, other = (
            client.request("OPTIONS", "/v1/mesh", headers={**origin_header(origin), **PREFLIGHT})
            for origin in (OURS, OTHER)
        )
    assert ours.headers["access-control-allow-origin"] == OURS
    assert "access-control-allow-origin" not in other.headers
    assert "Origin" in other.headers["vary"]


def test_an_ordinary_options_request_reaches_the_router(client: Client) -> None:
    response = client.request("OPTIONS", "/v1/mesh", headers=origin_header(OURS))
    assert response.status_code == 405
    assert response.headers["access-control-allow-origin"] == "*"
