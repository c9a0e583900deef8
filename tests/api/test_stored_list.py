"""GET /v1/stored: the list of stored surfaces, page by page."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.api.app import Application, create_app
from service.api.guard.keys import format_entry, make_key
from service.api.models.surfaces import StoredList
from service.settings.values import Settings
from tools.client import Client, start_client

KEY = make_key()
HEADERS = {"Authorization": f"Bearer {KEY}"}
LINE = format_entry("admin", KEY, frozenset({"admin", "store", "delete"}))


def surface(number: int) -> dict[str, Any]:
    return {"surface": {"control_net": [[[0, 0, 0], [0, 1, number]], [[1, 0, 1], [1, 1, 0]]]}}


@pytest.fixture(params=["folder", "memory"])
def app(request: pytest.FixtureRequest, tmp_path: Path) -> Application:
    store = str(tmp_path / "store") if request.param == "folder" else "memory://"
    return create_app(Settings(store=store, api_keys=(LINE,), allow_delete=True))


@pytest.fixture
def client(app: Application) -> Iterator[Client]:
    with start_client(app) as client:
        yield client


def test_pages_have_all_surfaces_once_in_order(client: Client, app: Application) -> None:
    ids = [client.post("/v1/surfaces", surface(n), HEADERS).json()["id"] for n in range(25)]
    url, listed, pages = "/v1/stored?limit=10", list[Any](), 0
    while url:
        response = client.get(url, HEADERS)
        assert response.headers["cache-control"] == "no-store"
        page = StoredList.model_validate_json(response.content)
        listed += page.surfaces
        pages += 1
        url = response.json()["links"].get("next", "")
    assert pages == 3
    assert [entry.id for entry in listed] == sorted(ids)
    for entry in listed:
        content = client.get(f"/v1/surfaces/{entry.id}").json()
        assert content["surface"]["control_net"]
        assert 0 < entry.bytes < 1000
        assert re.fullmatch(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", entry.time)
    assert client.get(f"/v1/stored?after={max(ids)}", HEADERS).json() == {
        "surfaces": [],
        "links": {},
    }
    # The list reads no surface: one operation for each page, and one for the request above.
    assert app.state.services.store.operations.totals["list", "done"].count == pages + 1


def test_a_deleted_surface_and_foreign_objects_are_not_listed(tmp_path: Path) -> None:
    settings = Settings(store=str(tmp_path), api_keys=(LINE,), allow_delete=True)
    with start_client(create_app(settings)) as client:
        stored = client.post("/v1/surfaces", surface(1), HEADERS).json()
        for name in ("notes.txt", "ab/" + "0" * 64, "00/" + "z" * 64):
            (tmp_path / "surfaces" / name).parent.mkdir(exist_ok=True)
            (tmp_path / "surfaces" / name).write_text("x", encoding="utf-8")
        listed = client.get("/v1/stored", HEADERS).json()["surfaces"]
        assert [entry["id"] for entry in listed] == [stored["id"]]
        assert client.request("DELETE", stored["links"]["self"], headers=HEADERS).status_code == 204
        assert client.get("/v1/stored", HEADERS).json()["surfaces"] == []


def test_without_keys_the_list_does_not_exist() -> None:
    """Who knows an id may read its surface, so a list is for operators only."""
    with start_client(create_app(Settings())) as client:
        assert client.get("/v1/stored").status_code == 404
        assert "/v1/stored" not in client.get("/openapi.json").json()["paths"]


@pytest.mark.parametrize("path", ["/v1/stored", "/v1/stored?limit=1", "/v1/stored%0A"])
def test_the_list_needs_a_key_with_the_scope_admin(path: str) -> None:
    other_key = make_key()
    settings = Settings(api_keys=(LINE, format_entry("other", other_key)))
    with start_client(create_app(settings)) as client:
        for method in ("GET", "HEAD"):
            assert client.request(method, path).status_code == 401
            response = client.request(
                method, path, headers={"Authorization": f"Bearer {other_key}"}
            )
            assert response.status_code == 403
        response = client.get(path, {"Authorization": f"Bearer {other_key}"})
        assert response.json()["errors"][0]["needed"] == "a key with the scope admin"


@pytest.mark.parametrize(
    ("query", "parameter"),
    [
        *(
            ("limit=0", "limit"),
            ("limit=1001", "limit"),
            ("limit=-1", "limit"),
            ("limit=", "limit"),
        ),
        *(("limit=1.5", "limit"), ("limit=²", "limit"), ("limit=99999", "limit")),
        *(("after=x", "after"), ("after=", "after"), ("after=" + "A" * 64, "after")),
        ("before=x", "before"),
    ],
)
def test_invalid_parameters_are_refused(query: str, parameter: str) -> None:
    with start_client(create_app(Settings(api_keys=(LINE,)))) as client:
        response = client.get(f"/v1/stored?{query}", HEADERS)
        assert response.status_code == 422
        assert response.json()["errors"][0]["parameter"] == parameter
