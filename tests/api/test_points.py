"""POST /v1/points: points, derivatives and curvatures; limits and errors."""

import math
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.encoders.json_mesh import points_bound
from service.engine.points.evaluate import COLUMNS
from service.settings.values import Settings
from service.surface.batches import TensorPatches
from service.surface.brep_model import BrepModel
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.lowered import GroupModel, PatchModel
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]


def evaluate(client: Client, **fields: Any) -> Any:
    """The response to a request for points of the surface z = uv, with these further fields."""
    response = client.post("/v1/points", {"surface": {"control_net": NET}, **fields})
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "application/json"
    return response.json()


def test_derivatives_and_curvatures_agree_with_closed_forms(client: Client) -> None:
    """z = uv at (0, 0) and (0, 1)."""
    result = evaluate(client, uv=[[0, 0], [0, 1]], derivatives=2)
    root_of_half = math.sqrt(0.5)
    normals, curvatures = (
        [[0.0, 0.0, 1.0], [-root_of_half, 0.0, root_of_half]],
        [[1.0, -1.0], [0.5, -0.5]],
    )
    assert result["positions"] == [[0, 0, 0], [0, 1, 0]]
    assert result["du"] == [[1, 0, 0], [1, 0, 1]]
    assert result["dv"] == [[0, 1, 0], [0, 1, 0]]
    assert result["duv"] == [[0, 0, 1], [0, 0, 1]]
    assert result["duu"] == result["dvv"] == [[0, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(result["normals"], normals, atol=1e-15)
    np.testing.assert_allclose(result["gaussian_curvature"], [-1.0, -0.25], atol=1e-15)
    np.testing.assert_allclose(result["mean_curvature"], [0, 0], atol=1e-15)
    np.testing.assert_allclose(result["principal_curvatures"], curvatures, atol=1e-15)
    assert result["degenerate"] == [False, False]


def test_the_order_of_derivatives_selects_the_columns(client: Client) -> None:
    # The columns that each order adds; the default order is 1.
    names = [[name for name, _ in columns] for columns in COLUMNS]
    assert list(evaluate(client, uv=[[0, 0]], derivatives=0)) == names[0]
    assert list(evaluate(client, uv=[[0, 0]])) == names[0] + names[1]
    assert list(evaluate(client, uv=[[0, 0]], derivatives=2)) == names[0] + names[1] + names[2]


def test_zeros_are_written_without_a_sign(client: Client) -> None:
    response = client.post("/v1/points", {"surface": {"control_net": NET}, "uv": [[0.5, 0]]})
    # The normal has the direction (-v, -u, 1) = (-0, -0.5, 1).
    assert response.json()["normals"][0][1] < 0
    assert "-0.0]" not in response.text
    assert "-0.0," not in response.text


def test_results_of_many_points_are_in_order(client: Client) -> None:
    """A thread computes 3,000 points, because they take too long for the event loop."""
    uv = np.random.default_rng(2).random((3000, 2))
    result = evaluate(client, uv=uv.tolist(), derivatives=2)
    np.testing.assert_allclose(
        result["positions"], np.stack([*uv.T, uv[:, 0] * uv[:, 1]], axis=1), atol=1e-15
    )


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        (Settings(max_points=9), "too_many_points"),
        (Settings(max_response_bytes=1024), "too_many_bytes"),
    ],
)
def test_results_above_the_limits_are_refused(settings: Settings, code: str) -> None:
    document = {"surface": {"control_net": NET}, "uv": [[0.5, 0.5]] * 10, "derivatives": 2}
    with start_client(create_app(settings)) as client:
        response = client.post("/v1/points", document)
        assert response.status_code == 422
        assert response.json()["code"] == "result_too_large"
        error = response.json()["errors"][0]
        assert (error["code"], error["pointer"]) == (code, "/uv")
        document = {"surface": {"control_net": NET}, "uv": [[0.5, 0.5]]}
        assert client.post("/v1/points", document).status_code == 200


def test_the_limit_of_control_points_does_not_apply_to_points() -> None:
    document = {"surface": {"control_net": NET}, "uv": [[0.5, 0.5]] * 2000, "derivatives": 0}
    with start_client(create_app(Settings(max_control_points=4))) as client:
        assert client.post("/v1/points", document).status_code == 200


def test_responses_with_the_longest_numbers_are_within_byte_bound(client: Client) -> None:
    net_of_long_numbers = [
        [[-1.2345678901234567e-101 * (i + j), 0.1 * j, i / 7] for j in (1, 2)] for i in (1, 3)
    ]
    uv = np.random.default_rng(4).random((50, 2)).tolist()
    for order in (0, 1, 2):
        document = {"surface": {"control_net": net_of_long_numbers}, "uv": uv, "derivatives": order}
        content = client.post("/v1/points", document).content
        assert len(content) <= points_bound(50, order)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_have_points_unless_they_have_no_parameters(client: Client, name: str) -> None:
    document = client.get(f"/v1/surfaces/{name}").json()
    model = find(name).surface().lower()
    if isinstance(model, BrepModel):
        u, v = np.split(model.surfaces.knots, model.surfaces.knot_starts[1:])[:2]
        p, q = model.surfaces.degrees[0].tolist()
        low = [float(u[p]), float(v[q])]
        result = client.post("/v1/points", {**document, "uv": [low], "patch": 0}).json()
        assert len(result["positions"]) == len(result["inside"]) == 1
        return
    if isinstance(model, GroupModel):
        result = client.post("/v1/points", {**document, "uv": [[0, 0]], "patch": 0}).json()
        assert len(result["positions"]) == 1
        return
    if not isinstance(model, PatchModel):
        response = client.post("/v1/points", {**document, "uv": [[0, 0]]})
        assert response.status_code == 422
        error = response.json()["errors"][0]
        assert (error["code"], error["pointer"]) == ("not_parametric", "/surface")
        return
    batch = model.batches[0]
    fields: dict[str, Any]
    if model.domain is not None:
        fields = {"uv": [[float(model.domain.u[0]), float(model.domain.v[0])]]}
    elif isinstance(batch, TensorPatches):
        fields = {"uv": [[0, 0]], "patch": 0}
    else:
        fields = {"barycentric": [[1, 0, 0]], "patch": 0}
    result = client.post("/v1/points", {**document, "derivatives": 2, **fields}).json()
    # `request_numbers` has for each patch its number in the request, if the order differs.
    first_patch = 0 if model.request_numbers is None else int(np.argmin(model.request_numbers))
    np.testing.assert_allclose(result["positions"][0], batch.corners[first_patch, 0], atol=1e-12)


def test_an_error_shows_all_digits_of_a_value_just_outside_its_range(client: Client) -> None:
    knots = [[0, 0, 0.3, 0.3], "clamped"]
    surface = {"type": "bspline", "control_net": NET, "degree": 1, "knots": knots}
    response = client.post("/v1/points", {"surface": surface, "uv": [[0.3 + 1e-14, 0]]})
    (error,) = response.json()["errors"]
    assert (error["got"], error["needed"]) == ("0.30000000000001", "0 to 0.3")
    # 0.1 + 0.2 exceeds 0.3 by a rounding, and counts as the end of the domain.
    response = client.post("/v1/points", {"surface": surface, "uv": [[0.1 + 0.2, 0]]})
    assert response.status_code == 200
    response_to_color = client.post(
        "/v1/mesh", {"surface": {"control_net": NET, "colors": [[[1, 1, 1 + 1e-9]]]}}
    )
    assert [each["got"] for each in response_to_color.json()["errors"]] == ["1.000000001"]


def test_tubes_that_are_exact_have_the_points_that_closest_points_name(client: Client) -> None:
    """A quarter of a torus, R = 1 and r = 1/4, with the curvatures of a torus."""
    root = math.sqrt(0.5)
    bend = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, root, 1]}
    tube = {"type": "tube", "curve": bend, "radius": 0.25, "caps": False}
    points = [[1.5 * root, 1.5 * root, 0], [0.5 * root, 0.5 * root, 0]]  # outside, inside the bend
    answer = client.post("/v1/project", {"surface": tube, "points": points}).json()
    for k, distance in enumerate((1.25, 0.75)):  # from the axis of the torus
        place = {"uv": [answer["uv"][k]], "patch": answer["patch"][k], "derivatives": 2}
        found = client.post("/v1/points", {"surface": tube, **place}).json()
        np.testing.assert_allclose(found["positions"], [answer["positions"][k]], atol=1e-12)
        gaussian = (distance - 1) / (0.25**2 * distance)
        mean = (1 / 0.25 + (distance - 1) / (0.25 * distance)) / 2
        assert found["gaussian_curvature"][0] == pytest.approx(gaussian)
        assert abs(found["mean_curvature"][0]) == pytest.approx(mean)
    response = client.post("/v1/points", {"surface": tube, "uv": [[0, 0]]})
    assert response.json()["errors"][0]["code"] == "missing_field"
    assert response.json()["errors"][0]["pointer"] == "/patch"
