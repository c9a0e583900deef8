"""Calls that need a key, and the responses to clients without a valid key."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import SecretStr
from starlette.types import Message, Receive, Scope, Send

from service.api.app import create_app
from service.api.cache_middleware import CacheMiddleware
from service.api.guard.keys import format_entry
from service.api.observing.middleware import RequestMiddleware
from service.api.record import record_of
from service.errors import InvalidSettings
from service.settings.values import Settings
from tools.client import Client, start_client

KEY, UNKNOWN_KEY = "sfk_" + "a1" * 32, "sfk_" + "b2" * 32
SETTINGS = Settings(api_keys=(format_entry("bob", "sfk_" + "c3" * 32), format_entry("alice", KEY)))
KEY_HEADER = {"Authorization": f"Bearer {KEY}"}
NET = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
OPEN_PATHS = ("/v1/surfaces", "/v1/formats", "/openapi.json", "/docs", "/health", "/health/live")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(SETTINGS)) as client:
        yield client


@pytest.mark.parametrize(
    ("method", "path"),
    [
        *(("POST", f"/v1/{name}") for name in ("mesh", "points", "curve", "estimate", "convert")),
        ("POST", "/v1/surfaces"),
        ("DELETE", "/v1/surfaces/" + "0" * 64),
        ("PUT", "/v1/surfaces/saddle"),
        ("BREW", "/v1/nothing"),
    ],
)
def test_computing_and_storing_need_a_key(client: Client, method: str, path: str) -> None:
    """Below /v1, all requests need a key except reads, TRACE and those for /v1/formats.

    So a new call is guarded by default, and a call that does not exist gets 401, not 404 or 405.
    """
    response = client.request(method, path, b"{}", {"Content-Type": "application/json"})
    assert response.status_code == 401
    assert response.headers["content-type"] == "application/problem+json"
    assert response.headers["www-authenticate"] == 'Bearer realm="surface"'
    assert response.headers["cache-control"] == "no-store"
    assert response.json()["code"] == response.json()["errors"][0]["code"] == "key_needed"
    assert response.json()["errors"][0]["header"] == "Authorization"


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("TRACE", "/v1/mesh"),
        ("QUERY", "/v1/formats"),
        ("TRACE", "/health"),
        ("PUT", "/health"),
        ("POST", "/docs"),
    ],
)
def test_trace_and_unguarded_paths_need_no_key(client: Client, method: str, path: str) -> None:
    response = client.request(method, path)
    assert (response.status_code, response.json()["code"]) == (405, "method_not_allowed")
    assert response.headers["allow"]


@pytest.mark.parametrize("path", ["/metrics", "/metrics%0A", "/metric%73", "/metrics/"])
@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_metrics_need_a_key_in_every_spelling_of_their_url(method: str, path: str) -> None:
    with start_client(create_app(SETTINGS.model_copy(update={"metrics": "key"}))) as client:
        assert client.request(method, path).status_code == 401
        assert client.request(method, path, headers=KEY_HEADER).status_code in (200, 404)


def test_calls_with_a_valid_key_are_allowed(client: Client) -> None:
    assert client.post("/v1/mesh", NET, KEY_HEADER).status_code == 200
    assert client.post("/v1/surfaces", NET, KEY_HEADER).status_code == 201
    assert client.request("DELETE", "/v1/surfaces/saddle", headers=KEY_HEADER).status_code == 405


@pytest.mark.parametrize(
    "value",
    [f"Bearer {UNKNOWN_KEY}", f"Bearer {KEY[:-1]}", "Bearer", "Bearer \xff", f"bearer,{KEY}"],
)
def test_an_unknown_key_is_refused(client: Client, value: str) -> None:
    headers = {"Authorization": value.encode("latin-1")}
    response = client.request("POST", "/v1/mesh", b"", headers)  # type: ignore[arg-type]
    assert response.status_code == 401
    is_missing = response.json()["code"] == "key_needed"
    assert is_missing is ("," in value)
    assert ("invalid_token" in response.headers["www-authenticate"]) is not is_missing
    assert KEY not in response.text


def test_a_key_in_the_url_is_ignored(client: Client) -> None:
    for name in ("key", "api_key", "access_token", "Authorization"):
        response = client.post(f"/v1/mesh?{name}={KEY}", NET)
        assert response.json()["code"] == "key_needed"
        assert KEY not in response.text


@pytest.mark.slow
@pytest.mark.parametrize("path", [*OPEN_PATHS, MESH, "/v1/surfaces/saddle"])
def test_reads_by_url_need_no_key(client: Client, path: str) -> None:
    """A page whose scripts are not built has the status 503."""
    assert client.get(path).status_code in (200, 503)
    assert client.request("HEAD", path).status_code in (200, 503)
    assert client.get(path, {"Authorization": "Bearer none"}).status_code in (200, 503)


def test_without_keys_the_application_runs_without_a_guard() -> None:
    app = create_app(Settings())
    assert isinstance(app.outermost, RequestMiddleware)
    assert isinstance(app.outermost.app, CacheMiddleware)
    with start_client(app) as client:
        assert client.post("/v1/mesh", NET).status_code == 200


def test_keys_may_be_in_a_file(tmp_path: Path) -> None:
    file = tmp_path / "keys"
    file.write_text(format_entry("alice", KEY), encoding="utf-8")
    with start_client(create_app(Settings(api_keys_file=str(file)))) as client:
        assert client.post("/v1/mesh", NET).status_code == 401
        assert client.post("/v1/mesh", NET, KEY_HEADER).status_code == 200


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (Settings(api_keys=("alice:0123",)), "^SURFACE_API_KEYS: key 1 "),
        (Settings(api_keys_file="/nowhere/keys"), "^SURFACE_API_KEYS_FILE: it cannot be read"),
        (Settings(metrics="key"), "^SURFACE_METRICS: got 'key' without API keys"),
        (Settings(public_reads=False), "^SURFACE_PUBLIC_READS: got 'false'"),
        (Settings(signing_keys=(SecretStr("short"),)), "^SURFACE_SIGNING_KEYS: .*too short"),
    ],
)
def test_invalid_settings_are_refused_at_the_start(settings: Settings, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message) as error:
        create_app(settings)
    assert "0123" not in str(error.value)


def test_scripts_of_other_origins_may_send_keys_and_read_refusals(client: Client) -> None:
    origin = {"Origin": "https://example.com"}
    headers = {"Access-Control-Request-Method": "POST"}
    preflight = client.request("OPTIONS", "/v1/mesh", headers=origin | headers)
    assert preflight.status_code == 204
    allowed_headers = preflight.headers["access-control-allow-headers"].lower().split(", ")
    assert "authorization" in allowed_headers
    response = client.post("/v1/mesh", NET, origin)
    assert response.status_code == 401
    assert response.headers["access-control-allow-origin"] == "*"


def test_the_request_record_has_the_name_of_the_key() -> None:
    app = create_app(SETTINGS)
    scopes: list[Scope] = []
    front = app.outermost

    async def record_scope(scope: Scope, receive: Receive, send: Send) -> None:
        scopes.append(scope)
        await front(scope, receive, send)

    app.outermost = record_scope
    with start_client(app) as client:
        client.post("/v1/mesh", NET, KEY_HEADER)
        client.get(MESH, KEY_HEADER)
        client.get(MESH)
        client.post("/v1/mesh", NET)
    assert [record_of(scope).key for scope in scopes] == ["alice", "alice", "", ""]
    assert record_of(scopes[-1]).code == "key_needed"


def test_the_guard_passes_on_events_that_are_not_requests(client: Client) -> None:
    """The events of the server's start and end, "lifespan", have no method and no headers."""
    app = create_app(SETTINGS)
    messages: list[Message] = []

    async def receive() -> Message:
        return {"type": "lifespan.startup" if not messages else "lifespan.shutdown"}

    async def send(message: Message) -> None:
        messages.append(message)

    client.call(app, {"type": "lifespan", "app": app, "state": {}}, receive, send)
    types = [message["type"] for message in messages]
    assert types == ["lifespan.startup.complete", "lifespan.shutdown.complete"]
