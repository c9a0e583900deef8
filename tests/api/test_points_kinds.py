"""POST /v1/points of every kind of surface: parameters of its own, or a refusal."""

from typing import Any

import numpy as np
import pytest

from service.engine.evaluation.evaluate import evaluate
from service.engine.points.answer import points
from service.engine.points.places import Query, locate
from service.surface.batches import TensorPatches
from service.surface.examples import EXAMPLES, find
from service.surface.lowered import PatchModel
from tests.api.client import Client


def ask(client: Client, surface: Any, **fields: Any) -> Any:
    answer = client.post("/v1/points", {"surface": surface, **fields})
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_bspline_is_asked_in_its_own_parameters(client: Client) -> None:
    """A roof: degree 1 by 1 with its ridge at v = 1, seen from the right; then beyond its end."""
    surface = {
        "type": "bspline",
        "control_net": [[[x, 0, 0], [x, 1, 1], [x, 2, 0]] for x in (0, 1)],
        "degree": [1, 1],
        "knots": [[0, 0, 1, 1], [0, 0, 1, 2, 2]],
    }
    found = ask(client, surface, uv=[[0, 0.5], [0, 1], [0, 1.5], [0, 2]])
    assert found["dv"] == [[0, 1, 1], [0, 1, -1], [0, 1, -1], [0, 1, -1]]
    answer = client.post("/v1/points", {"surface": surface, "uv": [[0.5, 2.5]]})
    error = answer.json()["errors"][0]
    assert (error["code"], error["pointer"]) == ("outside_domain", "/uv/0/1")
    assert error["needed"] == "0 to 2"


def test_triangles_are_asked_at_barycentric_places(client: Client) -> None:
    """A flat triangle with corners at the unit vectors: the place is the point."""
    surface = {"type": "triangle", "control_net": [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1]]]}
    places = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.25, 0.25]]
    found = ask(client, surface, barycentric=places, derivatives=2)
    assert found["positions"] == places
    assert found["du"] == [[-1, 1, 0]] * 4
    assert found["dv"] == [[-1, 0, 1]] * 4
    np.testing.assert_allclose(found["normals"], np.full((4, 3), 3**-0.5), atol=1e-15)
    assert found["gaussian_curvature"] == [0] * 4


def test_grids_and_triangles_are_numbered_as_in_the_request(client: Client) -> None:
    """Grids first, triangles after them, whatever the parts."""
    surface = {
        "type": "patches",
        "vertices": [[x, y, 0] for x in range(3) for y in range(2)],
        "patches": [[[0, 1], [2, 3]]],
        "triangles": [[[2, 4], [3]], [[4, 5], [3]]],
        "parts": {"last": [2], "first": [0]},
    }
    found = ask(client, surface, barycentric=[[1, 0, 0]] * 2, patch=[1, 2])
    assert found["positions"] == [[1, 0, 0], [2, 0, 0]]
    assert ask(client, surface, uv=[[0.5, 0.5]], patch=0)["positions"] == [[0.5, 0.5, 0]]
    answer = client.post("/v1/points", {"surface": surface, "uv": [[0, 0]], "patch": 2})
    assert answer.json()["errors"][0]["code"] == "wrong_parameters"


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_have_points_unless_they_have_no_parameters(client: Client, name: str) -> None:
    document = client.get(f"/v1/surfaces/{name}").json()
    model = find(name).surface().lower()
    if not isinstance(model, PatchModel):
        answer = client.post("/v1/points", {**document, "uv": [[0, 0]]})
        assert answer.status_code == 422
        error = answer.json()["errors"][0]
        assert (error["code"], error["pointer"]) == ("not_parametric", "/surface")
        return
    batch = model.batches[0]
    place: Any = (
        {"uv": [[0, 0]]} if isinstance(batch, TensorPatches) else {"barycentric": [[1, 0, 0]]}
    )
    if model.domain is not None:
        place = {"uv": [[float(model.domain.u[0]), float(model.domain.v[0])]]}
    fields = {"patch": 0} if model.domain is None else {}
    found = ask(client, document["surface"], derivatives=2, **place, **fields)
    first = 0 if model.order is None else int(np.argmin(model.order))
    np.testing.assert_allclose(found["positions"][0], batch.corners[first, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["utah-teapot", "sphere", "torus"])
def test_points_are_those_of_the_mesh(name: str) -> None:
    model = find(name).surface().lower()
    assert isinstance(model, PatchModel)
    model = PatchModel(model.name, model.batches, model.parts)
    (batch,) = model.batches
    right = evaluate(batch, (4, 5))
    assert right.normals is not None
    u, v = np.meshgrid(np.arange(5) / 4, np.arange(6) / 5, indexing="ij")
    uv = np.tile(np.stack([u, v], axis=-1).reshape(-1, 2), (batch.count, 1))
    patch = np.repeat(np.arange(batch.count), 30)
    found = points(model, locate(model, Query(uv, patch, 1)), 1)
    atol = 1e-13 * batch.extent
    np.testing.assert_allclose(found["positions"], right.positions.reshape(-1, 3), atol=atol)
    np.testing.assert_allclose(found["normals"], right.normals.reshape(-1, 3), atol=1e-9)
    assert found["degenerate"].sum() == right.poles
