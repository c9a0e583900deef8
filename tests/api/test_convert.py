"""POST /v1/convert: the results are valid surfaces; errors have pointers."""

from typing import Any

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tests.forms import SURFACES
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]
OPERATIONS: dict[str, list[tuple[str, Any]]] = {
    "bezier": [
        ("elevate", {"degree": 4}),
        ("split", {"u": 0.5, "v": 0.25}),
        ("restrict", {"u": [0, 0.5]}),
        ("transpose", {}),
        ("reverse", {"direction": "v"}),
        ("bezier", {}),
        ("triangle", {"half": "lower"}),
        ("triangle", {"half": "upper"}),
    ],
    "triangle": [
        ("elevate", {"degree": 5}),
        ("split", {"at": [0.5, 0.25, 0.25]}),
        ("transpose", {}),
        ("reverse", {"direction": "v"}),
        ("bezier", {}),
    ],
    "bspline": [
        ("elevate", {"degree": 4}),
        ("split", {"u": 0.5, "v": 0.25}),
        ("restrict", {"u": [0, 1.5], "v": [0.25, 0.75]}),
        ("transpose", {}),
        ("reverse", {"direction": "u"}),
        ("reverse", {"direction": "v"}),
        ("bezier", {}),
    ],
    "patches": [
        ("elevate", {"degree": 3}),
        ("transpose", {}),
        ("reverse", {"direction": "u"}),
        ("bezier", {}),
    ],
}
"""Operations and their fields by kind of surface."""


@pytest.mark.parametrize(
    ("kind", "op", "fields"),
    [(kind, op, fields) for kind, items in OPERATIONS.items() for op, fields in items],
)
def test_converted_surfaces_are_valid_surfaces(
    client: Client, kind: str, op: str, fields: Any
) -> None:
    """The service makes a mesh of the result; converting Bézier patches to Bézier changes no byte.

    B-splines, and the groups into which `split` divides them, are not yet Bézier patches.
    """
    document = {"surface": SURFACES[f"{kind} with channels"], "operations": [{"op": op, **fields}]}
    response = client.post("/v1/convert", document)
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/json"
    assert set(response.json()) == {"surface"}
    mesh = client.post("/v1/mesh", response.json() | {"resolution": 2}).json()
    assert mesh["report"]["vertices"] == len(mesh["vertices"])
    assert len(mesh["colors"]) == len(mesh["normals"])
    if response.json()["surface"]["type"] in ("bspline", "group"):
        return
    second_response = client.post(
        "/v1/convert", response.json() | {"operations": [{"op": "bezier"}]}
    )
    assert second_response.content == response.content


def test_groups_are_converted(client: Client) -> None:
    """Also one that `split` returns; an operation on one patch needs its number."""
    split = {"op": "split", "u": 1}
    document = {"surface": SURFACES["bspline"], "operations": [split, {"op": "transpose"}]}
    response = client.post("/v1/convert", document)
    assert response.status_code == 200
    group = client.post("/v1/convert", document | {"operations": [split]}).json()
    assert group["surface"]["type"] == "group"
    error = client.post("/v1/convert", group | {"operations": [split]}).json()["errors"][0]
    assert (error["code"], error["pointer"]) == ("missing_field", "/operations/0/patch")
    operations = [{"op": "transpose"}, {"op": "reverse", "direction": "u", "patch": 3}]
    converted = client.post("/v1/convert", group | {"operations": operations}).json()
    assert converted["surface"]["type"] == "group"
    points = [
        client.post("/v1/points", {**each, "uv": [uv], "patch": 0}).json()["positions"][0]
        for each, uv in ((group, [0.25, 0.5]), (converted, [0.5, 0.25]))
    ]
    assert points[0] == pytest.approx(points[1])


def test_each_operation_converts_the_result_of_the_previous_one(client: Client) -> None:
    operations = [
        {"op": "elevate", "degree": [3, 3]},
        {"op": "restrict", "u": [0.5, 1]},
        {"op": "transpose"},
        {"op": "split", "v": 0.5},
    ]
    surface = {"control_net": NET}
    response_to_all = client.post("/v1/convert", {"surface": surface, "operations": operations})
    for operation in operations:
        response = client.post("/v1/convert", {"surface": surface, "operations": [operation]})
        surface = response.json()["surface"]
    assert response_to_all.json()["surface"] == surface
    assert len(surface["patches"]) == 2


@pytest.mark.parametrize("kind", sorted(SURFACES))
def test_without_operations_every_surface_is_its_own_document(client: Client, kind: str) -> None:
    response = client.post("/v1/convert", {"surface": SURFACES[kind]})
    assert response.status_code == 200
    document = response.json()
    id = client.post("/v1/surfaces", {"surface": SURFACES[kind]}).json()["id"]
    assert document == client.get(f"/v1/surfaces/{id}").json()


def test_limits_are_those_of_the_settings() -> None:
    operations = [{"op": "elevate", "degree": 9}]
    document = {"surface": {"control_net": NET}, "operations": operations}
    with start_client(create_app(Settings(max_control_points=99))) as client:
        error = client.post("/v1/convert", document).json()["errors"][0]
        assert (error["code"], error["needed"]) == ("too_many_control_points", "at most 99")
    with start_client(create_app(Settings(max_response_bytes=1024))) as client:
        error = client.post("/v1/convert", document).json()["errors"][0]
        assert (error["code"], error["pointer"]) == ("too_many_bytes", "/operations")
        flat = {"surface": {"type": "bspline", "degree": 1, "control_net": [[[0, 0, 1]] * 99] * 2}}
        error = client.post("/v1/convert", flat).json()["errors"][0]
        assert (error["code"], error["pointer"]) == ("too_many_bytes", "/surface")
    with start_client(create_app(Settings(max_degree=8))) as client:
        error = client.post("/v1/convert", document).json()["errors"][0]
        assert (error["code"], error["pointer"]) == ("degree_too_high", "/operations/0/degree")
