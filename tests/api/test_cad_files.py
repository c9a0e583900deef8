"""CAD files as bodies: results equal those of the document that they become, with a report."""

import re
from typing import Any

import httpx
import pytest

from service.api.app import create_app
from service.decoders.registry import BY_NAME, CAD_DECODERS
from service.settings.values import Settings
from tests.cad import ASSEMBLY, FOLDER, IFC, IGES, OPEN_TETRAHEDRON, STEP, TETRAHEDRON
from tools.client import Client, start_client

FILES = sorted(FOLDER.glob("*.step"))


def post(
    client: Client, path: str, content: bytes = TETRAHEDRON, media_type: str = STEP
) -> httpx.Response:
    return client.request("POST", path, content, {"Content-Type": media_type})


def first_error(response: httpx.Response) -> dict[str, Any]:
    error: dict[str, Any] = response.json()["errors"][0]
    return error


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_file_is_the_document_that_convert_returns(client: Client, path: Any) -> None:
    """The document, sent as it is with its report, gives the same bytes, and the same id."""
    content = path.read_bytes()
    document = post(client, "/v1/convert", content).json()
    reading = document["reading"]
    assert reading["format"] == "step"
    query = "format=glb&relative_tolerance=0.01"
    mesh = post(client, f"/v1/mesh?{query}", content)
    assert mesh.status_code == 200
    assert mesh.headers["surface-reading"] == f"faces={reading['faces']}; skipped=0"
    sent = client.post("/v1/mesh?format=glb", document | {"relative_tolerance": 0.01})
    assert sent.content == mesh.content
    assert "surface-reading" not in sent.headers
    stored = post(client, "/v1/surfaces", content)
    assert stored.json()["reading"] == reading
    again = client.post("/v1/surfaces", document)
    assert (again.status_code, again.json()["id"]) == (200, stored.json()["id"])
    assert "reading" not in again.json()
    kept = client.get(stored.json()["links"]["self"]).json()
    assert kept == {"surface": document["surface"]}


def test_an_estimate_is_that_of_the_document(client: Client) -> None:
    document = post(client, "/v1/convert", ASSEMBLY).json()
    estimate = post(client, "/v1/estimate?tolerance=0.1", ASSEMBLY)
    assert estimate.json() == client.post("/v1/estimate", document | {"tolerance": 0.1}).json()
    assert re.fullmatch(r"faces=\d+; skipped=0", estimate.headers["surface-reading"])


def test_operations_stand_in_the_query(client: Client) -> None:
    query = 'operations=[{"op":"untrim","face":2}]'
    converted = post(client, f"/v1/convert?{query}")
    document = post(client, "/v1/convert").json()
    operations = [{"op": "untrim", "face": 2}]
    expected = client.post(
        "/v1/convert", {"surface": document["surface"], "operations": operations}
    )
    assert converted.json()["surface"] == expected.json()["surface"]
    assert converted.json()["reading"] == document["reading"]


def test_a_file_is_measured(client: Client) -> None:
    measures = post(client, "/v1/measure?tolerance=0.01").json()
    document = post(client, "/v1/convert").json()
    assert client.post("/v1/measure", document | {"tolerance": 0.01}).json() == measures
    assert measures["closed"]
    assert measures["volume"]["low"] > 0


def test_every_face_is_in_the_mesh_or_in_the_report(client: Client) -> None:
    response = post(client, "/v1/convert", OPEN_TETRAHEDRON)
    document = response.json()
    (skipped,) = document["reading"]["skipped_faces"]
    assert skipped["entity"] == "#57"
    assert skipped["reason"]
    assert document["reading"]["faces"] == len(document["surface"]["faces"]) == 3
    mesh = post(client, "/v1/mesh?format=glb", OPEN_TETRAHEDRON)
    assert mesh.headers["surface-reading"] == "faces=3; skipped=1"
    assert "surface-reading" in mesh.headers["access-control-expose-headers"].lower()


def test_fields_in_the_query_replace_those_of_the_file(client: Client) -> None:
    query = "name=wedge&up=y&invalid_faces=refuse"
    surface = post(client, f"/v1/convert?{query}").json()["surface"]
    assert (surface["name"], surface["up"], surface["invalid_faces"]) == ("wedge", "y", "refuse")
    group = post(client, f"/v1/convert?{query}", ASSEMBLY).json()["surface"]
    assert (group["type"], group["name"], group["up"]) == ("group", "wedge", "y")
    for definition in group["definitions"]:
        assert (definition["up"], definition["invalid_faces"]) == ("y", "refuse")
        assert definition["name"] != "wedge"
    unchanged = post(client, "/v1/convert", ASSEMBLY).json()["surface"]
    assert {each["invalid_faces"] for each in unchanged["definitions"]} == {"skip"}
    assert unchanged["up"] == "z"


@pytest.mark.parametrize(
    ("query", "code", "parameter"),
    [
        ("degree=3", "unknown_field", "degree"),
        ("knots=clamped", "unknown_field", "knots"),
        ("type=bezier", "unknown_field", "type"),
        ("invalid_faces=keep", "wrong_value", "invalid_faces"),
        ("up=x", "wrong_value", "up"),
        ("name=", "wrong_length", "name"),
        ("tolerance=-1", "out_of_range", "tolerance"),
        ("colour=red", "unknown_field", "colour"),
        ("resolution=4", "not_parametric", "resolution"),
        ("operations=[]", "unknown_field", "operations"),
    ],
)
@pytest.mark.parametrize("content", [TETRAHEDRON, ASSEMBLY], ids=["part", "assembly"])
def test_wrong_parameters_are_named(
    client: Client, content: bytes, query: str, code: str, parameter: str
) -> None:
    response = post(client, f"/v1/mesh?{query}", content)
    assert response.status_code == 422
    errors = response.json()["errors"]
    assert [(each["code"], each.get("parameter")) for each in errors] == [(code, parameter)]


@pytest.mark.parametrize("query", ["operations=x", "operations={}", 'operations=[{"op":"paint"}]'])
def test_wrong_operations_are_named(client: Client, query: str) -> None:
    response = post(client, f"/v1/convert?{query}")
    assert response.status_code == 422
    assert first_error(response)["parameter"] == "operations"


REFUSED = [
    ("model/brep", b"DBRep_DrawableShape", "Open CASCADE (BREP)", "STEP"),
    ("application/p21+ifc", IFC, "IFC", "STEP"),
    ("model/vnd.parasolid.transmit.text", b"", "Parasolid", "STEP"),
    ("application/sat", b"", "ACIS", "STEP"),
    (STEP, IFC, "IFC", "STEP"),
    (IGES, TETRAHEDRON, "STEP", "model/step"),
    (STEP, b"DBRep_DrawableShape", "BREP", "STEP"),
    ("application/octet-stream", TETRAHEDRON, "another type", "model/step, model/iges"),
    ("", TETRAHEDRON, "no type", "model/step, model/iges"),
]
"""Media types and files, and texts of the error: what it got and what it needed."""


@pytest.mark.parametrize("number", range(len(REFUSED)))
@pytest.mark.parametrize("path", ["/v1/mesh", "/v1/surfaces", "/v1/files"])
def test_other_formats_are_refused_by_name(client: Client, path: str, number: int) -> None:
    media_type, content, got, needed = REFUSED[number]
    response = post(client, path, content, media_type)
    assert response.status_code == 415
    error = first_error(response)
    assert error["header"] == "Content-Type"
    assert got in error["got"]
    assert needed in error["needed"]


def test_a_format_without_its_library_is_refused_with_the_extra(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(type(BY_NAME["3dm"]), "is_available", lambda each: not each.library)
    response = post(client, "/v1/mesh", b"3D Geometry File Format ", "model/vnd.3dm")
    error = first_error(response)
    assert (response.status_code, error["code"]) == (415, "format_unavailable")
    assert "surface-service[rhino]" in error["needed"]


@pytest.mark.parametrize("decoder", CAD_DECODERS, ids=lambda each: each.name)
def test_calls_with_a_stored_surface_read_no_cad_files(client: Client, decoder: Any) -> None:
    for path in ("/v1/points", "/v1/project", "/v1/intersect", "/v1/curve", "/v1/jobs"):
        assert post(client, path, TETRAHEDRON, decoder.media_type).status_code == 415


def test_damaged_files_are_refused(client: Client) -> None:
    for content in (b"", b"solid", TETRAHEDRON[:200], TETRAHEDRON.replace(b"PLANE", b"PLAIN")):
        response = post(client, "/v1/mesh", content)
        assert response.status_code in (400, 415, 422), content[:20]
        assert "pointer" in first_error(response)


def test_too_many_faces_for_one_request_are_work_for_a_job() -> None:
    with start_client(create_app(Settings(request_timeout=0.01))) as client:
        response = post(client, "/v1/mesh")
        error = first_error(response)
        assert (response.status_code, error["code"]) == (422, "too_costly")
        assert error["got"] == "4 faces"
        assert "Prefer: respond-async" in error["needed"]


def test_limits_of_files_name_their_setting() -> None:
    with start_client(create_app(Settings(max_faces=3))) as client:
        error = first_error(post(client, "/v1/convert"))
        assert error["code"] == "too_many_faces"
        assert "SURFACE_MAX_FACES" in error["needed"]
    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        response = post(client, "/v1/convert")
        assert (response.status_code, first_error(response)["code"]) == (413, "body_too_large")
        assert "SURFACE_MAX_BODY_BYTES" in first_error(response)["needed"]
