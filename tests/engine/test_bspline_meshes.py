"""Meshes of B-splines: seams, creases, discontinuous surfaces, parameters."""

from fractions import Fraction

import numpy as np
import pytest

from oracles.splines import basis_values, to_fractions
from service.bases import knots
from service.bases.arrays import RealArray
from service.engine.mesh.mesh import Mesh
from service.surface.bspline import BsplineSurface
from tests.engine.meshing import build_mesh, check_sound, find_topology
from tests.spline_strategies import random_points, random_weights
from tests.strategies import Array


def build_field(rows: int, columns: int) -> Array:
    """A control net over a grid in x and y; the surface has no folds, and its normals point up."""
    net = random_points(rows, 11, columns)  # 11 is the seed
    net[..., 0], net[..., 1] = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    net[..., 2] /= 8
    return net


def build_roof(rows: int, columns: int) -> Array:
    """The control net of a roof whose ridge is the middle row."""
    net = build_field(rows, columns)
    net[..., 2] -= 3 * np.abs(net[..., 0] - rows // 2)
    return net


def pair_normals(mesh: Mesh) -> tuple[RealArray, RealArray]:
    """Normals (n, 3) of vertices that repeat a position, and of the first vertices there."""
    assert mesh.normals is not None
    if mesh.welds is None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    repeated = np.flatnonzero(mesh.welds != np.arange(len(mesh.welds)))
    return mesh.normals[repeated], mesh.normals[mesh.welds[repeated]]


def test_a_knot_of_multiplicity_p_is_a_crease() -> None:
    """Each position on the line of this knot has two normals, every other position has one."""
    vector = np.array([0, 0, 0, 0, 1, 2, 2, 2, 3, 4, 4, 4, 4.0])
    surface = BsplineSurface(build_roof(9, 6), (3, 3), (vector, "clamped"))
    mesh = build_mesh(surface.lower(), resolution=(2, 3))
    check_sound(mesh)
    repeated, first = pair_normals(mesh)
    # The line crosses three spans of three divisions each.
    assert len(repeated) == 3 * 3 + 1
    assert (repeated * first).sum(axis=1).max() < np.cos(np.radians(1))
    assert find_topology(mesh).components == 1


@pytest.mark.parametrize("is_rational", [False, True])
def test_a_knot_of_multiplicity_p_plus_one_separates_the_surface(is_rational: bool) -> None:
    """The mesh has two components, and the report counts the edges of both borders."""
    net = build_field(8, 5)
    net[4:, :, 2] += 1
    weights = random_weights(8, 2, 5) if is_rational else None
    vector = np.array([0, 0, 0, 0, 2, 2, 2, 2, 5, 5, 5, 5.0])
    surface = BsplineSurface(net, (3, 2), (vector, "clamped"), weights)
    mesh = build_mesh(surface.lower(), resolution=(3, 2))
    check_sound(mesh)
    assert find_topology(mesh).components == 2
    assert not mesh.report.watertight
    # Each of the two parts has 1 × 3 spans of 3 × 2 divisions, and so two sides with 3 edges and
    # two sides with 3 · 2 edges.
    assert mesh.report.boundary_edges == 2 * 2 * (3 + 3 * 2)


@pytest.mark.parametrize("is_float32", [False, True])
@pytest.mark.parametrize("is_rational", [False, True])
def test_surfaces_of_two_requests_have_equal_positions_on_a_common_border(
    is_rational: bool, is_float32: bool
) -> None:
    """Positions are equal bit for bit; the second surface has the border in reverse direction.

    The surfaces differ in size, in the degree across the border, and in all other control points.
    """
    left, right = build_field(7, 6), build_field(5, 6)[:, ::-1]
    left_weights, right_weights = random_weights(7, 1, 6), random_weights(5, 2, 6)
    right[0], right_weights[0] = left[-1, ::-1], left_weights[-1, ::-1]
    vector = np.array([0, 0, 0, 0, 0.3125, 0.75, 1, 1, 1, 1])
    first = BsplineSurface(left, (2, 3), ("clamped", vector), left_weights if is_rational else None)
    second = BsplineSurface(
        right, (4, 3), ("clamped", 1 - vector[::-1]), right_weights if is_rational else None
    )
    first_positions = build_mesh(
        first.lower(), resolution=(3, 5), is_float32=is_float32, weld=False
    ).positions
    second_positions = build_mesh(
        second.lower(), resolution=(2, 5), is_float32=is_float32, weld=False
    ).positions
    # The axes are: patch along u, patch along v, sample along u, sample along v, coordinate.
    first_border = first_positions.reshape(5, 3, 4, 6, 3)[-1, :, -1].reshape(-1, 3)
    second_border = second_positions.reshape(1, 3, 3, 6, 3)[0, :, 0].reshape(-1, 3)
    assert first_border.tobytes() == second_border[::-1].copy().tobytes()


@pytest.mark.parametrize("weld", [False, True])
def test_uvs_are_parameters_of_the_domain(weld: bool) -> None:
    """On a seam inside the domain, both patches give equal parameters, so that vertices merge."""
    vector = np.array([-1, -1, -1, 0.1, 0.7, 2, 2, 2])
    surface = BsplineSurface(build_field(5, 5), (2, 3), (vector, "uniform"))
    mesh = build_mesh(surface.lower(), resolution=(2, 3), uvs=True, weld=weld)
    assert mesh.uvs is not None
    if weld:
        assert len(mesh.positions) == (3 * 2 + 1) * (2 * 3 + 1)
        assert len(np.unique(mesh.uvs[:, 0])) == 7
        assert len(np.unique(mesh.uvs[:, 1])) == 7
    assert np.isin([-1, 0.1, 0.7, 2], mesh.uvs[:, 0]).all()
    for (u, v), position in zip(mesh.uvs, mesh.positions, strict=True):
        basis_u, basis_v = (
            np.array(basis_values(to_fractions(each), degree, Fraction(t)), dtype=float)
            for each, degree, t in ((vector, 2, u), (knots.uniform_knots(5, 3), 3, v))
        )
        expected = np.einsum("i,j,ijd->d", basis_u, basis_v, surface.control_net)
        np.testing.assert_allclose(position, expected, atol=1e-13)


def test_on_the_seam_of_a_closed_surface_uvs_have_both_ends_of_the_domain() -> None:
    """A position there has a vertex with the first and a vertex with the last parameter."""
    mesh = build_mesh("bspline-ring", resolution=(2, 2), uvs=True)
    assert mesh.uvs is not None
    assert mesh.welds is not None
    # The surface has 10 × 6 spans of 2 × 2 divisions.
    assert len(np.unique(mesh.welds)) == 10 * 2 * 6 * 2
    assert len(mesh.positions) == (10 * 2 + 1) * (6 * 2 + 1)
    assert (mesh.uvs.min(axis=0) == 0).all()
    assert mesh.uvs.max(axis=0).tolist() == [10, 6]
    assert mesh.report.watertight


def test_the_control_net_overlay_is_the_net_of_the_request() -> None:
    """The overlay is the net of the surface, not of patches; a periodic direction closes."""
    net = build_field(5, 6)
    surface = BsplineSurface(net, (2, 3), ("clamped", "periodic"), random_weights(5, 3, 6))
    mesh = build_mesh(surface.lower(), resolution=(2, 2), overlays=("control_net", "boundary"))
    overlay, _ = mesh.overlays
    closed_net = np.concatenate([net, net[:, :1]], axis=1)
    np.testing.assert_array_equal(overlay.positions, closed_net.reshape(-1, 3))
    assert len(overlay.segments) == 4 * 7 + 5 * 6
    assert overlay.cells is not None
    assert len(overlay.cells) == 4 * 6
