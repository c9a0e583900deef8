"""POST /v1/convert with a format of definitions: STEP, IGES and VTU in place of JSON."""

from typing import Any

import pytest

from oracles.solids import read_solid
from service.api.app import create_app
from service.encoders.cad.registry import DEFINITION_FORMATS, DEFINITIONS_BY_NAME
from service.settings.values import Settings
from tests.encoders.cad import iges_file, part21
from tests.forms import SURFACES
from tools.client import Client, start_client

BEGINS = {"step": b"ISO-10303-21;\n", "iges": b" " * 72, "vtu": b'<?xml version="1.0"?>\n'}


def has_sweeps(surface: dict[str, Any]) -> bool:
    members = surface.get("members", [{"surface": surface}])
    return any(member["surface"].get("type") in ("tube", "ribbon") for member in members)


@pytest.mark.parametrize("kind", sorted(SURFACES))
@pytest.mark.parametrize("name", DEFINITIONS_BY_NAME)
def test_every_kind_of_surface_is_written_or_refused_with_advice(
    client: Client, name: str, kind: str
) -> None:
    response = client.post(f"/v1/convert?format={name}", {"surface": SURFACES[kind]})
    if has_sweeps(SURFACES[kind]):
        (error,) = response.json()["errors"]
        assert (error["code"], error["pointer"]) == ("not_parametric", "/surface")
        assert "POST /v1/mesh" in error["needed"]
        return
    if response.status_code != 200:
        (error,) = response.json()["errors"]
        assert (name, error["code"], error["pointer"]) == (
            "vtu",
            "unsupported_by_format",
            "/format",
        )
        assert "untrim" in error["needed"]
        return
    assert response.content.startswith(BEGINS[name])
    fmt = DEFINITIONS_BY_NAME[name]
    assert response.headers["content-type"] == fmt.media_type
    assert f".{fmt.suffix}" in response.headers["content-disposition"]
    assert response.headers["surface-writing"].startswith("faces=")


@pytest.mark.parametrize("fmt", DEFINITION_FORMATS, ids=lambda fmt: fmt.name)
def test_accept_chooses_the_format(client: Client, fmt: Any) -> None:
    document = {"surface": SURFACES["bezier"]}
    response = client.post("/v1/convert", document, headers={"accept": fmt.media_type})
    assert response.headers["content-type"] == fmt.media_type
    assert response.content == client.post(f"/v1/convert?format={fmt.name}", document).content
    json = client.post("/v1/convert?format=json", document)
    assert json.content == client.post("/v1/convert", document).content
    assert json.headers["content-type"] == "application/json"
    refused = client.post("/v1/convert", document, headers={"accept": "model/gltf-binary"})
    assert refused.status_code == 406


def test_operations_come_first(client: Client) -> None:
    box = read_solid("box")
    operations = [{"op": "select", "faces": [0, 2]}]
    document = {"surface": box, "operations": operations}
    response = client.post("/v1/convert?format=step", document)
    records = part21.read(response.content)
    assert len(part21.find(records, "ADVANCED_FACE")) == 2
    assert len(part21.find(records, "OPEN_SHELL")) == 1
    whole = document | {"operations": [{"op": "untrim", "face": 0}]}
    assert client.post("/v1/convert?format=vtu", whole).status_code == 200
    cut = [*whole["operations"], {"op": "split", "u": 0.5}]
    response = client.post("/v1/convert?format=vtu", document | {"operations": cut})
    assert b'NumberOfCells="2"' in response.content


def test_the_header_tells_what_the_file_has(client: Client) -> None:
    box = read_solid("box")
    group: dict[str, Any] = {"type": "group", "members": [{"surface": box}, {"surface": box}]}
    response = client.post("/v1/convert?format=step", {"surface": group})
    assert response.headers["surface-writing"] == (
        "faces=6; definitions=1; instances=2; metres_per_unit=0.001; unit=assumed"
    )
    group["metres_per_unit"] = 0.0254
    response = client.post("/v1/convert?format=iges", {"surface": group})
    assert response.headers["surface-writing"] == (
        "faces=6; definitions=1; instances=2; metres_per_unit=0.0254"
    )
    assert iges_file.read(response.content)[0][13:15] == ["1", "IN"]
    vtu = client.post("/v1/convert?format=vtu", {"surface": SURFACES["bezier"]})
    assert vtu.headers["surface-writing"] == "faces=1; definitions=1; instances=1"


def test_a_step_file_becomes_an_iges_file(client: Client) -> None:
    """Files are bodies, too."""
    step = client.post("/v1/convert?format=step", {"surface": read_solid("bolt")}).content
    headers = {"Content-Type": "model/step"}
    response = client.request("POST", "/v1/convert?format=iges", step, headers)
    assert response.status_code == 200, response.text
    _, entities = iges_file.read(response.content)
    assert sum(entity.kind == 144 for entity in entities.values()) == 12
    assert "faces=12" in response.headers["surface-reading"]
    assert "metres_per_unit=0.001" in response.headers["surface-writing"]


@pytest.mark.parametrize("name", ["step", "iges", "vtu"])
def test_files_beyond_the_limit_are_refused(name: str) -> None:
    with start_client(create_app(Settings(max_response_bytes=2048))) as client:
        response = client.post(
            f"/v1/convert?format={name}", {"surface": SURFACES["patches and triangles"]}
        )
        assert response.status_code == 422
        (error,) = response.json()["errors"]
        assert (error["code"], error["pointer"]) == ("too_many_bytes", "/surface")
