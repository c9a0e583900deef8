"""Isoparametric curves as tubes and ribbons: closed where curves close, and continued across
patches."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import MeshOptions
from service.engine.wires.draw import COLOR, NAME, find_width
from service.engine.wires.isocurves import sample_isocurves
from service.engine.wires.paths import build_wire_paths
from service.pipeline.cost import mesh_size
from service.surface.examples import find
from service.surface.lowered import PatchModel
from tests.engine.meshing import build_mesh, check_sound, check_winding
from tests.examples import lower_patches
from tests.strategies import Array, build_cube, build_model, split_models

SHAPES = ["utah-teapot", "cone", "tveit", "torus", "octahedral-sphere", "bspline-hills"]
"""Poles, an apex, a border, closed circles, triangles, a spline."""


def draw_wires(source: Any, count: int | tuple[int, int] = 2, **options: Any) -> Mesh:
    """The wires alone."""
    counts = (count, count) if isinstance(count, int) else count
    return build_mesh(source, isocurves=counts, has_faces=False, **options)


def list_paths(model: PatchModel, count: int) -> list[tuple[int, int, bool]]:
    """For each kind of path: the number of paths, their stations, and whether they are closed."""
    runs = sample_isocurves(model, (4, 4), (count, count))
    result = [wires.paths for wires in build_wire_paths(model, runs, np.radians(1))]
    return sorted((*paths.points.shape[:2], paths.closed) for paths in result)


@pytest.mark.parametrize(("weld", "faces"), [(True, "triangles"), (False, "quads")])
@pytest.mark.parametrize("wires", ["tubes", "ribbons"])
@pytest.mark.parametrize("example", SHAPES)
def test_wires_are_sound(example: str, wires: str, weld: bool, faces: str) -> None:
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


def test_tubes_keep_their_distance_from_the_surface() -> None:
    """On a sphere of radius 1 the curves lie on it, the tubes within half their width."""
    mesh = draw_wires("sphere", 4, wires="tubes", wire_width=0.05, wire_sides=12)
    check_winding(mesh)
    distance = np.linalg.norm(mesh.positions, axis=1)
    assert abs(distance - 1).max() < 0.025 + 1e-3
    assert distance.max() > 1.02


def test_ribbons_lie_on_the_surface() -> None:
    """Their normals are the sphere's, their crossbars at right angles to it."""
    mesh = draw_wires("sphere", 3, wires="ribbons", wire_width=0.1, resolution=(8, 8))
    assert mesh.normals is not None
    outwards = np.einsum("vd,vd->v", mesh.normals, mesh.positions)
    assert outwards.min() > 0.99
    np.testing.assert_allclose(
        np.linalg.norm(mesh.positions, axis=1), np.hypot(1, 0.05), atol=1e-12
    )


def test_a_circle_across_patches_is_one_closed_tube() -> None:
    """Circles of four pieces round the cone's side, its rim and its base, no caps."""
    cone = lower_patches("cone")
    # v = ½ on the side and on the base, and the rim; four diameters of the base, eight rulings.
    assert list_paths(cone, 2) == [(3, 17, True), (4, 9, False), (8, 5, False)]
    mesh = draw_wires("cone", (0, 2), wires="tubes", wire_width=0.02, resolution=(4, 4))
    assert len(mesh.positions) == 3 * 16 * 8


def test_lines_run_straight_through_corners() -> None:
    """Meridians of a sphere through its poles; the knot lines of a B-spline from end to end."""
    # Four great circles through the poles, three parallels; each in four pieces of four divisions.
    assert list_paths(lower_patches("sphere"), 2) == [(7, 17, True)]
    hills = lower_patches("bspline-hills")
    assert hills.domain is not None
    u, v = len(hills.domain.u), len(hills.domain.v)
    assert sorted(list_paths(hills, 1)) == sorted(
        [(u, 4 * (v - 1) + 1, False), (v, 4 * (u - 1) + 1, False)]
    )


def test_a_bend_is_mitred_up_to_a_right_angle() -> None:
    """Lines round a cube bend by 90° at its edges, and go round as one tube with square corners."""
    model = build_model(build_cube())
    result = list_paths(model, 2)
    # Three rings of four sides: four times four divisions, and a second station at each bend.
    assert (3, 16 + 1 + 3, True) in result
    mesh = draw_wires(model, 2, wires="tubes", wire_width=0.1, wire_sides=4, resolution=(1, 1))
    check_sound(mesh)
    assert mesh.report.watertight


@given(split_models(oriented=False))
def test_curves_go_on_across_patches(pieces: tuple[Array, list[Array]]) -> None:
    """Lines run through the quarters of one patch without interruption, in any orientation."""
    result = list_paths(build_model(pieces[1]), 2)
    across = sum(count for count, stations, _ in result if stations == 9)
    # Of each direction three borders and two lines between them, through two patches each.
    assert across == 10


def test_wires_stand_beside_the_surface() -> None:
    """The wires are another part with another colour; the surface does not change."""
    alone = build_mesh("utah-teapot", resolution=(4, 4))
    mesh = build_mesh("utah-teapot", resolution=(4, 4), isocurves=(2, 2), wires="tubes")
    check_sound(mesh)
    assert mesh.parts[:-1] == alone.parts
    assert mesh.parts[-1].color == COLOR
    count = len(alone.positions)
    np.testing.assert_array_equal(mesh.positions[:count], alone.positions)
    np.testing.assert_array_equal(mesh.triangles[: len(alone.triangles)], alone.triangles)
    assert mesh.report.closure == alone.report.closure


def test_wires_of_a_coloured_surface_keep_their_colour() -> None:
    mesh = build_mesh("heated-panel", resolution=(4, 4), isocurves=(2, 2), wires="tubes")
    alone = build_mesh("heated-panel", resolution=(4, 4))
    assert mesh.colors is not None
    count = len(alone.positions)
    np.testing.assert_array_equal(mesh.colors[:count], alone.colors)
    np.testing.assert_array_equal(mesh.colors[count:], [COLOR[: mesh.colors.shape[1]]] * (
        len(mesh.positions) - count))  # fmt: skip
    assert mesh.parts[-1].color is None
    ((name, values),) = mesh.attributes
    assert name == "temperature"
    assert len(values) == len(mesh.positions)


def test_the_width_follows_the_size_unless_it_is_given() -> None:
    model = lower_patches("sphere")
    assert find_width(model, MeshOptions()) == pytest.approx(np.sqrt(12) / 300)
    assert find_width(model, MeshOptions(wire_width=0.25)) == 0.25


def test_groups_have_wires_of_their_members() -> None:
    """Wires of members are in place, and have the members' names."""
    mesh = build_mesh("tea-service", isocurves=(1, 1), wires="tubes", resolution=(2, 2))
    names = [part.name for part in mesh.parts if part.name.endswith(f"/{NAME}")]
    assert names[:2] == [f"tray/{NAME}", f"teapot/{NAME}"]
