"""Isoparametric curves as tubes and ribbons, which continue across patches."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.wires.draw import COLOR, NAME, find_width
from service.engine.wires.isocurves import sample_isocurves
from service.engine.wires.wire_paths import build_wire_paths
from service.pipeline.mesh_counts import mesh_size
from service.surface.examples.catalogue import find
from service.surface.lowered import PatchModel
from tests.engine.meshing import build_mesh, check_sound, check_winding
from tests.strategies import Array, build_cube, build_model, split_models
from tools.examples import lower_patches

SHAPES = ["utah-teapot", "cone", "tveit", "torus", "octahedral-sphere", "bspline-hills"]
"""Examples with poles, an apex, a border, closed circles, triangles, and a B-spline."""


def draw_wires(source: Any, count: int | tuple[int, int], **options: Any) -> Mesh:
    """A mesh of the wires alone, without faces of the surface."""
    counts = (count, count) if isinstance(count, int) else count
    return build_mesh(source, isocurves=counts, has_faces=False, **options)


def list_paths(model: PatchModel, count: int) -> list[tuple[int, int, bool]]:
    """For paths with equal frames: their number, the frames of each, whether they are closed.

    A frame is a point of a path: each sample is one frame, a bend of more than 1° two. Curves
    have 4 divisions in each patch. The list is sorted.
    """
    runs = sample_isocurves(model, (4, 4), (count, count))
    result = [wires.paths for wires in build_wire_paths(model, runs, crease_angle=np.radians(1))]
    return sorted((*paths.points.shape[:2], paths.closed) for paths in result)


@pytest.mark.parametrize(("weld", "faces"), [(True, "triangles"), (False, "quads")])
@pytest.mark.parametrize("wires", ["tubes", "ribbons"])
@pytest.mark.parametrize("example", SHAPES)
def test_wires_are_sound_meshes_within_the_predicted_size(
    example: str, wires: str, weld: bool, faces: str
) -> None:
    options: dict[str, Any] = {
        "resolution": (3, 2),
        "wire_sides": 3,
        "faces": faces,
        "weld": weld,
        "wires": wires,
    }
    mesh = draw_wires(example, (3, 2), **options)
    check_sound(mesh)
    if weld:
        assert mesh.report.watertight == (wires == "tubes")
    (part,) = mesh.parts
    assert part.name == NAME
    expected = MeshOptions(isocurves=(3, 2), has_faces=False, **options)
    size = mesh_size(find(example).surface().size(), expected, BY_NAME["json"])
    assert size.vertices >= len(mesh.positions)
    assert size.triangles >= len(mesh.triangles)
    assert size.quads >= len(mesh.quads)


def test_tubes_are_centred_on_curves_of_the_surface() -> None:
    """The points of tubes that are furthest from the unit sphere are half of the width away."""
    mesh = draw_wires("sphere", 4, wires="tubes", wire_width=0.05, wire_sides=12)
    check_winding(mesh)
    distance = np.linalg.norm(mesh.positions, axis=1)
    assert (distance.min(), distance.max()) == pytest.approx((0.975, 1.025), abs=1e-12)


def test_ribbons_lie_on_the_surface() -> None:
    """Ribbons on a sphere have its normals, and their width is tangential to it."""
    mesh = draw_wires("sphere", 3, wires="ribbons", wire_width=0.1, resolution=(8, 8))
    assert mesh.normals is not None
    outwards = np.einsum("vd,vd->v", mesh.normals, mesh.positions)
    assert outwards.min() > 0.99
    np.testing.assert_allclose(
        np.linalg.norm(mesh.positions, axis=1), np.hypot(1, 0.05), atol=1e-12
    )


def test_a_circle_across_patches_is_one_closed_tube() -> None:
    """Circles through four patches on the side, the rim and the base of a cone have no caps."""
    cone = lower_patches("cone")
    # 3 circles: v = 1/2 on the side and on the base, and the rim; 4 diameters of the base; 8
    # rulings.
    assert list_paths(cone, 2) == [(3, 17, True), (4, 9, False), (8, 5, False)]
    mesh = draw_wires("cone", (0, 2), wires="tubes", wire_width=0.02, resolution=(4, 4))
    # 3 circles of 16 divisions; a tube has 8 sides by default.
    assert len(mesh.positions) == 3 * 16 * 8


def test_lines_continue_through_corners_of_patches() -> None:
    """Meridians of a sphere continue through poles, and knot lines of a B-spline to its borders."""
    # 4 meridian circles and 3 parallels, each through 4 patches with 4 divisions.
    assert list_paths(lower_patches("sphere"), 2) == [(7, 17, True)]
    hills = lower_patches("bspline-hills")
    assert hills.domain is not None
    # The numbers of knot lines; between two knot lines a curve has 4 divisions.
    u, v = len(hills.domain.u), len(hills.domain.v)
    assert sorted(list_paths(hills, 1)) == sorted(
        [(u, 4 * (v - 1) + 1, False), (v, 4 * (u - 1) + 1, False)]
    )


def test_bends_up_to_a_right_angle_are_mitred() -> None:
    """A line around a cube bends by 90° at each edge, and is one tube with square corners."""
    model = build_model(build_cube())
    result = list_paths(model, 2)
    # 3 rings around 4 faces with 4 divisions each. A closed path of 16 divisions has 17 frames:
    # the last is the first again. Each of the 3 bends between its ends has a second frame.
    assert (3, 16 + 1 + 3, True) in result
    mesh = draw_wires(model, 2, wires="tubes", wire_width=0.1, wire_sides=4, resolution=(1, 1))
    check_sound(mesh)
    assert mesh.report.watertight


@given(split_models(oriented=False))
def test_curves_continue_across_patches(net_and_pieces: tuple[Array, list[Array]]) -> None:
    """Lines continue through the quarters of one patch, for all parametrizations of quarters."""
    _, pieces = net_and_pieces
    result = list_paths(build_model(pieces), 2)
    two_patch_lines = sum(count for count, frames, _ in result if frames == 9)
    # In each direction, 3 borders and 2 lines between them run through 2 patches each.
    assert two_patch_lines == 10


def test_wires_are_a_part_beside_the_unchanged_surface() -> None:
    """The part of the wires has a base colour of its own."""
    mesh_without_wires = build_mesh("utah-teapot", resolution=(4, 4))
    mesh = build_mesh("utah-teapot", resolution=(4, 4), isocurves=(2, 2), wires="tubes")
    check_sound(mesh)
    assert mesh.parts[:-1] == mesh_without_wires.parts
    assert mesh.parts[-1].color == COLOR
    count = len(mesh_without_wires.positions)
    np.testing.assert_array_equal(mesh.positions[:count], mesh_without_wires.positions)
    np.testing.assert_array_equal(
        mesh.triangles[: len(mesh_without_wires.triangles)], mesh_without_wires.triangles
    )
    assert mesh.report.closure == mesh_without_wires.report.closure


def test_wires_of_a_surface_with_colors_have_their_own_color() -> None:
    mesh = build_mesh("heated-panel", resolution=(4, 4), isocurves=(2, 2), wires="tubes")
    mesh_without_wires = build_mesh("heated-panel", resolution=(4, 4))
    assert mesh.colors is not None
    count = len(mesh_without_wires.positions)
    np.testing.assert_array_equal(mesh.colors[:count], mesh_without_wires.colors)
    np.testing.assert_array_equal(mesh.colors[count:], [COLOR[: mesh.colors.shape[1]]] * (
        len(mesh.positions) - count))  # fmt: skip
    assert mesh.parts[-1].color is None
    ((name, values),) = mesh.attributes
    assert name == "temperature"
    assert len(values) == len(mesh.positions)


def test_the_default_width_is_1_300th_of_the_diagonal() -> None:
    """The box of the control points of the sphere is a cube with edges of length 2."""
    model = lower_patches("sphere")
    assert find_width(model, MeshOptions()) == pytest.approx(np.sqrt(12) / 300)
    assert find_width(model, MeshOptions(wire_width=0.25)) == 0.25


def test_a_group_has_the_wires_of_its_members() -> None:
    """The parts of wires have the names of the members."""
    mesh = build_mesh("tea-service", isocurves=(1, 1), wires="tubes", resolution=(2, 2))
    names = [part.name for part in mesh.parts if part.name.endswith(f"/{NAME}")]
    assert names[:2] == [f"tray/{NAME}", f"teapot/{NAME}"]
