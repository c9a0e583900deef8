"""The built-in B-splines have the properties that their descriptions state."""

import numpy as np
import pytest

from oracles.topology import volume
from service.engine.accuracy import Accuracy
from service.engine.connectivity.closure import Closure, find_closure
from service.engine.connectivity.connect import connect
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.multipatch import MultipatchSurface
from tests.engine.meshing import build_mesh, check_sound, check_winding, find_topology, to_triangles


def find_spline(example: str) -> BsplineSurface:
    """The built-in surface with this id, which must be a B-spline."""
    surface = find(example).surface()
    assert isinstance(surface, BsplineSurface)
    return surface


def test_every_horizontal_section_of_the_goblet_is_a_circle() -> None:
    """The distance from the axis and the height depend only on v."""
    surface = find_spline("nurbs-goblet")
    model = surface.lower()
    assert find_closure(model, connect(model).connectivity) == Closure("C1", None)
    mesh = build_mesh("nurbs-goblet", resolution=(5, 4), weld=False)
    # The axes are: patch along u, patch along v, sample along u, sample along v, coordinate.
    grid = mesh.positions.reshape(4, 11, 6, 5, 3)
    radius, height = np.hypot(grid[..., 0], grid[..., 1]), grid[..., 2]
    for values in (radius, height):
        np.testing.assert_allclose(
            values, np.broadcast_to(values[:1, :, :1], values.shape), atol=1e-14
        )


def test_the_goblet_is_a_solid_with_two_sharp_edges() -> None:
    """Normals point out; only positions on the edges of foot and rim have two normals."""
    mesh = build_mesh("nurbs-goblet", resolution=(6, 6))
    check_sound(mesh)
    check_winding(mesh)
    assert mesh.report.watertight
    assert find_topology(mesh).euler == 2
    assert 0.5 < volume(mesh.positions, to_triangles(mesh)) < 3
    assert mesh.welds is not None
    assert mesh.normals is not None
    repeated = np.flatnonzero(mesh.welds != np.arange(len(mesh.welds)))
    assert sorted({round(z, 9) for z in mesh.positions[repeated, 2]}) == [0.0, 2.5]
    assert len(repeated) == 2 * 24  # two circles of 4 patches with 6 divisions
    # The poles are the middle of the foot and the bottom of the cup.
    for z, normal_z in ((0.0, -1.0), (1.32, 1.0)):
        (pole,) = np.flatnonzero((mesh.positions == (0, 0, z)).all(axis=1))
        np.testing.assert_allclose(mesh.normals[pole], (0, 0, normal_z), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "min_volume", "max_volume"), [("swept-wing", 17, 19), ("ship-hull", 645, 665)]
)
def test_models_of_several_splines_are_solids(
    example: str, min_volume: float, max_volume: float
) -> None:
    """Meshes by resolution and by tolerance are watertight, and their normals point out."""
    mesh = build_mesh(example, resolution=(4, 4))
    check_winding(mesh)
    for each in (mesh, build_mesh(example, accuracy=Accuracy(relative_tolerance=1e-3))):
        check_sound(each)
        assert each.report.watertight
        assert min_volume < volume(each.positions, to_triangles(each)) < max_volume


def test_the_port_side_of_the_hull_mirrors_the_starboard_side() -> None:
    hull = find("ship-hull").surface()
    assert isinstance(hull, MultipatchSurface)
    nets = {each.name: each.control_net for each in hull.surfaces}
    # In the starboard nets u and v are exchanged, so that the normals of both sides point out.
    for end in ("aft", "fore"):
        port = nets[f"starboard {end}"].swapaxes(0, 1) * (1, -1, 1)
        np.testing.assert_array_equal(port, nets[f"port {end}"])
