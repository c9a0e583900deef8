"""GLB files in three.js: shading, curvatures, groups and wireframes."""

import numpy as np
import pytest

from service.encoders.registry import BY_NAME
from service.engine.build import build_scene
from service.engine.options import MeshOptions
from service.engine.scenes.placing import place_points
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel
from service.surface.member import Member
from tests.web.clients import to_linear, turn_upright
from tools.browser import Stage


def test_the_shading_of_the_teapot_is_smooth(server: str, stage: Stage) -> None:
    """Shaded by normals, the picture has almost no edges; with flat shading it has many."""
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?resolution=16", 1800, 1200)
    smooth_picture = stage.page.evaluate("window.viewer.measure()")
    assert 0.1 < smooth_picture["coverage"] < 0.6
    stage.page.evaluate("window.viewer.shadeFlat()")
    flat_picture = stage.page.evaluate("window.viewer.measure()")
    assert smooth_picture["edges"] < 0.01
    assert flat_picture["edges"] > 4 * smooth_picture["edges"]


def test_three_reads_curvatures_as_attributes(server: str, stage: Stage) -> None:
    """So shaders can use curvatures. The curvatures of a torus, radii 1 and 0.4, are known."""
    stage.show(f"{server}/v1/surfaces/torus/mesh.glb?relative_tolerance=0.01&curvatures=true")
    (mesh,) = stage.read_meshes()
    points = np.array(mesh["positions"])
    radius = np.hypot(points[:, 0], points[:, 2])  # the distance from the axis, which is y
    distance = np.hypot(radius - 1, points[:, 1])
    np.testing.assert_allclose(distance, 0.4, atol=1e-6)
    # The principal curvatures are −1 / 0.4 and −cosine / radius: a surface that bends away from its
    # normal has a negative curvature.
    cosine = (radius - 1) / 0.4
    attributes = {name: np.array(rows)[:, 0] for name, rows in mesh["customAttributes"].items()}
    assert sorted(attributes) == ["_gaussian_curvature", "_mean_curvature"]
    np.testing.assert_allclose(
        attributes["_gaussian_curvature"], cosine / (0.4 * radius), atol=1e-5
    )
    np.testing.assert_allclose(
        attributes["_mean_curvature"], (-1 / 0.4 - cosine / radius) / 2, atol=1e-5
    )


def test_members_of_a_group_have_their_placements_and_colours(server: str, stage: Stage) -> None:
    """The bounds, the colour and the mirroring of each member of the tea service."""
    stage.show(f"{server}/v1/surfaces/tea-service/mesh.glb?resolution=3")
    meshes = stage.read_meshes()
    model = find("tea-service").surface().lower()
    assert isinstance(model, GroupModel)
    scene = build_scene(model, MeshOptions(resolution=(3, 3)), is_float32=True)
    # Meshes are matched by order, because three.js changes names that are equal.
    unmatched_meshes = iter(meshes)
    for node in scene.nodes:
        expected = turn_upright(place_points(scene.meshes[node.model].positions, node.matrix))
        copies = [next(unmatched_meshes) for _ in scene.meshes[node.model].parts]
        positions = np.concatenate([mesh["positions"] for mesh in copies])
        for end in ("min", "max"):
            bounds = (getattr(points, end)(axis=0) for points in (positions, expected))
            np.testing.assert_allclose(*bounds, atol=1e-5)  # type: ignore[call-overload]
        assert node.color is not None
        light = to_linear(np.array(node.color[:3]))
        for mesh in copies:
            np.testing.assert_allclose(mesh["color"], light, atol=1e-6)
            determinant = 1 if node.matrix is None else np.linalg.det(node.matrix[:3, :3])
            assert mesh["mirrored"] == (determinant < 0)
    assert list(unmatched_meshes) == []


def test_a_mirrored_sphere_is_lit_from_the_same_side(stage: Stage) -> None:
    """A sphere and its mirror image look equal, and are brighter above than below."""
    sphere, brightness = find("sphere").surface(), []
    for mirror in (1.0, -1.0):
        member = Member(sphere, color=(0.5, 0.5, 0.5), matrix=np.diag([1, mirror, 1, 1.0]))
        stage.show(render(GroupSurface((member,), "z"), MeshOptions((6, 6)), BY_NAME["glb"]))
        (mesh,) = stage.read_meshes()
        assert mesh["mirrored"] == (mirror < 0)
        outwards = np.einsum("vd,vd->v", mesh["positions"], mesh["normals"])
        assert outwards.min() > 0.99
        brightness.append(stage.measure_light())
    assert brightness[0][1] > 1.3 * brightness[0][0]
    np.testing.assert_allclose(brightness[0], brightness[1], rtol=0.01)


def test_a_wireframe_has_only_tubes_along_the_curves(server: str, stage: Stage) -> None:
    """The tubes have unit normals, are visible, and are as high as the teapot: 3.15 units."""
    query = "faces=none&isocurves=3&wires=tubes&wire_width=0.02&wire_sides=5&resolution=4"
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?{query}")
    (mesh,) = stage.read_meshes()
    assert mesh["name"] == "isocurves"
    assert mesh["maxNormalLengthError"] < 1e-6
    assert min(stage.measure_light()) > 0
    points = np.array(mesh["positions"])
    assert points[:, 1].max() == pytest.approx(3.15, abs=0.02)
    assert points[:, 1].min() == pytest.approx(0, abs=0.02)
