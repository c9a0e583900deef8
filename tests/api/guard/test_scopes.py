"""Scopes of keys: which calls a key permits, and the response to a key that lacks the scope."""

from collections.abc import Iterator

import pytest
from pydantic import SecretStr

from service.api.app import create_app
from service.api.guard.keys import SCOPES, KeyScope, format_entry
from service.api.guard.policy import scope_of
from service.settings.values import Settings
from tools.client import Client, start_client

KEYS: dict[KeyScope, str] = {
    scope: "sfk_" + f"{number}f" * 32 for number, scope in enumerate(SCOPES)
}
SETTINGS = Settings(
    api_keys=tuple(format_entry(f"{s}-only", KEYS[s], frozenset({s})) for s in SCOPES),
    public_reads=False,
    signing_keys=(SecretStr("x" * 32),),
    allow_delete=True,
    metrics="key",
)
NET = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
SIGN = {"url": "/v1/surfaces/saddle", "seconds": 60}
CALLS: list[tuple[str, str, object, KeyScope]] = [
    *(
        ("POST", f"/v1/{name}", NET, "compute")
        for name in ("mesh", "points", "curve", "estimate", "convert", "measure", "project")
    ),
    ("POST", "/v1/surfaces", NET, "store"),
    ("POST", "/v1/sign", SIGN, "read"),
    ("GET", "/v1/surfaces/saddle", None, "read"),
    ("HEAD", "/v1/surfaces/saddle/mesh.glb", None, "read"),
    ("GET", "/metrics", None, "read"),
    ("GET", "/v1/stored", None, "admin"),
    ("HEAD", "/v1/stored?limit=1", None, "admin"),
    ("DELETE", "/v1/surfaces/" + "0" * 64, None, "delete"),
    ("PUT", "/v1/nothing", None, "compute"),
]


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(SETTINGS)) as client:
        yield client


def authorize(scope: KeyScope) -> dict[str, str]:
    return {"Authorization": f"Bearer {KEYS[scope]}"}


@pytest.mark.parametrize(("method", "path", "body", "scope"), CALLS)
def test_a_call_needs_its_scope_and_no_other(
    client: Client, method: str, path: str, body: object, scope: KeyScope
) -> None:
    assert scope_of(method, path) == scope
    for other in SCOPES:
        headers = authorize(other)
        response = (
            client.request(method, path, headers=headers)
            if body is None
            else client.post(path, body, headers)
        )
        assert (response.status_code == 403) is (other != scope), other


def test_the_refusal_names_the_scope_and_not_the_key(client: Client) -> None:
    response = client.post("/v1/mesh", NET, authorize("read"))
    assert response.status_code == 403
    assert response.headers["www-authenticate"] == (
        'Bearer realm="surface", error="insufficient_scope"'
    )
    problem = response.json()
    assert problem["code"] == problem["errors"][0]["code"] == "scope_needed"
    assert problem["errors"][0]["header"] == "Authorization"
    assert problem["errors"][0]["needed"] == "a key with the scope compute"
    assert KEYS["read"] not in response.text


def test_a_signed_url_needs_no_scope(client: Client) -> None:
    url = client.post("/v1/sign", SIGN, authorize("read")).json()["url"]
    assert client.get(url).status_code == 200
    assert client.get(url, authorize("compute")).status_code == 200


def test_calls_that_need_no_key_need_no_scope() -> None:
    settings = SETTINGS.model_copy(update={"public_reads": True, "metrics": "open"})
    with start_client(create_app(settings)) as client:
        for path in ("/v1/surfaces/saddle", "/v1/formats", "/health", "/metrics"):
            assert client.get(path, authorize("compute")).status_code == 200


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/jobs%0a"])
def test_lists_of_jobs_need_a_key_however_their_path_is_written(path: str) -> None:
    settings = SETTINGS.model_copy(update={"public_reads": True})
    with start_client(create_app(settings)) as client:
        assert client.get(path).status_code == 401
