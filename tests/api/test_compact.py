"""Compact glTF over HTTP, by URL and by body; other formats refuse it."""

import pytest

from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples import find
from tests.api.client import Client
from tests.encoders.gltf.reader import read_glb

SADDLE = "/v1/surfaces/saddle/mesh"
BOTH = "quantize=true&compression=meshopt"


def test_by_url_and_by_body(client: Client) -> None:
    options, encode = MeshOptions((5, 5)), EncodeOptions(None, True, "meshopt")
    expected = render(find("saddle").surface(), options, BY_NAME["glb"], encode)
    actual = client.get(f"{SADDLE}.glb?resolution=5&{BOTH}", {"Accept-Encoding": "identity"})
    assert actual.content == expected
    surface = client.get("/v1/surfaces/saddle").json()["surface"]
    body = {"surface": surface, "resolution": 5, "quantize": True, "compression": "meshopt"}
    posted = client.post("/v1/mesh?format=glb", body)
    assert posted.content == expected
    bound = read_glb(expected).document["asset"]["extras"]["report"]["deviation_bound"]
    plain = client.get(f"{SADDLE}.glb?resolution=5").headers["surface-deviation-bound"]
    for response in (actual, posted):
        assert response.headers["surface-deviation-bound"] == repr(bound) != plain


@pytest.mark.parametrize("option", ["quantize=true", "compression=meshopt"])
def test_other_formats_refuse_it_by_url_too(client: Client, option: str) -> None:
    # Also after the mesh without the option was cached.
    assert client.get(f"{SADDLE}.stl?resolution=2").status_code == 200
    response = client.get(f"{SADDLE}.stl?resolution=2&{option}")
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert error["code"] == "unsupported_by_format"
    assert error["parameter"] == option.partition("=")[0]


def test_formats_list_their_compact_options(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def list_compact() -> dict[str, tuple[bool, list[str]]]:
        formats = client.get("/v1/formats").json()["formats"]
        return {each["name"]: (each["quantize"], each["compression"]) for each in formats}

    nothing: dict[str, tuple[bool, list[str]]] = {
        fmt.name: (False, []) for fmt in FORMATS if not fmt.compact
    }
    monkeypatch.setattr(meshopt, "is_available", lambda: True)
    assert list_compact() == {"glb": (True, ["meshopt"]), "gltf": (True, ["meshopt"])} | nothing
    monkeypatch.setattr(meshopt, "is_available", lambda: False)
    assert list_compact() == {"glb": (True, []), "gltf": (True, [])} | nothing
