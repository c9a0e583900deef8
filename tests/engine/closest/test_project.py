"""Closest points, compared with exhaustive searches, exact fractions and formulas."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from oracles import quadrics
from oracles.closest import find_nearest, least_distance
from oracles.exact import to_exact_net
from oracles.sheets import Array, bernstein, build_bezier_sheet, build_sheets
from service.engine.cells.tree import WorkLimits
from service.engine.closest.project import (
    LIMITS,
    ProjectQuery,
    project_on_curve,
    project_on_surface,
)
from service.engine.models import to_patches
from service.engine.points.surface_columns import Columns, surface_columns
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.examples.catalogue import find
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng

SPLINEPY_389 = np.array(
    [
        [[0.0, 0.0, 0], [0.0, 0.2, 0], [0.0, 1.0, 0]],
        [[0.2, -1.0, 0], [0.2, 0.2, 0], [0.2, 2.0, 0]],
        [[2.0, 0.0, 0], [1.5, 0.2, 0], [1.0, 1.0, 0]],
    ]
)
"""The net of issue 389 of splinepy: Newton's method from fixed starting points misses 19 of 100
points of it."""


def project(
    surface: SurfaceKind, points: Array, tolerance: float = 1e-9, limits: WorkLimits = LIMITS
) -> Columns:
    """The closest points of a surface.

    `tolerance` is the largest width of intervals of distances, in diagonals of the bounding box.
    """
    return project_on_surface(
        to_patches(surface.lower()), ProjectQuery(points, tolerance, limits=limits)
    )


def scatter_points(surface: SurfaceKind, count: int, seed: int = 0) -> Array:
    """Random points near the surface, far from it, and on it."""
    low, high = to_patches(surface.lower()).bounds
    diagonal = np.linalg.norm(high - low)
    near_points, far_points = (
        RNG(seed).uniform(low - margin, high + margin, (count // 3, 3))
        for margin in (0.3 * diagonal, 4 * diagonal)
    )
    samples = np.concatenate([s.at(s.samples(100)) + s.origin for s in build_sheets(surface)])
    surface_points = RNG(seed).permutation(samples)[: count - len(near_points) - len(far_points)]
    return np.concatenate([near_points, far_points, surface_points])


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_an_exhaustive_search_finds_no_point_nearer_than_the_interval(name: str) -> None:
    surface = FAMILIES[name].surface(seed=77)
    points = scatter_points(surface, 21)
    columns = project(surface, points)
    low, high = columns["distance_bounds"].T
    slack = 1e-14 * np.abs(points).max()
    nearest = find_nearest(build_sheets(surface), points, samples=3000, starts=2, steps=30)
    assert (nearest >= low - slack).all()
    assert columns["reached"].all()
    assert (low <= columns["distances"]).all()
    assert (columns["distances"] <= high).all()
    distances = np.linalg.norm(columns["positions"] - points, axis=1)
    np.testing.assert_allclose(distances, columns["distances"], rtol=1e-12, atol=8 * slack)


@pytest.mark.parametrize(
    ("name", "quadric"),
    [("sphere", quadrics.sphere), ("torus", quadrics.torus)],
)
def test_distances_of_quadrics_agree_with_formulas(
    name: str, quadric: Callable[[Array], tuple[Array, Array]]
) -> None:
    """`quadric` computes signed distances from the surface, and normals."""
    points = RNG(1).uniform(-2, 2, (300, 3))
    columns = project(find(name).surface(), points)
    residuals, normals = quadric(columns["positions"])
    np.testing.assert_allclose(residuals, 0, atol=1e-14)
    expected_distance = np.abs(quadric(points)[0])
    low, high = columns["distance_bounds"].T
    assert ((low <= expected_distance + 1e-15) & (expected_distance - 1e-15 <= high)).all()
    np.testing.assert_allclose(columns["normals"], normals, atol=1e-7)
    assert not columns["tied"].any()
    assert not columns["on_boundary"].any()


def test_intervals_overlap_those_from_exact_fractions() -> None:
    surface = FAMILIES["bicubic, wild"].surface(seed=3)
    assert isinstance(surface, BezierSurface)
    points = RNG(2).uniform(-0.5, 1.5, (4, 3))
    for point, (low, high) in zip(points, project(surface, points)["distance_bounds"], strict=True):
        exact_low, exact_high = least_distance(
            [to_exact_net(surface.control_net)], point.tolist(), 2e-3
        )
        assert low <= exact_high
        assert exact_low <= high


def test_all_points_of_a_difficult_net_are_found() -> None:
    u, v = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(0, 1, 10)], indexing="ij"))
    points = build_bezier_sheet(SPLINEPY_389).at(np.stack([u, v], axis=1))
    points += build_bezier_sheet(SPLINEPY_389).origin
    columns = project(BezierSurface(SPLINEPY_389), points)
    assert columns["reached"].all()
    assert columns["distances"].max() < 1e-11
    # The surface folds at one corner, where other parameters have the same point.
    assert (np.abs(columns["uv"] - np.stack([u, v], axis=1)) > 1e-7).any(axis=1).sum() <= 1


def test_the_interval_for_the_centre_of_a_sphere_is_wider_than_the_tolerance() -> None:
    columns = project(find("sphere").surface(), np.array([[0.0, 0, 0], [0, 0, 0.5]]))
    low, high = columns["distance_bounds"].T
    assert columns["reached"].tolist() == [False, True]
    assert columns["tied"].tolist() == [True, False]  # at a pole, all parameters have one point
    assert low[0] <= 1 <= high[0] <= low[0] + 0.01
    np.testing.assert_allclose(columns["positions"][1], [0, 0, 1], atol=1e-9)


def test_intervals_are_wider_but_right_if_the_budget_ends() -> None:
    near_centre = RNG(5).normal(0, 1e-3, (100, 3))
    points = np.concatenate([near_centre, RNG(6).uniform(-2, 2, (300, 3))])
    limits = replace(LIMITS, pairs=100 * len(points))
    columns = project(find("sphere").surface(), points, limits=limits)
    low, high = columns["distance_bounds"].T
    expected_distance = np.abs(quadrics.sphere(points)[0])
    assert ((low <= expected_distance + 1e-15) & (expected_distance - 1e-15 <= high)).all()
    assert not columns["reached"][:100].any()
    assert columns["reached"][100:].mean() > 0.95  # only the points with the most pairs end early
    # A second run ends at the same pairs.
    second_bounds = project(find("sphere").surface(), points, limits=limits)["distance_bounds"]
    np.testing.assert_array_equal(second_bounds, columns["distance_bounds"])


@pytest.mark.parametrize(("point_distance", "tolerance"), [(1e3, 1e-12), (1e9, 1e-9), (1e30, 1e-3)])
def test_cells_are_not_halved_if_rounding_limits_the_interval(
    point_distance: float, tolerance: float
) -> None:
    """Earlier, cells were halved without effect: 200 points took more than a minute."""
    points = RNG(4).normal(size=(40, 3)) * point_distance
    limits = replace(LIMITS, pairs=100 * len(points))
    columns = project(find("sphere").surface(), points, tolerance, limits)
    low, high = columns["distance_bounds"].T
    expected_distance = np.abs(quadrics.sphere(points)[0])
    assert (
        (low <= expected_distance * (1 + 1e-15)) & (expected_distance * (1 - 1e-15) <= high)
    ).all()
    assert (high - low <= np.maximum(1e-11, 1e-14 * expected_distance)).all()


def test_the_distance_of_a_surface_that_is_one_point_is_right() -> None:
    surface = BezierSurface(np.ones((3, 3, 3)))
    columns = project(surface, np.array([[1.0, 1, 3], [1, 1, 1]]))
    np.testing.assert_allclose(columns["distance_bounds"], [[2, 2], [0, 0]], atol=1e-13)


def test_ties_are_marked_and_the_first_patch_is_taken() -> None:
    square = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]])
    vertices = np.concatenate([square, square + np.array([0, 0, 2])])
    surface = PatchSurface(vertices, np.arange(8).reshape(2, 2, 2))
    columns = project(surface, np.array([[0.25, 0.5, 1.0], [0.25, 0.5, 0.999], [2, 0.5, 3]]))
    assert columns["tied"].tolist() == [True, False, False]
    assert columns["patch"].tolist() == [0, 0, 1]
    assert columns["on_boundary"].tolist() == [False, False, True]
    np.testing.assert_allclose(columns["uv"], [[0.25, 0.5], [0.25, 0.5], [1, 0.5]], atol=1e-9)


@pytest.mark.parametrize("degrees", [(2, 2), (2, 4), (5, 3)])
def test_a_border_between_nearly_equal_sides_is_no_boundary(degrees: tuple[int, int]) -> None:
    surfaces = []
    for first, degree in enumerate(degrees):
        x, y = np.meshgrid(first + np.linspace(0, 1, 3), np.linspace(0, 1, degree + 1))
        net = np.stack([x, y, np.zeros_like(x)], axis=-1)
        surfaces.append(BezierSurface(net + 1e-13 * RNG(degree).normal(size=net.shape)))
    columns = project(MultipatchSurface(tuple(surfaces)), np.array([[1, 0.5, 1.0], [0, 0.5, 1]]))
    assert columns["on_boundary"].tolist() == [False, True]


@pytest.mark.parametrize("turn", range(4))
def test_a_side_beside_pieces_of_others_is_open_where_no_piece_is(turn: int) -> None:
    """The side x = 1 of a square 1 × 2 has a unit square beside it, from y = 0 to y = 1."""
    large, small = (
        np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1)[:, :, 0]
        for x, y in (([0.0, 1], [0.0, 2]), ([1.0, 2], [0.0, 1]))
    )
    for _ in range(turn):  # another side of the patch each time, in both orders of u and v
        large = large[::-1].swapaxes(0, 1)
    surface = MultipatchSurface((BezierSurface(large), BezierSurface(small)))
    points = np.array([[1, 0.5, 1.0], [1, 1.5, 1], [1, 1, 1], [1, 0, 1], [0, 0.5, 1], [2, 0.3, 1]])
    columns = project(surface, points)
    assert columns["on_boundary"].tolist() == [False, True, True, True, True, True]


@pytest.mark.slow
def test_closest_points_do_not_depend_on_other_points() -> None:
    for name in ("rational", "triangles", "NURBS"):
        surface = FAMILIES[name].surface(seed=5)
        points = scatter_points(surface, 30)
        all_columns = project(surface, points)
        single_columns = [project(surface, point[np.newaxis]) for point in points[::9]]
        # The cache of cells is too small for all.
        with_small_cache = project(surface, points, limits=replace(LIMITS, bytes=1 << 17))
        for column, values in all_columns.items():
            np.testing.assert_array_equal(
                np.concatenate([a[column] for a in single_columns]), values[::9]
            )
            if all_columns["reached"].all() and with_small_cache["reached"].all():
                np.testing.assert_array_equal(with_small_cache[column], values)


def test_parameters_give_the_positions_of_closest_points() -> None:
    surface = FAMILIES["B-splines"].surface(seed=4)
    assert isinstance(surface, BsplineSurface)
    (sheet,) = build_sheets(surface)
    columns = project(surface, scatter_points(surface, 90))
    positions = sheet.at(columns["uv"]) + sheet.origin
    np.testing.assert_allclose(positions, columns["positions"], atol=1e-13)


def test_intervals_for_very_far_points_are_finite() -> None:
    surface = BezierSurface(FAMILIES["bicubic, moderate"].surface(seed=1).control_net * 1e-30)
    columns = project(surface, np.array([[3e38, 0, 0], [1e-31, 0, 0], [0, 0, 1e-20]]))
    low, high = columns["distance_bounds"].T
    assert np.isfinite(columns["distance_bounds"]).all()
    assert (low <= high).all()
    # The tolerance is 1e-9 of a diagonal of about 1e-30: less than rounding if a point is far away.
    assert columns["reached"].tolist() == [False, True, False]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("is_rational", [False, True])
def test_closest_points_of_curves_agree_with_fine_samples(
    dimension: int, is_rational: bool
) -> None:
    rng = RNG(dimension)
    polygon = rng.uniform(-1, 1, (9, dimension))
    weights = rng.uniform(0.2, 5, 9) if is_rational else None
    curve = BsplineCurve(polygon, 3, "clamped", weights).lower()
    points = rng.uniform(-2, 2, (50, dimension))
    columns = project_on_curve(curve, ProjectQuery(points))
    t = np.linspace(0, 1, 5001)
    basis = bernstein(3)(t)
    best = np.full(len(points), np.inf)
    for k, net in enumerate(curve.points):
        piece_weights = np.ones(4) if curve.weights is None else curve.weights[k]
        line = (basis * piece_weights) @ net / (basis @ piece_weights)[:, np.newaxis]
        distances = np.linalg.norm(points[:, np.newaxis] - line, axis=2)
        best = np.minimum(best, distances.min(axis=1))
    low, high = columns["distance_bounds"].T
    assert columns["reached"].all()
    assert (low <= best).all()
    assert (best <= high + 1e-3).all()
    # The curve has six spans, so its domain is [0, 6]. At an inner parameter, the vector to the
    # closest point is perpendicular to the tangent.
    is_inner = (columns["parameters"] > 0) & (columns["parameters"] < 6)
    tangential_parts = ((points - columns["positions"]) * columns["tangents"]).sum(axis=1)
    assert np.abs(tangential_parts[is_inner]).max() < 1e-6


def test_a_budget_of_additions_for_halving_makes_intervals_wider() -> None:
    surface, points = BezierSurface(RNG(2).random((25, 25, 3))), RNG(3).random((5, 3))
    without_limit = project(surface, points)
    columns = project(surface, points, limits=replace(LIMITS, additions=1_000_000))
    assert without_limit["reached"].all()
    assert not columns["reached"].all()
    low, high = columns["distance_bounds"].T
    narrow_low, narrow_high = without_limit["distance_bounds"].T
    assert (low <= narrow_low).all()
    assert (narrow_high <= high + 1e-12).all()


def test_normals_at_a_collapsed_side_of_a_triangle_are_normals_of_a_cone() -> None:
    """Near the side r = 0, which is the point `top`, the patch is to first order a cone.

    The row of control points beside the side is top + c_k. The cone has the apex `top` and is over
    the curve top + D(t) with D(t) = Σ c_k B_k²(t); its normal is D' × D.
    """
    top, c = np.array([0.0, 0, 1]), np.array([[1.0, 0, -1], [1, 1, -1], [0, 1, -1]])
    rows = [[2, 2, -1], [2, 0.5, -0.5], top + c[0], top, [0.5, 2, -0.5], top + c[1], top]
    net = np.array([*rows, top + c[2], top, top])
    t = np.array([0.25, 0.5, 0.7])
    local = np.stack([1 - t, t], axis=1)
    no_partials = np.full((3, 3), np.nan)  # so all normals are computed as limits
    model = to_patches(TriangleSurface(net).lower())
    patch = np.zeros(3, np.intp)
    result = surface_columns(model, patch, local, no_partials, no_partials)["normals"]
    basis = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2], axis=1)
    slope = np.stack([2 * t - 2, 2 - 4 * t, 2 * t], axis=1)
    normals = np.cross(slope @ c, basis @ c)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(result, normals, atol=1e-7)


@pytest.mark.parametrize("size", [1e-60, 1e-160, 1e-300, 5e-324])
@pytest.mark.parametrize("surface", ["sphere", "saddle"])
def test_points_very_far_from_a_tiny_surface_have_finite_distances(
    surface: str, size: float
) -> None:
    # At sizes up to 1e-160, squares of the points in units of the surface exceed all doubles.
    points = np.array([[0.0, 0, 1], [-1e30, 2e30, 0], [3e38, 3e38, -3e38]])
    batch = to_patches(find(surface).surface().lower()).batches[0]
    tiny = BezierSurface(batch.points[0] * size)  # the sphere's weights are left out
    columns = project_on_surface(to_patches(tiny.lower()), ProjectQuery(points, sign=True))
    expected = np.linalg.norm(points, axis=1)
    low, high = columns["distance_bounds"].T
    assert np.all((low <= expected) & (expected <= high))
    assert np.all(high - low <= 1e-14 * expected)
    np.testing.assert_allclose(columns["distances"], expected, 1e-15)
    assert np.all(np.abs(columns["positions"]) <= 4 * size)


def test_a_point_very_far_away_is_projected_in_its_direction() -> None:
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    tiny = to_patches(BezierSurface(net * 1e-200).lower())
    points = np.array([[-1.0, 2, 0], [3, -1, 5], [0.25e-200, 0.5e-200, 2e-200]])
    columns = project_on_surface(tiny, ProjectQuery(points))
    np.testing.assert_array_equal(columns["uv"], [[0, 1], [1, 0], [0.25, 0.5]])
    assert columns["reached"].tolist() == [False, False, True]
    assert columns["distances"][2] == pytest.approx(2e-200)


def test_points_very_far_from_a_tiny_curve_have_finite_distances() -> None:
    points = np.array([[0.0, 0], [1e-300, 0], [2e-300, 1e-300]])
    columns = project_on_curve(
        BezierCurve(points).lower(), ProjectQuery(np.array([[3.0, 4.0], [-3e38, 0]]))
    )
    assert columns["distances"].tolist() == [5.0, 3e38]
    assert columns["parameters"].tolist() == [1.0, 0.0]
