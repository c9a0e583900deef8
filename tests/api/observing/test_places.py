"""Paths: few routes, and nothing that a client made up."""

import pytest

from service.api.app import create_app
from service.api.observing import places
from service.api.observing.places import NOWHERE, Place, Places

HASH = "0123456789abcdef" * 4
MESH = "/v1/surfaces/{id}/mesh.{suffix}"


@pytest.fixture(scope="module")
def found() -> Places:
    return Places(create_app().routes)


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("/v1/mesh", Place("/v1/mesh", "/v1/mesh")),
        (f"/v1/surfaces/{HASH}", Place("/v1/surfaces/{id}", f"/v1/surfaces/{HASH}", HASH)),
        (
            "/v1/surfaces/saddle/mesh.glb",
            Place(MESH, "/v1/surfaces/saddle/mesh.glb", "saddle", "glb"),
        ),
        ("/v1/surfaces/secret/mesh.glb", Place(MESH, "/v1/surfaces/{id}/mesh.glb", "", "glb")),
        (f"/v1/surfaces/{HASH.upper()}/mesh.exe", Place(MESH, MESH)),
        ("/v1/surfaces/a\nb", Place("/v1/surfaces/{id}", "/v1/surfaces/{id}")),
        ("/v1/surfaces/", NOWHERE),
        ("/v1/mesh/", NOWHERE),
        ("/etc/passwd", NOWHERE),
        ("", NOWHERE),
    ],
)
def test_what_a_path_stands_for(found: Places, path: str, place: Place) -> None:
    assert found.at(path) == found.at(path) == place


def test_what_is_remembered_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(places, "REMEMBERED", 3)
    found = Places(create_app().routes)
    for number in range(10):
        assert found.at(f"/v1/surfaces/{number}").route == "/v1/surfaces/{id}"
        assert len(found._remembered) <= 3
    found.at("/v1/surfaces/" + "a" * 500)
    found.at("/nowhere")
    assert not {"/nowhere", "/v1/surfaces/" + "a" * 500} & found._remembered.keys()
