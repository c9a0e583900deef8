"""Placed copies have the curvatures of the placed surface, for all affine placements."""

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.curvatures.placement_scale import add_stretches
from service.engine.mesh.mesh import CURVATURE_NAMES
from service.engine.models import to_patches
from service.engine.options import MeshOptions
from service.engine.scenes.placing import place_points
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel
from service.surface.member import Member
from tests.strategies import Array
from tools.building import build, build_scene

OPTIONS = MeshOptions(resolution=(4, 3), curvatures=True)


def rotation(angle: float) -> Array:
    """A rotation about an oblique axis, and a translation."""
    about_x, about_z = np.eye(4), np.eye(4)
    c, s = np.cos(angle), np.sin(angle)
    about_x[1:3, 1:3] = about_z[:2, :2] = [[c, -s], [s, c]]
    matrix: Array = about_x @ about_z
    matrix[:3, 3] = [1.0, -2.0, 5.0]
    return matrix


SHEAR = np.array([[1.0, 0.5, 0, 3], [0, 2, 0.25, 0], [0, 0, 1.5, 0], [0, 0, 0, 1]])
MIRROR = np.diag([-1.0, 1, 1, 1])
PLACEMENTS = {
    "translated and rotated": rotation(0.3),
    "mirrored": MIRROR @ rotation(1.0),
    "smaller": rotation(0.7) @ np.diag([0.5, 0.5, 0.5, 1]),
    "sheared": SHEAR,
    "sheared and mirrored": MIRROR @ SHEAR @ rotation(2.0),
    "flattened": rotation(0.2) @ np.diag([1, 1e-3, 1, 1]),
}


def build_group(*matrices: Array | None, name: str = "sphere") -> GroupModel:
    """A group of placed copies of an example.

    `add_stretches` gives each copy a model with the stretch of its placement, from which its
    curvatures are computed.
    """
    surface = find(name).surface()
    # With the vertical axis of the examples, no copy is rotated before it is placed.
    return add_stretches(
        GroupSurface(tuple(Member(surface, matrix=m) for m in matrices), up="z").lower()
    )


def compute_curvatures(points: Array, linear: Array) -> tuple[Array, Array]:
    """K and H at points of the image of the unit sphere under x → L x, with normals outwards.

    With A = (L Lᵀ)⁻¹, f = xᵀ A x and n along g = A x: K = det A / |g|⁴ and
    H = (gᵀ A g − |g|² tr A) / (2 |g|³).
    """
    form = np.linalg.inv(linear @ linear.T)
    g = points @ form
    squared_length = (g * g).sum(axis=1)
    gaussian = np.linalg.det(form) / squared_length**2
    numerator = np.einsum("ni,ij,nj->n", g, form, g) - squared_length * np.trace(form)
    mean = numerator / (2 * squared_length**1.5)
    return gaussian, mean


@pytest.mark.slow
@pytest.mark.parametrize("name", PLACEMENTS)
@pytest.mark.parametrize("accuracy", [None, Accuracy(relative_tolerance=0.02)])
def test_a_placed_sphere_is_an_ellipsoid(name: str, accuracy: Accuracy | None) -> None:
    """Compares the curvatures in one mesh and in a scene, also at poles."""
    matrix = PLACEMENTS[name]
    group = build_group(None, matrix)
    options = MeshOptions(resolution=(4, 3), curvatures=True, accuracy=accuracy)
    scene = build_scene(group, options)
    flat = build(group, options)
    node = scene.nodes[1]
    mesh = scene.meshes[node.model]
    # In the one mesh, the vertices of the placed copy follow those of the copy without placement.
    begin = len(scene.meshes[scene.nodes[0].model].positions)
    placed = place_points(mesh.positions, node.matrix)
    expected = compute_curvatures(placed - matrix[:3, 3], matrix[:3, :3])
    assert len(flat.positions) - begin == len(placed)
    for key, values in zip(CURVATURE_NAMES, expected, strict=True):
        limit = 1e-8 * np.abs(values).max()
        for result in (dict(mesh.attributes)[key], dict(flat.attributes)[key][begin:]):
            np.testing.assert_allclose(result[:, 0], values, rtol=1e-8, atol=limit)


@pytest.mark.parametrize("name", ["utah-teapot", "saddle", "octahedral-sphere", "bspline-hills"])
def test_a_sheared_copy_has_the_curvatures_of_placed_control_points(name: str) -> None:
    """`to_patches` places control points. The examples include triangles and rational patches."""
    options = MeshOptions(resolution=(4, 4), curvatures=True, weld=False)
    group = build_group(SHEAR, name=name)
    result, expected = build(group, options), build(to_patches(group), options)
    np.testing.assert_allclose(result.positions, expected.positions, atol=1e-12)
    for (_, values), (_, expected_values) in zip(
        result.attributes, expected.attributes, strict=True
    ):
        np.testing.assert_allclose(
            values, expected_values, rtol=1e-9, atol=1e-9 * np.abs(expected_values).max()
        )


def test_copies_with_equal_curvatures_share_a_model() -> None:
    """Translated, rotated and mirrored copies share a model; each other scale has its own model."""
    half = np.diag([0.5, 0.5, 0.5, 1.0])
    group = build_group(
        None,
        rotation(0.3),
        MIRROR @ rotation(1.0),
        rotation(0.1) @ half,
        rotation(2.0) @ half,
        SHEAR,
        SHEAR,
    )
    assert [member.model for member in group.members] == [0, 0, 0, 1, 1, 2, 2]
    plain, *stretched = group.models
    assert all(m.batches is plain.batches for m in stretched)  # type: ignore[union-attr]
    # A second call changes nothing.
    stretched_twice = add_stretches(group)
    assert [m.model for m in stretched_twice.members] == [m.model for m in group.members]
    scene = build_scene(stretched_twice, OPTIONS)
    assert len(scene.meshes) == 3
    assert [mesh.report.curvature is not None for mesh in scene.meshes] == [True] * 3
    assert scene.report.curvature is not None
    low, high = scene.report.curvature[0]
    gaussian = [dict(mesh.attributes)[CURVATURE_NAMES[0]] for mesh in scene.meshes]
    assert low == min(float(values.min()) for values in gaussian)
    # A sphere of half the size has the Gaussian curvature 4.
    assert (
        high == max(float(dict(m.attributes)[CURVATURE_NAMES[0]].max()) for m in scene.meshes) >= 4
    )
