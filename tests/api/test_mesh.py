"""POST /v1/mesh and GET of meshes of examples: formats, options, file names, and errors."""

import asyncio

import httpx
import numpy as np
import pytest

from service.api.app import create_app
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.settings.values import Settings
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from tools.client import Client

NET = [[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]
BEZIER = {"type": "bezier", "control_net": NET}
SURFACE = BezierSurface(np.array(NET, dtype=np.float64))


def test_the_mesh_of_a_control_net_is_json_by_default(client: Client) -> None:
    response = client.post("/v1/mesh", {"surface": BEZIER, "resolution": [2, 3]})
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/json"
    assert "content-disposition" not in response.headers
    mesh = response.json()
    assert len(mesh["vertices"]) == 3 * 4
    assert len(mesh["faces"]) == 2 * 2 * 3
    assert mesh["vertices"][0] == NET[0][0]
    assert mesh["vertices"][-1] == NET[-1][-1]


def test_the_type_may_be_left_out_and_one_resolution_is_for_both_directions(client: Client) -> None:
    response_to_short = client.post("/v1/mesh", {"surface": {"control_net": NET}, "resolution": 5})
    response_to_long = client.post("/v1/mesh", {"surface": BEZIER, "resolution": [5, 5]})
    assert response_to_short.content == response_to_long.content


@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_formats_by_name_by_media_type_and_by_suffix(client: Client, fmt: Format) -> None:
    document = {"surface": BEZIER, "resolution": 4}
    expected = render(SURFACE, MeshOptions((4, 4)), fmt)
    plain = {"Accept-Encoding": "identity"}
    by_name = client.post(f"/v1/mesh?format={fmt.name}", document, plain)
    by_media_type = client.post("/v1/mesh", document, {"Accept": fmt.media_type, **plain})
    assert by_name.content == by_media_type.content == expected
    url = f"/v1/surfaces/saddle/mesh.{fmt.suffix}?resolution=4"
    by_suffix = client.get(url, plain)
    assert by_suffix.content == render(find("saddle").surface(), MeshOptions((4, 4)), fmt)
    for response in (by_name, by_media_type, by_suffix):
        assert response.status_code == 200
        assert response.headers["content-type"].partition(";")[0] == fmt.media_type
        assert response.headers["content-length"] == str(len(response.content))
        assert response.headers["x-content-type-options"] == "nosniff"


def test_options_in_the_body_and_in_the_query_give_equal_meshes(client: Client) -> None:
    definition = client.get("/v1/surfaces/utah-teapot").json()
    options = {
        "resolution": [3, 2],
        "faces": "quads",
        "normals": False,
        "uvs": True,
        "curvatures": True,
        "weld": False,
        "crease_angle": 0.5,
        "method": "de_casteljau",
        "overlays": ["control_net", "boundary"],
        "isocurves": [2, 3],
        "wires": "lines",
        "wire_width": 0.5,
        "wire_sides": 5,
        "oogl": "off",
    }
    query = (
        "resolution=3,2&faces=quads&normals=false&uvs=true&curvatures=true&weld=false"
        "&crease_angle=0.5&method=de_casteljau"
        "&overlays=control_net,boundary&isocurves=2,3&wires=lines&wire_width=0.5&wire_sides=5"
        "&oogl=off"
    )
    for name in ("json", "oogl"):
        by_body = client.post(f"/v1/mesh?format={name}", {**definition, **options})
        by_url = client.get(f"/v1/surfaces/utah-teapot/mesh.{name}?{query}")
        assert by_body.status_code == by_url.status_code == 200
        assert by_body.content == by_url.content
    without_options = client.get("/v1/surfaces/utah-teapot/mesh.json?resolution=3,2")
    assert (
        without_options.content != client.get(f"/v1/surfaces/utah-teapot/mesh.json?{query}").content
    )


def test_without_weld_every_sample_is_a_vertex_in_the_documented_order(
    client: Client,
) -> None:
    """The surface has three bilinear patches; the last has a pole at u = 0."""
    vertices = [[x, y, 0] for x in range(3) for y in range(3)]
    surface = {
        "type": "patches",
        "vertices": vertices,
        "patches": [[[0, 1], [3, 4]], [[1, 2], [4, 5]], [[4, 4], [7, 8]]],
    }
    mesh = client.post("/v1/mesh", {"surface": surface, "resolution": [2, 4], "weld": False}).json()
    i, j = np.divmod(np.arange(3 * 5), 5)
    u, v = i / 2, j / 4
    expected = [np.column_stack((u, v, 0 * u)), np.column_stack((u, 1 + v, 0 * u))]
    expected.append(np.column_stack((1 + u, 1 + u * v, 0 * u)))
    np.testing.assert_allclose(mesh["vertices"], np.concatenate(expected), atol=1e-15)
    unused_vertices = set(range(3 * 15)) - {index for face in mesh["faces"] for index in face}
    # The third patch has the vertices 30 to 44; its first row, at the pole, has 30 to 34.
    assert unused_vertices
    assert unused_vertices < set(range(30, 35)), "only samples at the pole may be unused"


@pytest.mark.anyio
async def test_a_health_check_does_not_wait_for_earlier_requests() -> None:
    # The URLs differ, because meshes of equal URLs are computed only once.
    mesh = "/v1/surfaces/saddle/mesh.glb?resolution=8"
    meshes = [f"{mesh}&crease_angle=0.{number}" for number in range(1, 61)]
    finished: list[str] = []
    transport = httpx.ASGITransport(create_app(Settings()))
    async with httpx.AsyncClient(transport=transport, base_url="http://service") as client:

        async def send_request(url: str) -> None:
            assert (await client.get(url)).status_code == 200
            finished.append(url)

        await asyncio.gather(*map(send_request, [*meshes, "/health/live"]))
    # The health check is sent last; it would end last of 61 requests if it waited for the others.
    assert finished.index("/health/live") < 20


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("sail", 'filename="sail.stl"'),
        ("Main sail", 'filename="Main-sail.stl"'),
        ("Segel, groß", """filename="Segel-gro.stl"; filename*=UTF-8''Segel%2C%20gro%C3%9F.stl"""),
        ("帆", """filename="surface.stl"; filename*=UTF-8''%E5%B8%86.stl"""),
        ("../../etc/passwd", 'filename="etc-passwd.stl"'),
        ("../é/x", """filename="x.stl"; filename*=UTF-8''%C3%A9-x.stl"""),
        ('"; x="', 'filename="x.stl"'),
        ('"; é="', """filename="surface.stl"; filename*=UTF-8''%3B%20%C3%A9%3D.stl"""),
        (" ...", 'filename="surface.stl"'),
    ],
)
def test_file_names_have_only_harmless_characters(client: Client, name: str, files: str) -> None:
    document = {"surface": {**BEZIER, "name": name}, "resolution": 1}
    response = client.post("/v1/mesh?format=stl", document)
    assert response.headers["content-disposition"] == f"attachment; {files}"


@pytest.mark.parametrize(
    ("query", "parameter", "code"),
    [
        ("resolution=0", "resolution", "out_of_range"),
        ("resolution=4,0", "resolution", "out_of_range"),
        ("resolution=65537", "resolution", "out_of_range"),
        ("resolution=", "resolution", "wrong_type"),
        ("resolution=four", "resolution", "wrong_type"),
        ("resolution=4.0", "resolution", "wrong_type"),
        ("resolution=4,5,6", "resolution", "wrong_length"),
        ("resolution=4,", "resolution", "wrong_type"),
        ("resolution=9999", "resolution", "too_many_vertices"),
        ("resolution=4&resolution=5&resolution=6", "resolution", "wrong_length"),
        ("resolution=4,5&resolution=6", "resolution", "wrong_length"),
        ("resolution=4&resolution=", "resolution", "wrong_type"),
        ("overlays=boundary&overlays=boundary", "overlays", "repeated_value"),
        ("overlays=boundary&overlays=", "overlays", "wrong_value"),
        ("faces=quads&faces=quads", "faces", "repeated_key"),
        ("faces=squares", "faces", "wrong_value"),
        ("faces=quads", "faces", "unsupported_by_format"),
        ("normals=True", "normals", "wrong_type"),
        ("uvs=1", "uvs", "wrong_type"),
        ("weld=", "weld", "wrong_type"),
        ("crease_angle=nan", "crease_angle", "wrong_type"),
        ("crease_angle=inf", "crease_angle", "wrong_type"),
        ("crease_angle=-1", "crease_angle", "out_of_range"),
        ("crease_angle=1e999", "crease_angle", "out_of_range"),
        ("overlays=edges", "overlays", "wrong_value"),
        ("overlays=boundary,boundary", "overlays", "repeated_value"),
        ("oogl=", "oogl", "wrong_value"),
        ("quantize=", "quantize", "wrong_type"),
        ("compression=Meshopt", "compression", "wrong_value"),
        ("format=glb", "format", "unknown_field"),
        ("colour=red", "colour", "unknown_field"),
        ("surface=x", "surface", "unknown_field"),
        ("a/b~c=x", "a/b~c", "unknown_field"),
        # At most 50 parameters are read; a50 is the 51st.
        ("&".join(f"a{i}=1" for i in range(60)), "a50", "too_many_parameters"),
        ("k" * 300, "k" * 64 + "…", "unknown_field"),  # errors shorten long names
    ],
)
def test_errors_name_the_parameter(client: Client, query: str, parameter: str, code: str) -> None:
    response = client.get(f"/v1/surfaces/utah-teapot/mesh.glb?{query}")
    assert response.status_code == 422
    error = response.json()["errors"][0]
    assert (error["parameter"], error["code"]) == (parameter, code)
    assert "pointer" not in error


@pytest.mark.parametrize(
    ("query", "parameter", "code"),
    [
        ("format=fbx", "format", "unknown_format"),
        ("format=", "format", "unknown_format"),
        ("format=glb&format=glb", "format", "repeated_key"),
    ],
)
def test_invalid_formats_of_a_post_request_are_refused(
    client: Client, query: str, parameter: str, code: str
) -> None:
    response = client.post(f"/v1/mesh?{query}", {"surface": BEZIER})
    assert response.status_code == 422
    error = response.json()["errors"][0]
    assert (error["parameter"], error["code"]) == (parameter, code)


@pytest.mark.parametrize("suffix", ["fbx", "GLB", "glb.gz", "%00", "é"])
def test_unknown_suffixes_are_refused(client: Client, suffix: str) -> None:
    response = client.get(f"/v1/surfaces/saddle/mesh.{suffix}")
    assert response.status_code == 404
    assert response.json()["code"] == "unknown_suffix"
    assert "glb" in response.json()["errors"][0]["needed"]


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Content-Type": "text/plain"},
        {"Content-Type": "application/x-www-form-urlencoded"},
        {"Content-Type": "multipart/form-data; boundary=x"},
        {"Content-Type": "application/jsonp"},
        {"Content-Type": "application/json; charset=latin-1"},
        {"Content-Type": 'application/json; a="; charset=utf-8"; CHARSET=latin-1'},
        # The fuzzer found this header; the standard library's parser of mail headers fails on it.
        {"Content-Type": "text/plain;q*;q*0"},
        {"Content-Type": "application/json", "Content-Encoding": "gzip"},
    ],
)
def test_other_media_types_are_refused(client: Client, headers: dict[str, str]) -> None:
    response = client.request("POST", "/v1/mesh", b"{}", headers)
    assert response.status_code == 415
    assert response.json()["code"] == "unsupported_media_type"
    assert response.json()["errors"][0]["header"] in ("Content-Type", "Content-Encoding")


@pytest.mark.parametrize(
    "media_type",
    [
        "application/json",
        "Application/JSON",
        "application/json; charset=UTF-8",
        'application/json;charset="utf-8"',
        'application/json;a="\\"; charset=x"; charset=utf-8',
        "application/json;q*;q*0",
        "application/vnd.surface+json",
    ],
)
def test_all_media_types_of_json_are_accepted(client: Client, media_type: str) -> None:
    headers = {"Content-Type": media_type, "Content-Encoding": "identity"}
    body = b'{"surface":{"control_net":[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]]]},"resolution":1}'
    assert client.request("POST", "/v1/mesh", body, headers).status_code == 200
