"""The compact options `quantize` and `compression` over HTTP: glTF has them, other formats not."""

import pytest

from oracles.gltf import read_glb
from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from tools.client import Client

SADDLE = "/v1/surfaces/saddle/mesh"
QUERY = "quantize=true&compression=meshopt"


def test_meshes_by_url_and_by_body_are_equal(client: Client) -> None:
    options, encode_options = (
        MeshOptions((5, 5)),
        EncodeOptions(quantize=True, compression="meshopt"),
    )
    expected = render(find("saddle").surface(), options, BY_NAME["glb"], encode_options)
    by_url = client.get(f"{SADDLE}.glb?resolution=5&{QUERY}", {"Accept-Encoding": "identity"})
    assert by_url.content == expected
    surface = client.get("/v1/surfaces/saddle").json()["surface"]
    body = {"surface": surface, "resolution": 5, "quantize": True, "compression": "meshopt"}
    by_body = client.post("/v1/mesh?format=glb", body)
    assert by_body.content == expected
    bound = read_glb(expected).document["asset"]["extras"]["report"]["deviation_bound"]
    plain_bound = client.get(f"{SADDLE}.glb?resolution=5").headers["surface-deviation-bound"]
    # The bound includes the rounding, so it differs from the bound of the plain file.
    for response in (by_url, by_body):
        assert response.headers["surface-deviation-bound"] == repr(bound) != plain_bound


@pytest.mark.parametrize("option", ["quantize=true", "compression=meshopt"])
def test_other_formats_refuse_compact_options_by_url(client: Client, option: str) -> None:
    # A cached mesh without the option must not hide the error.
    assert client.get(f"{SADDLE}.stl?resolution=2").status_code == 200
    response = client.get(f"{SADDLE}.stl?resolution=2&{option}")
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert error["code"] == "unsupported_by_format"
    assert error["parameter"] == option.partition("=")[0]


def test_formats_list_their_compact_options(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def list_compact_options() -> dict[str, tuple[bool, list[str]]]:
        formats = client.get("/v1/formats").json()["formats"]
        return {each["name"]: (each["quantize"], each["compression"]) for each in formats}

    options_of_others: dict[str, tuple[bool, list[str]]] = {
        fmt.name: (False, []) for fmt in FORMATS if not fmt.compact
    }
    monkeypatch.setattr(meshopt, "is_available", lambda: True)
    options_of_gltf = {"glb": (True, ["meshopt"]), "gltf": (True, ["meshopt"])}
    assert list_compact_options() == options_of_gltf | options_of_others
    monkeypatch.setattr(meshopt, "is_available", lambda: False)
    assert list_compact_options() == {"glb": (True, []), "gltf": (True, [])} | options_of_others
