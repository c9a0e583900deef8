"""CORS: which responses a web page of another origin may read, computed or from the cache."""

from collections.abc import Iterator

import httpx
import pytest

from service.api.app import create_app
from service.api.cors import EXPOSED
from service.errors import InvalidSettings
from service.settings.values import Settings
from tools.client import Client, start_client

MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
ALLOWED, OTHER = "https://example.com", "https://example.org"
PREFLIGHT = {
    "Access-Control-Request-Method": "POST",
    "Access-Control-Request-Headers": "content-type",
}


def build_origin_header(origin: str) -> dict[str, str]:
    return {"Origin": origin}


def send_requests(client: Client, headers: dict[str, str]) -> Iterator[httpx.Response]:
    """Responses to requests for a mesh: computed, cached, unchanged; and other responses."""
    first = client.get(MESH, headers)
    yield first
    yield client.get(MESH, headers)
    yield client.get(MESH, {**headers, "If-None-Match": first.headers["etag"]})
    for url in ("/health", "/v1/surfaces", "/v1/surfaces/none", "/nothing"):
        yield client.get(url, headers)


@pytest.mark.parametrize("headers", [{}, build_origin_header(ALLOWED), build_origin_header("null")])
def test_any_origin_may_read_and_requests_without_origin_get_the_same_headers(
    headers: dict[str, str],
) -> None:
    """A browser may cache a response, and later give it to scripts of another origin."""
    with start_client(create_app(Settings())) as client:
        for response in send_requests(client, headers):
            assert response.headers["access-control-allow-origin"] == "*"
            exposed = response.headers["access-control-expose-headers"].split(", ")
            assert exposed == list(EXPOSED)
            assert response.headers["timing-allow-origin"] == "*"
            assert "Origin" not in response.headers.get("vary", "")
            assert len(response.headers.get_list("access-control-allow-origin")) == 1


def test_scripts_may_read_all_headers_of_the_service() -> None:
    with start_client(create_app(Settings())) as client:
        headers = client.get(MESH).headers
    own_headers = {name for name in headers if name.startswith("surface-")}
    assert own_headers == {"surface-deviation-bound", "surface-triangles", "surface-vertices"}
    standard_headers = {"etag", "link", "content-disposition", "server-timing"}
    assert own_headers | standard_headers <= {name.lower() for name in EXPOSED}


def test_only_listed_origins_may_read() -> None:
    settings = Settings(cors_origins=(ALLOWED, "https://example.net"))
    with start_client(create_app(settings)) as client:
        for response in send_requests(client, build_origin_header(ALLOWED)):
            assert response.headers["access-control-allow-origin"] == ALLOWED
            assert response.headers["access-control-expose-headers"]
            assert response.headers["timing-allow-origin"] == f"{ALLOWED}, https://example.net"
            assert "Origin" in response.headers["vary"]
        for headers in ({}, build_origin_header(OTHER)):
            for response in send_requests(client, headers):
                assert "access-control-allow-origin" not in response.headers
                assert "timing-allow-origin" not in response.headers
                assert "Origin" in response.headers["vary"], "caches would mix up responses"


def test_without_origins_no_page_of_another_origin_may_read() -> None:
    with start_client(create_app(Settings(cors_origins=()))) as client:
        for response in send_requests(client, build_origin_header(ALLOWED)):
            assert response.headers["cross-origin-resource-policy"] == "same-origin"
            assert not [
                name
                for name in response.headers
                if "origin" in name and not name.startswith("cross-")
            ]
            assert "Origin" not in response.headers.get("vary", "")
        response = client.request(
            "OPTIONS", "/v1/mesh", headers={**build_origin_header(ALLOWED), **PREFLIGHT}
        )
        assert response.status_code == 405


def test_an_internal_error_is_readable_and_reveals_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(_example: object) -> None:
        raise RuntimeError("not for clients")

    monkeypatch.setattr("service.surface.examples.catalogue.Example.surface", fail)
    with start_client(create_app(Settings())) as client:
        response = client.get("/v1/surfaces/tveit/mesh.glb", build_origin_header(ALLOWED))
    assert (response.status_code, response.json()["code"]) == (500, "internal_error")
    assert response.headers["content-type"] == "application/problem+json"
    assert response.headers["access-control-allow-origin"] == "*"
    assert response.headers["cache-control"] == "no-store"
    assert "not for clients" not in response.text


@pytest.mark.parametrize("url", ["/v1/mesh", MESH, "/nothing"])
def test_preflight_requests_of_browsers_are_allowed(client: Client, url: str) -> None:
    response = client.request("OPTIONS", url, headers={**build_origin_header(ALLOWED), **PREFLIGHT})
    assert (response.status_code, response.content) == (204, b"")
    assert response.headers["access-control-allow-origin"] == "*"
    assert response.headers["access-control-allow-methods"] == "GET, HEAD, POST"
    allowed_headers = response.headers["access-control-allow-headers"].lower().split(", ")
    assert set(allowed_headers) == {
        "authorization",
        "cache-control",
        "content-type",
        "if-none-match",
        "prefer",
        "traceparent",
        "tracestate",
        "x-request-id",
    }
    assert int(response.headers["access-control-max-age"]) == 86400


def test_preflight_requests_of_other_origins_are_refused() -> None:
    with start_client(create_app(Settings(cors_origins=(ALLOWED,)))) as client:
        allowed_response, refusal = (
            client.request(
                "OPTIONS", "/v1/mesh", headers={**build_origin_header(origin), **PREFLIGHT}
            )
            for origin in (ALLOWED, OTHER)
        )
    assert allowed_response.headers["access-control-allow-origin"] == ALLOWED
    assert "access-control-allow-origin" not in refusal.headers
    assert "Origin" in refusal.headers["vary"]


def test_an_ordinary_options_request_reaches_the_router(client: Client) -> None:
    response = client.request("OPTIONS", "/v1/mesh", headers=build_origin_header(ALLOWED))
    assert response.status_code == 405
    assert response.headers["access-control-allow-origin"] == "*"


@pytest.mark.parametrize(
    "origin",
    [
        *("https://example.com", "http://localhost:8080", "http://[::1]:8000", "http://127.0.0.1"),
        *(
            "tauri://localhost",
            "chrome-extension://abcdefghijklmnop",
            "https://xn--bcher-kva.example",
        ),
    ],
)
def test_origins_in_the_form_of_browsers_are_accepted(origin: str) -> None:
    with start_client(create_app(Settings(cors_origins=(origin,)))) as client:
        headers = client.get("/health", build_origin_header(origin)).headers
        assert headers["access-control-allow-origin"] == origin


@pytest.mark.parametrize(
    "origin",
    [
        *("example.com", "https://example.com/", "https://example.com/page", "https://Example.com"),
        *("HTTPS://example.com", "https://example.com:443", "http://example.com:80", "https://"),
        *("https://*.example.com", "https://user@example.com", "https://a b", "https://bücher.de"),
        *("null", "", "**", "https://example.com:", "https://example.com:0", "https://a.com?x"),
    ],
)
def test_other_texts_are_refused_at_the_start(origin: str) -> None:
    """No browser sends them as an origin, so no page could read responses."""
    with pytest.raises(InvalidSettings, match=r"^SURFACE_CORS_ORIGINS: got "):
        create_app(Settings(cors_origins=("https://a.example", origin)))
