"""Files of control points give the same responses as the same surface in JSON."""

from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.api.app import create_app
from service.api.body import is_long_body
from service.decoders.registry import BY_NAME
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from service.surface.patches import PatchSurface
from tests.decoders.test_npy import damaged_files
from tools.client import Client, start_client
from tools.hostile.files import (
    GEOMDL,
    GEOMDL_SQUARE,
    NPY,
    OBJ,
    OOGL,
    TEAPOT,
    build_net,
    save_array,
)

WAVE = np.stack(
    (*np.meshgrid(np.arange(12.0), np.arange(9.0), indexing="ij"), np.zeros((12, 9))), axis=-1
)
WAVE[..., 2] = np.sin(WAVE[..., 0]) * np.cos(WAVE[..., 1])


def post_file(client: Client, content: bytes, media_type: str, query: str = "") -> httpx.Response:
    """The response to a request for the mesh of a file."""
    return client.request("POST", f"/v1/mesh?{query}", content, {"Content-Type": media_type})


def add_weights(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """The control points (…, 3) with different weights, (…, 4)."""
    weights = 1 + np.indices(array.shape[:-1]).sum(axis=0) % 3 / 4
    return np.concatenate((array, weights[..., None]), axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("query", "fields", "options"),
    [
        ("", {}, {}),
        ("type=bezier&name=wave&up=z", {"name": "wave", "up": "z"}, {}),
        ("type=bspline", {"type": "bspline"}, {}),
        ("type=bspline&degree=2&knots=uniform", {"type": "bspline", "degree": 2,
         "knots": "uniform"}, {}),
        ("type=bspline&degree=3,2&knots=clamped,periodic&resolution=2,3&weld=false",
         {"type": "bspline", "degree": [3, 2], "knots": ["clamped", "periodic"]},
         {"resolution": [2, 3], "weld": False}),
        ("type=bspline&degree=3&degree=2&knots=clamped&knots=periodic&resolution=2&resolution=3",
         {"type": "bspline", "degree": [3, 2], "knots": ["clamped", "periodic"]},
         {"resolution": [2, 3]}),
        ("type=bspline&relative_tolerance=0.01", {"type": "bspline"},
         {"relative_tolerance": 0.01}),
        ("overlays=control_net,boundary&isocurves=3&uvs=true", {},
         {"overlays": ["control_net", "boundary"], "isocurves": 3, "uvs": True}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("rational", [False, True])
def test_meshes_of_an_array_and_of_json_lists_are_equal(
    client: Client, query: str, fields: dict[str, Any], options: dict[str, Any], rational: bool
) -> None:
    array = add_weights(WAVE) if rational else WAVE
    surface = {"control_net": WAVE.tolist()} | fields
    if rational:
        surface["weights"] = array[..., 3].tolist()
    expected = client.post("/v1/mesh?format=glb", {"surface": surface} | options)
    assert expected.status_code == 200
    for order in (np.ascontiguousarray, np.asfortranarray):
        response = post_file(client, save_array(order(array)), NPY, f"format=glb&{query}")
        assert response.content == expected.content


HALF_TUBE = np.array([[[1, 0, z, 1], [0, 1, 0, 0], [-1, 0, z, 1]] for z in (0, 2)], float)


@pytest.mark.parametrize("query", ["", "type=bspline&degree=1,2"])
@pytest.mark.parametrize("dtype", ["<f4", ">f8"])
def test_homogeneous_points_of_an_array_and_of_json_lists_are_equal(
    client: Client, query: str, dtype: str
) -> None:
    fields = {"type": "bspline", "degree": [1, 2]} if query else {}
    response = post_file(
        client, save_array(HALF_TUBE.astype(dtype)), NPY, f"{query}&homogeneous=true"
    )
    surface = {"homogeneous": True, "control_net": HALF_TUBE.tolist()} | fields
    assert response.status_code == 200, response.text
    assert response.json() == client.post("/v1/mesh", {"surface": surface}).json()
    several = post_file(client, save_array(HALF_TUBE[np.newaxis]), NPY, "homogeneous=true")
    assert several.status_code == 200
    weights = post_file(client, save_array(HALF_TUBE), NPY, f"{query}&homogeneous=false")
    assert weights.json()["vertices"] != response.json()["vertices"]


@pytest.mark.parametrize(
    ("content", "media_type", "query", "code"),
    [
        (save_array(HALF_TUBE), NPY, "homogeneous=1", "wrong_type"),
        (save_array(HALF_TUBE[..., :3]), NPY, "homogeneous=true", "wrong_dimension"),
        (b"BEZ113 0 0 0 1 0 0 0 1 0 1 1 0", OOGL, "homogeneous=true", "unknown_field"),
    ],
)
def test_homogeneous_is_refused_beside_other_files(
    client: Client, content: bytes, media_type: str, query: str, code: str
) -> None:
    response = post_file(client, content, media_type, query)
    assert response.status_code in (400, 422)
    assert response.json()["errors"][0]["code"] == code


def test_answers_are_points_and_positive_weights(client: Client) -> None:
    """Stored, converted and written as OOGL, the surface has points and weights."""
    surface = {"homogeneous": True, "control_net": HALF_TUBE.tolist()}
    stored = client.post("/v1/surfaces", {"surface": surface})
    answer = client.get(stored.headers["location"]).json()["surface"]
    assert "homogeneous" not in answer
    assert np.shape(answer["control_net"]) == (2, 4, 3)
    assert np.array(answer["weights"]).min() > 0
    assert client.post("/v1/surfaces", {"surface": answer}).json()["id"] == stored.json()["id"]
    operations = [{"op": "split", "v": 0.5}]
    halves = [
        client.post("/v1/convert", {"surface": each, "operations": operations}).json()
        for each in (surface, answer)
    ]
    assert halves[0] == halves[1]
    points = [
        client.post("/v1/points", {"surface": each, "uv": [[0.25, 0.5], [1, 0.125]]}).json()
        for each in (surface, answer)
    ]
    assert points[0] == points[1]
    written = client.post("/v1/mesh?format=oogl", {"surface": surface, "oogl": "bez"})
    again = post_file(client, written.content, OOGL, "tolerance=0.001")
    assert again.status_code == 200
    positions = np.array(again.json()["vertices"])
    assert np.hypot(positions[:, 0], positions[:, 1]) == pytest.approx(1, abs=1e-12)


def test_patches_of_an_array_with_equal_points_are_welded(client: Client) -> None:
    """An array repeats shared vertices for each patch; the mesh is closed all the same."""
    teapot = find("utah-teapot").surface()
    assert isinstance(teapot, PatchSurface)
    array = teapot.vertices[teapot.patches]
    mesh_by_name = client.get("/v1/surfaces/utah-teapot/mesh.json?resolution=4").json()
    mesh_of_array = post_file(client, save_array(array), NPY, "resolution=4").json()
    for name in ("vertices", "triangles", "boundary_edges", "poles_repaired", "watertight"):
        assert mesh_of_array["report"][name] == mesh_by_name["report"][name], name
    np.testing.assert_array_equal(mesh_of_array["vertices"], mesh_by_name["vertices"])


def test_arrays_of_any_precision_and_byte_order_give_equal_meshes(client: Client) -> None:
    array = WAVE.astype(np.float32)
    expected = client.post("/v1/mesh", {"surface": {"control_net": array.tolist()}})
    for dtype in ("<f4", ">f4", ">f8"):
        assert post_file(client, save_array(array.astype(dtype)), NPY).content == expected.content


def test_meshes_of_a_text_and_of_json_are_equal(client: Client) -> None:
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 1], [1, 1, 0]]]
    expected = client.post("/v1/mesh", {"surface": {"control_net": net}}).json()
    # In OOGL the points along u are adjacent; in JSON and in the teapot, those along v.
    oogl = b"{ = BEZ113 # one patch\n0 0 0  1 0 1\n0 1 0  1 1 0\n}"
    teapot = b"1\n1 2 3 4\n4\n0 0 0\n0 1 0\n1 0 1\n1 1 0\n"
    obj = (
        b"v 0 0 0\nv 1 0 1\nv 0 1 0\nv 1 1 0\ncstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\n"
        b"parm u 0 1\nparm v 0 1\nend\n"
    )
    geomdl = GEOMDL_SQUARE.replace(b"[1, 0, 0]", b"[1, 0, 1]")
    for content, media_type in (
        (oogl, OOGL),
        (teapot, f"{TEAPOT}; charset=utf-8"),
        (obj, OBJ),
        (geomdl, GEOMDL),
    ):
        mesh = post_file(client, content, media_type).json()
        for name in ("vertices", "faces", "normals"):
            assert mesh[name] == expected[name]


def test_a_list_of_patches_takes_the_parameter_up_and_refuses_knots(client: Client) -> None:
    """The group and its members get the same `up`, so no member is turned."""
    text = b"LIST { BEZ113 0 0 0 1 0 0 0 1 2 1 1 2 } { BEZ213 0 0 0 1 0 0 2 0 0 0 1 2 1 1 2 2 1 2 }"
    for up in ("y", "z"):
        report = post_file(client, text, OOGL, f"resolution=1&up={up}&name=both").json()["report"]
        assert report["bounds"] == {"min": [0, 0, 0], "max": [2, 1, 2]}
        assert len(report["parts"]) == 2
    response = post_file(client, text, OOGL, "knots=uniform")
    assert response.json()["errors"][0]["parameter"] == "knots"


def test_the_file_name_of_the_response_is_the_name_of_the_surface(client: Client) -> None:
    response = post_file(client, save_array(build_net()), NPY, "format=stl&name=sail")
    assert "sail.stl" in response.headers["content-disposition"]


def test_estimates_of_a_file_and_of_json_are_equal(client: Client) -> None:
    response = client.request(
        "POST",
        "/v1/estimate?resolution=2,3&format=glb",
        save_array(build_net()),
        {"Content-Type": NPY},
    )
    expected = client.post(
        "/v1/estimate?format=glb",
        {"surface": {"control_net": build_net().tolist()}, "resolution": [2, 3]},
    )
    assert response.json() == expected.json()


def test_a_file_and_json_of_one_surface_are_stored_under_one_id(client: Client) -> None:
    array = add_weights(WAVE)
    fields = {"type": "bspline", "degree": [3, 2], "knots": ["clamped", "periodic"], "up": "z"}
    surface = fields | {"control_net": WAVE.tolist(), "weights": array[..., 3].tolist()}
    query = "type=bspline&degree=3,2&knots=clamped,periodic&up=z"
    headers = {"Content-Type": NPY}
    response_to_file = client.request("POST", f"/v1/surfaces?{query}", save_array(array), headers)
    response_to_json = client.post("/v1/surfaces", {"surface": surface})
    assert (response_to_file.status_code, response_to_json.status_code) == (201, 200)
    assert response_to_file.json() == response_to_json.json()
    response_with_other_name = client.request(
        "POST", f"/v1/surfaces?{query}&name=other", save_array(array), headers
    )
    assert response_with_other_name.json()["id"] != response_to_file.json()["id"]
    document = client.get(response_to_file.json()["links"]["self"]).json()
    mesh = client.post("/v1/mesh?format=glb", document)
    assert mesh.content == post_file(client, save_array(array), NPY, f"{query}&format=glb").content


def test_options_of_a_mesh_are_refused_when_a_file_is_stored(client: Client) -> None:
    for name in ("resolution", "format"):
        response = client.request(
            "POST", f"/v1/surfaces?{name}=2", save_array(build_net()), {"Content-Type": NPY}
        )
        assert response.status_code == 422
        error = response.json()["errors"][0]
        assert (error["code"], error["parameter"]) == ("unknown_field", name)


def test_long_bodies_are_read_by_a_worker_thread() -> None:
    """The limits: 256 KiB of an array, 16 KiB of a text, and 32 objects in a JSON body."""
    npy, oogl = BY_NAME["npy"], BY_NAME["oogl"]
    assert [is_long_body(b"{" * (1 << 18) + last_byte, npy) for last_byte in (b"", b"{")] == [
        False,
        True,
    ]
    assert [is_long_body(b" " * (1 << 14) + last_byte, oogl) for last_byte in (b"", b" ")] == [
        False,
        True,
    ]
    assert [is_long_body(b"{" * size, None) for size in (32, 33)] == [False, True]


TEXTS = {
    OOGL: b"LIST { = BEZ 2 1 4 0 0 0 1 1 0 0 1 2 0 0 1 0 1 0 1 1 1 0 2 2 1 0 1 } {CBEZ113_ST "
    b"0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 0 0 1 1 1 1 0 0 1 0 1 0 1 0 0 1 1 1 1 1 1}",
    TEAPOT: b"2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n",
}


@st.composite
def damaged_texts(draw: st.DrawFn) -> tuple[bytes, str]:
    """A text of OOGL or of the teapot with some words inserted or removed, and its media type."""
    media_type = draw(st.sampled_from(sorted(TEXTS)))
    words = TEXTS[media_type].replace(b"\n", b" \n ").split(b" ")
    new_words = (b"{", b"}", b"1e308", b"-1", b"0", b"1e-308", b"nan", b"\n", b"BBP", b"7")
    for _ in range(draw(st.integers(1, 3))):
        position = draw(st.integers(0, len(words)))
        words_to_insert = draw(st.lists(st.sampled_from(new_words), max_size=2))
        words[position : position + draw(st.integers(0, 2))] = words_to_insert
    return b" ".join(words), media_type


@given(st.one_of(damaged_texts(), damaged_files().map(lambda content: (content, NPY))))
def test_damaged_files_cause_no_internal_errors(client: Client, file: tuple[bytes, str]) -> None:
    response = post_file(client, *file, "resolution=1&format=glb")
    assert response.status_code in (200, 400, 422)


def test_limits_of_the_settings_apply_to_files() -> None:
    limited_settings = Settings(max_control_points=8, max_degree=1, max_body_bytes=1024)
    patch = b"0 0 0 1 0 0 0 1 0 1 1 0 "
    with start_client(create_app(limited_settings)) as client:
        for content, media_type, code in (
            (save_array(build_net(3, 2)), NPY, "degree_too_high"),
            (save_array(build_net(3, 3)), NPY, "too_many_control_points"),
            (save_array(build_net(2, 2)), NPY, None),
            (save_array(build_net(9, 9)), NPY, "body_too_large"),
            (b"BEZ113 " + patch * 2, OOGL, None),
            (b"BEZ113 " + patch * 3, OOGL, "too_many_control_points"),
            (b"BEZ213 0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0", OOGL, "degree_too_high"),
            (b"1\n" + b"1 " * 9 + b"\n1\n0 0 0", TEAPOT, "too_many_control_points"),
        ):
            response = post_file(client, content, media_type)
            if code is None:
                assert response.status_code == 200
            else:
                assert response.json()["errors"][0]["code"] == code


@pytest.mark.parametrize("path", ["/v1/points", "/v1/curve"])
def test_other_calls_accept_json_only(client: Client, path: str) -> None:
    response = client.request("POST", path, save_array(build_net()), {"Content-Type": NPY})
    assert response.status_code == 415
    assert response.json()["errors"][0]["needed"] == "application/json; texts in UTF-8"


def test_other_media_types_and_charsets_are_refused(client: Client) -> None:
    response = post_file(client, b"", "application/octet-stream")
    assert response.status_code == 415
    for media_type in ("application/json", NPY, OOGL, TEAPOT):
        assert media_type in response.json()["errors"][0]["needed"]
    # Only texts have a charset; for an array the parameter has no effect.
    assert post_file(client, b"BBP", f"{OOGL}; charset=utf-16").status_code == 415
    assert post_file(client, save_array(build_net()), f"{NPY}; charset=binary").status_code == 200
