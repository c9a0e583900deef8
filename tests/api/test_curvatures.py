"""Curvatures as attributes of a mesh: their values, the report, and errors."""

import numpy as np

from service.engine.mesh.mesh import CURVATURE_NAMES
from tests.forms import SURFACES, TUBE
from tools.client import Client

NET = [[[i, j, 0.5 * i * i - 0.2 * j * j] for j in range(4)] for i in range(4)]
SADDLE = {"control_net": NET}


def test_curvatures_of_vertices_agree_with_those_of_points(client: Client) -> None:
    """`POST /v1/points` at the parameters of all vertices gives the same numbers and signs.

    `uvs` of a surface without uvs of its own are its parameters.
    """
    body = {"surface": SADDLE, "resolution": [4, 8], "curvatures": True}
    mesh = client.post("/v1/mesh", body | {"uvs": True, "weld": False}).json()
    request = {"surface": SADDLE, "uv": mesh["uvs"], "derivatives": 2}
    points = client.post("/v1/points", request).json()
    for name in CURVATURE_NAMES:
        values = np.array(mesh["attributes"][name])
        np.testing.assert_allclose(values[:, 0], points[name], rtol=1e-9, atol=1e-12)
    assert mesh["report"]["curvature"] == {
        short: [float(np.min(mesh["attributes"][name])), float(np.max(mesh["attributes"][name]))]
        for short, name in zip(("gaussian", "mean"), CURVATURE_NAMES, strict=True)
    }


def test_formats_with_attributes_refuse_curvatures_that_do_not_exist(client: Client) -> None:
    """A tube has no curvatures, and an attribute must not have the name of a curvature.

    Names are compared without regard to capitals.
    """
    with_equal_name = SADDLE | {"attributes": {"Mean_Curvature": [[[1]]]}}
    group = SURFACES["group"]  # one of its members is a tube
    for surface, code, pointer in (
        (TUBE, "not_parametric", "/curvatures"),
        (group, "not_parametric", "/curvatures"),
        (with_equal_name, "name_clash", "/curvatures"),
    ):
        body = {"surface": surface, "curvatures": True}
        for path in ("/v1/mesh?format=glb", "/v1/mesh?format=json"):
            response = client.post(path, body)
            assert response.status_code == 422
            (error,) = response.json()["errors"]
            assert (error["code"], error["pointer"]) == (code, pointer)
        assert client.post("/v1/mesh?format=stl", body).status_code == 200
        estimate = client.post("/v1/estimate", body).json()
        refused_formats = {name for entry in estimate["refused"] for name in entry["formats"]}
        assert refused_formats == {"json", "glb", "gltf", "ply", "npz"}
