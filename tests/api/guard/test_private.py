"""If reads are private, they need a key or a signed URL; and caches may not share responses."""

import time
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import SecretStr

from service.api.app import create_app
from service.api.guard.keys import format_entry, make_key
from service.api.guard.signatures import Signer
from service.settings.values import Settings
from tools.client import Client, start_client

KEY, SECRET = make_key(), "0123456789abcdef" * 2
KEY_HEADER = {"Authorization": f"Bearer {KEY}"}
SETTINGS = Settings(
    api_keys=(format_entry("alice", KEY),), public_reads=False, signing_keys=(SecretStr(SECRET),)
)
NET = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(SETTINGS)) as client:
        yield client


def post_sign(client: Client, url: str = MESH, **end: Any) -> Any:
    """The response to a request to sign a URL; `end` is `expires` or `seconds` (default: 600)."""
    return client.post("/v1/sign", {"url": url, **(end or {"seconds": 600})}, KEY_HEADER)


def sign_url(client: Client, url: str = MESH, **end: Any) -> str:
    """The URL, signed by the service."""
    response = post_sign(client, url, **end)
    assert response.status_code == 200, response.text
    return str(response.json()["url"])


def store_net(client: Client) -> dict[str, Any]:
    """Stores a surface; returns its links."""
    links: dict[str, Any] = client.post("/v1/surfaces", NET, KEY_HEADER).json()["links"]
    return links


def test_examples_of_the_openapi_document_are_signed(client: Client) -> None:
    operation = client.get("/openapi.json", KEY_HEADER).json()["paths"]["/v1/sign"]["post"]
    for example in operation["requestBody"]["content"]["application/json"]["examples"].values():
        response = client.post("/v1/sign", example["value"], KEY_HEADER)
        assert response.status_code == 200, response.text
        assert client.get(response.json()["url"]).status_code == 200


@pytest.mark.parametrize(
    "path", [MESH, "/v1/surfaces/saddle", "/v1/surfaces/none", "/v1/surfaces/a/b/c", "/v1/none"]
)
def test_reads_need_a_key_or_a_signature(client: Client, path: str) -> None:
    """Without a key, a client cannot learn whether a surface exists."""
    for method in ("GET", "HEAD"):
        response = client.request(method, path)
        assert response.status_code == 401
        assert response.headers["www-authenticate"].startswith("Bearer")
        assert response.headers["cache-control"] == "no-store"
    needed = client.get(path).json()["errors"][0]["needed"]
    assert "signed URL" in needed


@pytest.mark.parametrize("path", ["/v1/surfaces", "/v1/formats", "/health", "/openapi.json"])
def test_lists_and_descriptions_stay_open(client: Client, path: str) -> None:
    assert client.get(path).status_code == 200


def test_responses_to_a_key_are_cached_privately_and_revalidated(client: Client) -> None:
    links = store_net(client)
    for path in (MESH, MESH, links["self"], links["mesh"]["glb"], links["mesh"]["glb"]):
        response = client.get(path, KEY_HEADER)
        assert response.status_code == 200
        assert response.headers.get_list("cache-control") == ["private, no-cache"]
        # All requests share the headers of a cached response; they must not add the value twice.
        assert response.headers.get_list("vary").count("Authorization") == 1
        revalidation = client.get(path, KEY_HEADER | {"If-None-Match": response.headers["etag"]})
        assert revalidation.status_code == 304
        assert revalidation.headers.get_list("cache-control") == ["private, no-cache"]
        assert client.get(path, {"If-None-Match": response.headers["etag"]}).status_code == 401


def test_signed_urls_need_no_key_and_are_cached_privately_until_they_expire(client: Client) -> None:
    links = store_net(client)
    # The bytes of `MESH` may change, so caches keep them for at most an hour.
    for path, max_age in ((MESH, 3600), (links["self"], 7200), (links["mesh"]["glb"], 7200)):
        url = sign_url(client, path, seconds=7200)
        response = client.get(url)
        assert response.status_code == 200
        assert client.request("HEAD", url).headers["etag"] == response.headers["etag"]
        cache_control = response.headers["cache-control"]
        assert cache_control.startswith("private, max-age=")
        assert max_age - 60 < int(cache_control.rpartition("=")[2]) <= max_age
        unchanged = client.get(url, {"If-None-Match": response.headers["etag"]})
        assert unchanged.status_code == 304
        assert unchanged.headers["cache-control"].startswith("private, max-age=")


def test_signed_and_unsigned_urls_share_a_cached_response() -> None:
    app = create_app(SETTINGS)
    with start_client(app) as client:
        first = client.get(MESH, KEY_HEADER)
        for url in (
            sign_url(client),
            sign_url(client, seconds=700),
            sign_url(client, MESH + "&uvs=false"),
        ):
            response = client.get(url)
            assert response.content == first.content
            assert response.headers["etag"] == first.headers["etag"]
            assert response.headers["server-timing"] == "cache;desc=hit"
            assert "signature" not in response.headers["link"]
            assert client.get(url).headers["server-timing"] == "cache;desc=hit"
    assert len(app.state.services.cache) == 1
    assert app.state.services.cache.misses == 1


def test_invalid_signatures_are_refused_even_with_a_key(client: Client) -> None:
    url = sign_url(client)
    start, _, end_of_url = url.partition("expires=")
    # It has expired, too, but the service checks the signature first.
    url_with_other_expiry = f"{start}expires=1&{end_of_url.partition('&')[2]}"
    url_with_other_resolution = url.replace("resolution=2", "resolution=3")
    for headers in ({}, KEY_HEADER):
        for invalid_url in (url + "a", url_with_other_resolution, url_with_other_expiry):
            response = client.get(invalid_url, headers)
            assert response.status_code == 403
            assert response.json()["code"] == "signature_invalid"
            assert response.json()["errors"][0]["parameter"] == "signature"
            assert response.headers["access-control-allow-origin"] == "*"


def test_signed_urls_expire(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    url = sign_url(client)
    monkeypatch.setattr("service.api.guard.guard.time.time", lambda: 4e9)
    response = client.get(url)
    assert response.status_code == 403
    assert response.json()["code"] == "signature_expired"


def test_a_signature_permits_its_url_only(client: Client) -> None:
    query = sign_url(client).partition("?")[2]
    assert client.post(f"/v1/mesh?{query}", NET).status_code == 401
    assert client.request("DELETE", f"/v1/surfaces/saddle?{query}").status_code == 401
    assert client.get(f"/v1/surfaces/torus/mesh.glb?{query}").status_code == 403


def test_an_absolute_expiry_gives_equal_urls(client: Client) -> None:
    end = int(time.time()) + 1000
    first, second = (post_sign(client, expires=end) for _ in range(2))
    assert first.json() == second.json()
    assert first.json()["expires"] == end
    assert first.headers["cache-control"] == "no-store"


@pytest.mark.parametrize(
    ("document", "code", "pointer"),
    [
        ({"url": MESH}, "missing_field", "/expires"),
        ({"url": MESH, "expires": 1, "seconds": 1}, "conflicting_options", "/expires"),
        ({"url": MESH, "expires": 1}, "out_of_range", "/expires"),
        ({"url": MESH, "expires": 10**11}, "out_of_range", "/expires"),
        ({"url": MESH, "seconds": 0}, "out_of_range", "/seconds"),
        ({"url": MESH, "seconds": 700_000}, "out_of_range", "/seconds"),
        ({"url": MESH, "seconds": 1.5}, "wrong_type", "/seconds"),
        ({"url": MESH, "seconds": None}, "null_value", "/seconds"),
        ({"seconds": 9}, "missing_field", "/url"),
        ({"url": "x" * 9000, "seconds": 9}, "wrong_length", "/url"),
        *(
            ({"url": url, "seconds": 9}, "wrong_value", "/url")
            for url in (
                "",
                "https://example.com/v1/surfaces/saddle",
                "//example.com/v1/surfaces/saddle",
                "/v1/surfaces",
                "/v1/mesh",
                "/v1/surfaces/saddle/mesh.exe",
                "/v1/surfaces/../../etc/passwd",
                "/v1/surfaces/saddle#part",
                "/v1/surfaces/saddle?a=\n",
                "/v1/surfaces/saddle?a=ä",
                "/v1/surfaces/saddle?expires=9",
                "file:///etc/passwd",
            )
        ),
    ],
)
def test_invalid_requests_for_a_signature_are_refused(
    client: Client, document: dict[str, Any], code: str, pointer: str
) -> None:
    response = client.post("/v1/sign", document, KEY_HEADER)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["pointer"]) == (code, pointer)
    assert "example.com" not in response.text


def test_signing_needs_a_key_and_the_settings_of_keys_and_secrets(client: Client) -> None:
    assert client.post("/v1/sign", {"url": MESH, "seconds": 9}).status_code == 401
    for settings in (
        Settings(api_keys=SETTINGS.api_keys),
        Settings(signing_keys=SETTINGS.signing_keys),
    ):
        with start_client(create_app(settings)) as other_client:
            response = other_client.post("/v1/sign", {"url": MESH, "seconds": 9}, KEY_HEADER)
            assert response.status_code == 404


def test_signed_urls_of_public_surfaces_are_checked_and_cached_publicly() -> None:
    settings = Settings(signing_keys=SETTINGS.signing_keys)
    query = Signer([SECRET]).sign("/v1/surfaces/saddle", "", int(time.time()) + 60)
    with start_client(create_app(settings)) as client:
        response = client.get(f"/v1/surfaces/saddle?{query}")
        assert response.status_code == 200
        assert response.headers["cache-control"].startswith("public")
        assert client.get(f"/v1/surfaces/saddle?{query}0").status_code == 403
