"""A GLB in three.js in headless Chromium: shading, curvatures, groups, wires."""

import numpy as np
import pytest

from service.encoders.registry import BY_NAME
from service.engine.build import build_scene
from service.engine.options import MeshOptions
from service.engine.scenes.scene import place_points
from service.pipeline.mesh import render
from service.surface.examples import find
from service.surface.group import GroupSurface, Member
from service.surface.lowered import GroupModel
from tests.web.browser import Stage
from tests.web.clients import to_linear, turn_upright


def test_the_picture_is_smooth(server: str, stage: Stage) -> None:
    """Shaded by its normals, the teapot has almost no edges; shaded flat, it has one at every
    triangle."""
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?resolution=16", 1800, 1200)
    smooth = stage.page.evaluate("window.viewer.measure()")
    assert 0.1 < smooth["coverage"] < 0.6
    stage.page.evaluate("window.viewer.shadeFlat()")
    flat = stage.page.evaluate("window.viewer.measure()")
    assert smooth["edges"] < 0.01
    assert flat["edges"] > 4 * smooth["edges"]


def test_curvatures_arrive(server: str, stage: Stage) -> None:
    """Shaders can read curvatures: attributes beside positions and normals."""
    stage.show(f"{server}/v1/surfaces/torus/mesh.glb?relative_tolerance=0.01&curvatures=true")
    (mesh,) = stage.meshes()
    rho = np.hypot(*np.delete(np.array(mesh["positions"]), 1, axis=1).T)
    points = np.array(mesh["positions"])
    tube = np.hypot(rho - 1, points[:, 1])
    np.testing.assert_allclose(tube, 0.4, atol=1e-6)
    cosine = (rho - 1) / 0.4
    attributes = {name: np.array(rows)[:, 0] for name, rows in mesh["own"].items()}
    assert sorted(attributes) == ["_gaussian_curvature", "_mean_curvature"]
    np.testing.assert_allclose(attributes["_gaussian_curvature"], cosine / (0.4 * rho), atol=1e-5)
    np.testing.assert_allclose(attributes["_mean_curvature"], -(2.5 + cosine / rho) / 2, atol=1e-5)


def test_copies_stand_in_their_places_and_colours(server: str, stage: Stage) -> None:
    """Every vertex of every member of the tea service, where it was placed."""
    stage.show(f"{server}/v1/surfaces/tea-service/mesh.glb?resolution=3")
    meshes = stage.meshes()
    model = find("tea-service").surface().lower()
    assert isinstance(model, GroupModel)
    scene = build_scene(model, MeshOptions(resolution=(3, 3)), single=True)
    # In the order of the members, because three.js changes equal names.
    waiting = iter(meshes)
    for node in scene.nodes:
        expected = turn_upright(place_points(scene.meshes[node.model].positions, node.matrix))
        copies = [next(waiting) for _ in scene.meshes[node.model].parts]
        result = np.concatenate([mesh["positions"] for mesh in copies])
        for end in ("min", "max"):
            bounds = (getattr(points, end)(axis=0) for points in (result, expected))
            np.testing.assert_allclose(*bounds, atol=1e-5)  # type: ignore[call-overload]
        assert node.color is not None
        light = to_linear(np.array(node.color[:3]))
        for mesh in copies:
            np.testing.assert_allclose(mesh["color"], light, atol=1e-6)
            determinant = 1 if node.matrix is None else np.linalg.det(node.matrix[:3, :3])
            assert mesh["mirrored"] == (determinant < 0)
    assert list(waiting) == []


def test_a_mirrored_copy_is_lit_from_the_same_side(stage: Stage) -> None:
    """A ball and its mirror image look alike, brighter above than below."""
    ball, seen = find("sphere").surface(), []
    for mirror in (1.0, -1.0):
        member = Member(ball, color=(0.5, 0.5, 0.5), matrix=np.diag([1, mirror, 1, 1.0]))
        stage.show(render(GroupSurface((member,), "z"), MeshOptions((6, 6)), BY_NAME["glb"]))
        (mesh,) = stage.meshes()
        assert mesh["mirrored"] == (mirror < 0)
        outwards = np.einsum("vd,vd->v", mesh["positions"], mesh["normals"])
        assert outwards.min() > 0.99
        seen.append(stage.light())
    assert seen[0][1] > 1.3 * seen[0][0]
    np.testing.assert_allclose(seen[0], seen[1], rtol=0.01)


def test_the_teapot_as_a_wireframe(server: str, stage: Stage) -> None:
    """One request returns only tubes along the curves."""
    query = "faces=none&isocurves=3&wires=tubes&wire_width=0.02&wire_sides=5&resolution=4"
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?{query}")
    (mesh,) = stage.meshes()
    assert mesh["name"] == "isocurves"
    assert mesh["longestNormalError"] < 1e-6
    assert min(stage.light()) > 0
    points = np.array(mesh["positions"])
    assert points[:, 1].max() == pytest.approx(3.15, abs=0.02)
    assert points[:, 1].min() == pytest.approx(0, abs=0.02)
