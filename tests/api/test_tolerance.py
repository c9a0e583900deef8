"""Meshes by tolerance over HTTP."""

from typing import Any

import httpx
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.responses import BOUND_HEADER
from service.schemas.accuracy import NAMES
from service.settings.values import Settings
from tests.api.client import Client, start_client

NET = [[[i, j, 0.3 * (i % 2) * (j % 3)] for j in range(4)] for i in range(4)]
WAVE = {"control_net": NET}
FLAT = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
CAMERA = {"position": [1, 1, 20], "field_of_view": 0.8, "height": 500}


def request_mesh(
    client: Client, fmt: str = "json", surface: Any = WAVE, **options: Any
) -> httpx.Response:
    return client.post(f"/v1/mesh?format={fmt}", {"surface": surface, **options})


def test_the_tolerance_holds_and_a_header_has_the_bound(client: Client) -> None:
    posted = request_mesh(client, "stl", tolerance=0.01)
    fetched = client.get("/v1/surfaces/utah-teapot/mesh.glb?tolerance=0.05")
    for response, tolerance in ((posted, 0.01), (fetched, 0.05)):
        assert response.status_code == 200
        assert 0 < float(response.headers[BOUND_HEADER]) <= tolerance


def test_bodies_and_queries_mean_the_same(client: Client) -> None:
    definition = client.get("/v1/surfaces/cone").json()
    for options, query in (
        ({"tolerance": 0.01}, "tolerance=1e-2"),
        ({"relative_tolerance": 0.01, "two_sided": True}, "relative_tolerance=0.01&two_sided=true"),
        (
            {"tolerance": 0.1, "angle_tolerance": 0.5, "max_triangles": 9999},
            "tolerance=0.1&angle_tolerance=0.5&max_triangles=9999",
        ),
    ):
        posted = client.post("/v1/mesh", {**definition, **options})
        fetched = client.get(f"/v1/surfaces/cone/mesh.json?{query}")
        assert posted.status_code == fetched.status_code == 200
        assert posted.content == fetched.content


TUBE = {"type": "tube", "curve": {"control_points": [[0, 0, 0], [1, 1, 0]]}, "radius": 1}


def test_queries_name_the_parameter(client: Client) -> None:
    for query, parameter in (
        ("tolerance=1e-30", "tolerance"),
        ("tolerance=0.1&resolution=3", "resolution"),
        ("camera=1", "camera"),
        ("two_sided=true", "tolerance"),
    ):
        response = client.get(f"/v1/surfaces/cone/mesh.json?{query}")
        assert response.status_code == 422
        assert [error["parameter"] for error in response.json()["errors"]] == [parameter]


def test_limits_hold_for_meshes_by_tolerance(client: Client) -> None:
    for limits in (Settings(max_vertices=100), Settings(max_response_bytes=20_000)):
        with start_client(create_app(limits)) as small:
            response = request_mesh(small, tolerance=2e-3)
            assert response.status_code == 422
            assert response.json()["code"] == "result_too_large"
            assert response.json()["errors"][0]["pointer"] == "/tolerance"
    assert request_mesh(client, tolerance=2e-3).status_code == 200


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-2, 2),
    st.sampled_from([2**53, 2**63, 10**18]),
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(1e-3, 10),
    st.text(max_size=3),
    st.just(CAMERA),
    st.dictionaries(
        st.sampled_from([*CAMERA, "up"]), st.floats(-10, 10) | st.none() | st.just([1, 2, 3])
    ),
    st.lists(st.floats(-1, 1), max_size=4),
)
OTHERS = {
    "resolution": st.just(3),
    "faces": st.sampled_from(["triangles", "quads", "none"]),
    "weld": st.booleans(),
    "curvatures": st.booleans(),
    "isocurves": st.just(2),
    "overlays": st.just(["control_net", "boundary"]),
    "method": st.sampled_from(["matrix", "de_casteljau"]),
}
BODIES = st.fixed_dictionaries(
    {"surface": st.sampled_from([FLAT, TUBE])}, optional=dict.fromkeys(NAMES, VALUES) | OTHERS
)


@given(body=BODIES, path=st.sampled_from(["/v1/mesh", "/v1/estimate"]))
def test_no_body_breaks_the_service(client: Client, body: dict[str, Any], path: str) -> None:
    response = client.post(path, body)
    assert response.status_code in {200, 422}
    if response.status_code == 422:
        for error in response.json()["errors"]:
            assert error["code"]
            assert error["detail"]
