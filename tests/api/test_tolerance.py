"""Meshes by tolerance over HTTP: bodies, queries, limits, and random requests."""

from typing import Any

import httpx
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.responses import BOUND_HEADER
from service.schemas.accuracy import ACCURACY_FIELDS
from service.settings.values import Settings
from tools.client import Client, start_client

NET = [[[i, j, 0.3 * (i % 2) * (j % 3)] for j in range(4)] for i in range(4)]
WAVE = {"control_net": NET}
FLAT = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
CAMERA = {"position": [1, 1, 20], "field_of_view": 0.8, "height": 500}


def request_mesh(
    client: Client, fmt: str = "json", surface: Any = WAVE, **options: Any
) -> httpx.Response:
    return client.post(f"/v1/mesh?format={fmt}", {"surface": surface, **options})


def test_the_bound_in_the_header_is_within_the_tolerance(client: Client) -> None:
    by_body = request_mesh(client, "stl", tolerance=0.01)
    by_url = client.get("/v1/surfaces/utah-teapot/mesh.glb?tolerance=0.05")
    for response, tolerance in ((by_body, 0.01), (by_url, 0.05)):
        assert response.status_code == 200
        assert 0 < float(response.headers[BOUND_HEADER]) <= tolerance


def test_options_in_the_body_and_in_the_query_give_equal_meshes(client: Client) -> None:
    definition = client.get("/v1/surfaces/cone").json()
    for options, query in (
        ({"tolerance": 0.01}, "tolerance=1e-2"),
        ({"relative_tolerance": 0.01, "two_sided": True}, "relative_tolerance=0.01&two_sided=true"),
        (
            {"tolerance": 0.1, "angle_tolerance": 0.5, "max_triangles": 9999},
            "tolerance=0.1&angle_tolerance=0.5&max_triangles=9999",
        ),
    ):
        by_body = client.post("/v1/mesh", {**definition, **options})
        by_url = client.get(f"/v1/surfaces/cone/mesh.json?{query}")
        assert by_body.status_code == by_url.status_code == 200
        assert by_body.content == by_url.content


TUBE = {"type": "tube", "curve": {"control_points": [[0, 0, 0], [1, 1, 0]]}, "radius": 1}


def test_errors_of_a_query_name_the_parameter(client: Client) -> None:
    for query, parameter in (
        ("tolerance=1e-30", "tolerance"),
        ("tolerance=0.1&resolution=3", "resolution"),
        ("camera=1", "camera"),
        ("two_sided=true", "tolerance"),  # which is missing
    ):
        response = client.get(f"/v1/surfaces/cone/mesh.json?{query}")
        assert response.status_code == 422
        assert [error["parameter"] for error in response.json()["errors"]] == [parameter]


def test_meshes_above_the_limits_of_the_settings_are_refused(client: Client) -> None:
    for settings in (Settings(max_vertices=100), Settings(max_response_bytes=20_000)):
        with start_client(create_app(settings)) as limited_client:
            response = request_mesh(limited_client, tolerance=2e-3)
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
OTHER_OPTIONS = {
    "resolution": st.just(3),
    "faces": st.sampled_from(["triangles", "quads", "none"]),
    "weld": st.booleans(),
    "curvatures": st.booleans(),
    "isocurves": st.just(2),
    "overlays": st.just(["control_net", "boundary"]),
    "method": st.sampled_from(["matrix", "de_casteljau"]),
}
BODIES = st.fixed_dictionaries(
    {"surface": st.sampled_from([FLAT, TUBE])},
    optional=dict.fromkeys(ACCURACY_FIELDS, VALUES) | OTHER_OPTIONS,
)


@given(body=BODIES, path=st.sampled_from(["/v1/mesh", "/v1/estimate"]))
def test_random_requests_succeed_or_are_refused(
    client: Client, body: dict[str, Any], path: str
) -> None:
    response = client.post(path, body)
    assert response.status_code in {200, 422}
    if response.status_code == 422:
        for error in response.json()["errors"]:
            assert error["code"]
            assert error["detail"]
