"""Colours and attributes as three.js has them of a served GLB, in headless Chromium."""

import numpy as np

from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from tests.examples import patches_of
from tests.web.browser import Stage


def test_colors_arrive_linear(server: str, stage: Stage) -> None:
    """Three.js takes them, and the attribute under its name, without a complaint."""
    stage.show(f"{server}/v1/surfaces/heated-panel/mesh.glb?resolution=6")
    (mesh,) = stage.meshes()
    assert mesh["vertexColors"]
    assert mesh["attributes"] == ["_temperature", "color", "normal", "position", "uv"]
    made = tessellate(patches_of("heated-panel"), MeshOptions((6, 6)))
    assert made.colors is not None
    light = [[linear_light(float(c)) for c in row] for row in made.colors]
    np.testing.assert_allclose(mesh["colors"], light, atol=1e-7)


def test_curvatures_arrive(server: str, stage: Stage) -> None:
    """A shader can read them: numbers by vertex, next to positions and normals."""
    stage.show(f"{server}/v1/surfaces/torus/mesh.glb?relative_tolerance=0.01&curvatures=true")
    (mesh,) = stage.meshes()
    rho = np.hypot(*np.delete(np.array(mesh["positions"]), 1, axis=1).T)
    points = np.array(mesh["positions"])
    tube = np.hypot(rho - 1, points[:, 1])
    np.testing.assert_allclose(tube, 0.4, atol=1e-6)
    cosine = (rho - 1) / 0.4
    own = {name: np.array(rows)[:, 0] for name, rows in mesh["own"].items()}
    assert sorted(own) == ["_gaussian_curvature", "_mean_curvature"]
    np.testing.assert_allclose(own["_gaussian_curvature"], cosine / (0.4 * rho), atol=1e-5)
    np.testing.assert_allclose(own["_mean_curvature"], -(2.5 + cosine / rho) / 2, atol=1e-5)


def linear_light(c: float) -> float:
    """The formula of IEC 61966-2-1."""
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
