"""Signs of distances, compared with formulas, and with solid angles of fine meshes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from oracles import quadrics
from oracles.sheets import Array, bernstein
from service.engine.build import build
from service.engine.cells import chord_models
from service.engine.cells.cells import NetCells
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.joining.join import join
from service.engine.models import to_patches
from service.engine.nets.query_nets import surface_nets
from service.engine.options import MeshOptions
from service.engine.points.surface_columns import Columns
from service.engine.signs.signs import LIMITS, WELD_TOLERANCE, compute_signs
from service.surface.batches import TensorPatches
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import Part, PatchModel
from service.surface.member import Member
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng


def project(model: PatchModel, points: Array) -> Columns:
    """The closest points and their signs."""
    return project_on_surface(model, ProjectQuery(points, sign=True))


@pytest.mark.parametrize(
    ("name", "quadric"), [("sphere", quadrics.sphere), ("torus", quadrics.torus)]
)
def test_signs_of_quadrics_are_right_near_and_far_from_them(
    name: str, quadric: Callable[[Array], tuple[Array, Array]]
) -> None:
    """`quadric` computes signed distances and normals. On the surface, signs are NaN."""
    points = RNG(1).uniform(-1.6, 1.6, (200, 3))
    distances, normals = quadric(points)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    closest_points = points - distances[:, np.newaxis] * normals
    near_points = closest_points + normals * RNG(2).choice([-1e-3, 1e-3, -1e-7, 1e-7], (200, 1))
    columns = project(build_model(name), np.concatenate([points, near_points, closest_points]))
    expected = np.sign(quadric(np.concatenate([points, near_points]))[0])
    np.testing.assert_array_equal(columns["signs"][:400], expected)
    is_on_surface = columns["distance_bounds"][400:, 0] == 0
    assert is_on_surface.mean() > 0.9  # the others are beside the surface because of rounding
    assert np.isnan(columns["signs"][400:][is_on_surface]).all()


def compute_solid_angles(triangles: Array, points: Array) -> Array:
    """For each point, the sum of the solid angles of triangles (T, 3, 3), ÷ 4π."""
    total = np.zeros(len(points))
    for k, x in enumerate(points):
        a, b, c = (triangles - x).transpose(1, 0, 2)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        denominator = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la
        denominator += (c * a).sum(axis=1) * lb
        total[k] = np.arctan2(volume, denominator).sum() / (2 * np.pi)
    return total


SPHERE = to_patches(find("sphere").surface().lower())


def turn_inside_out(patches: TensorPatches, factor: float = 1.0) -> TensorPatches:
    """The patches, scaled by `factor`, with u and v exchanged, so that normals are reversed."""
    assert patches.weights is not None
    return TensorPatches(factor * patches.points.swapaxes(1, 2), patches.weights.swapaxes(1, 2))


def add_patches(*more_batches: TensorPatches) -> PatchModel:
    """A model of the sphere and of more patches."""
    batches = (SPHERE.batches[0], *more_batches)
    return PatchModel("patches", batches, (Part("all", 0, sum(b.count for b in batches)),))


def build_model(name: str) -> PatchModel:
    """One of two combined models, or an example."""
    (ball,) = SPHERE.batches
    assert isinstance(ball, TensorPatches)
    if name == "a hollow ball":
        return add_patches(turn_inside_out(ball, 0.5))
    if name == "two balls that overlap, one mirrored":
        placement = np.diag([1, 1, -0.7, 1.0])
        placement[0, 3] = 1
        sphere = find("sphere").surface()
        assert not isinstance(sphere, GroupSurface)
        group = GroupSurface((Member(sphere), Member(sphere, matrix=placement)))
        return to_patches(group.lower())
    return to_patches(find(name).surface().lower())


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "bspline-ring",
        "cone",
        "nurbs-goblet",
        "octahedral-sphere",
        "rounded-box",
        "a hollow ball",
        "two balls that overlap, one mirrored",
    ],
)
def test_signs_agree_with_solid_angles_of_a_fine_mesh(name: str) -> None:
    model = build_model(name)
    mesh = build(model, MeshOptions(resolution=(12, 12)))
    vertices = mesh.positions + mesh.origin
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    points = RNG(3).uniform(1.1 * low - 0.1 * high, 1.1 * high - 0.1 * low, (40, 3))
    columns = project(model, points)
    # Nearer to the surface, a point may be inside the surface and outside the mesh.
    is_far = columns["distances"] > 0.02 * np.linalg.norm(high - low)
    winding_number = np.rint(compute_solid_angles(vertices[mesh.triangles], points[is_far]))
    np.testing.assert_array_equal(columns["signs"][is_far], np.where(winding_number != 0, -1, 1))
    assert set(columns["signs"]) == {-1, 1}


def build_grid(net: Array, divisions: int) -> Array:
    """Points (d+1, d+1, 3) of a net (p+1, q+1, 4)."""
    t = np.linspace(0, 1, divisions + 1)
    rows, columns, _ = net.shape
    x = np.einsum("ai,bj,ijk->abk", bernstein(rows - 1)(t), bernstein(columns - 1)(t), net)
    return np.asarray(x[..., :3] / x[..., 3:])


def test_bounds_of_solid_angles_hold() -> None:
    """Compares the solid angles of cells of a patch with those of their models (`chord_models`).

    A cell is approximated by fine triangles. Its model has the two triangles over its corners, a
    ball that contains it, and a bound of the area between its sides and their chords. Both are seen
    from points at a distance of 0.2 radii from the ball. There the bound of the area ÷ distance²
    bounds the difference of the two solid angles.
    """
    surface = FAMILIES["rational"].surface(seed=4)
    (group,) = surface_nets(to_patches(surface.lower()).batches).groups
    rectangle = np.repeat([[0.0], [1.0], [0.0], [1.0]], len(group.nets), axis=1)
    cells = NetCells(rectangle, group.nets.transpose(1, 2, 3, 0)).halve_along((0, 1))
    for k, net in enumerate(np.moveaxis(cells.nets, -1, 0)):
        # Each cell comes from two halvings; control points are at most 1 from the origin.
        model = chord_models.chord_models(net[..., np.newaxis], np.array([2]), 1.0)[:, 0]
        center, radius = model[:3], model[3]
        a, b, c, d = model[chord_models.CORNERS :].reshape(4, 3)
        coarse = np.array([[a, b, c], [a, c, d]])
        grid = build_grid(net, 40)
        a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        halves = (a, b, c), (a, c, d)
        fine = np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 3) for half in halves])
        assert np.linalg.norm(grid - center, axis=2).max() <= radius
        directions = RNG(k).normal(size=(8, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        x = center + directions * radius * 1.2
        difference = (
            4 * np.pi * np.abs(compute_solid_angles(fine, x) - compute_solid_angles(coarse, x))
        )
        area_bound = model[chord_models.AREA]
        # 1e-4 allows for the errors of the fine triangles.
        assert (difference <= area_bound / (0.2 * radius) ** 2 + 1e-4).all()


def test_open_and_inconsistent_surfaces_have_no_signs() -> None:
    (ball,) = SPHERE.batches
    assert isinstance(ball, TensorPatches)
    first_patch = TensorPatches(ball.points[:1], None if ball.weights is None else ball.weights[:1])
    remaining_patches = TensorPatches(
        ball.points[1:], None if ball.weights is None else ball.weights[1:]
    )
    parts = (Part("all", 0, ball.count),)
    inner_point = np.array([[0.1, 0.2, 0.3]])
    for batches, is_closed in (
        ((first_patch, remaining_patches), True),
        ((remaining_patches,), False),
        ((turn_inside_out(first_patch), remaining_patches), False),
        ((turn_inside_out(first_patch), turn_inside_out(remaining_patches)), True),  # inside out
    ):
        model = PatchModel("ball", batches, parts)
        assert np.isnan(project(model, inner_point)["signs"][0]) != is_closed


def compute_signs_within(points: Array, **changes: int) -> Array:
    """The signs of points about the sphere, with these limits of work."""
    nets = surface_nets(SPHERE.batches)
    low = np.abs(np.linalg.norm(points, axis=1) - 1) * 0.999 / nets.scale
    joined = join(SPHERE, WELD_TOLERANCE)
    limits = replace(LIMITS, **changes)
    return compute_signs(SPHERE, joined, nets, nets.local(points), low, limits=limits)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_signs_of_few_points_whose_cells_take_too_much_memory_are_right_or_unknown(
    count: int,
) -> None:
    points = np.array([[0.0, 0.0, 0.9999], [0.1, 0.2, 0.9], [0.3, 0.4, 0.8]])[:count]
    for max_bytes in (1 << 12, 1 << 16, 1 << 19):
        signs = compute_signs_within(points, bytes=max_bytes)
        assert (np.nan_to_num(signs, nan=-1) == -1).all()


def test_signs_do_not_depend_on_other_points() -> None:
    points = RNG(7).uniform(-1.5, 1.5, (80, 3))
    all_signs = project(SPHERE, points)["signs"]
    single_signs = [project(SPHERE, point[np.newaxis])["signs"][0] for point in points[::8]]
    np.testing.assert_array_equal(all_signs[::8], single_signs)
    # The cache of cells is too small for all points.
    np.testing.assert_array_equal(all_signs, compute_signs_within(points, bytes=1 << 19))
    # No pair of a point and a cell is allowed: only points outside the bounding box have signs.
    is_outside = np.abs(points).max(axis=1) > 1
    np.testing.assert_array_equal(np.isnan(compute_signs_within(points, pairs=0)), ~is_outside)
