"""Measures, compared with formulas, fractions and extrapolated polyhedra; and open borders."""

from dataclasses import replace
from math import pi

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles import measures as oracle
from oracles.exact import to_exact_net
from oracles.sheets import build_sheets
from service.engine.measures.integrals import refine
from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.measure import measure
from service.engine.measures.patch_cells import build_cells
from service.engine.measures.values import Interval, MeasureQuery, Measures
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng
MP = mpmath.mp.clone()  # with 50 digits
MP.dps = 50


def measure_surface(
    surface: SurfaceKind, tolerance: float = 1e-6, weld: float = 1e-12, budget: int = 1 << 18
) -> Measures[RequestSide]:
    """The measures of a surface; `budget` is the most control points of all cells."""
    return measure(surface.lower(), MeasureQuery(tolerance, weld, budget))


def contains(interval: Interval | None, expected: object, slack: float = 0.0) -> bool:
    """Whether the interval, widened by `slack`, contains the true value."""
    assert interval is not None
    assert interval.low <= interval.value <= interval.high
    return bool(interval.low - slack <= expected <= interval.high + slack)  # type: ignore[operator]


@pytest.mark.parametrize("scale", [1e-60, 1e-110, 1e-160, 1e-300])
def test_intervals_contain_the_exact_values_if_products_underflow(scale: float) -> None:
    sphere = find_example("sphere")
    result = measure_surface(replace(sphere, vertices=sphere.vertices * scale), 1e-3)
    assert contains(result.area, 4 * MP.pi * MP.mpf(scale) ** 2)
    assert contains(result.volume, 4 / MP.mpf(3) * MP.pi * MP.mpf(scale) ** 3)
    assert result.centroid is not None
    assert all(contains(c, 0) for c in result.centroid)


def find_example(name: str) -> PatchSurface:
    """An example that is made of patches."""
    surface = find(name).surface()
    assert isinstance(surface, PatchSurface)
    return surface


# Areas and volumes are divided by π; `height` is z of the centroid.
@pytest.mark.parametrize(
    ("name", "area", "volume", "height"),
    [
        ("sphere", 4, 4 / MP.mpf(3), 0),
        ("octahedral-sphere", 4, 4 / MP.mpf(3), 0),
        ("torus", 4 * MP.pi * MP.mpf("0.4"), 2 * MP.pi * MP.mpf("0.16"), 0),
        ("cylinder", 6, 2, 0),
        ("cone", 1 + MP.sqrt(5), 2 / MP.mpf(3), -0.5),
    ],
)
def test_measures_of_quadrics_are_right(
    name: str, area: object, volume: object, height: float
) -> None:
    tolerance = 1e-9
    result = measure_surface(find(name).surface(), tolerance)
    # Rounded square roots in nets change the surfaces by some 1e-16.
    for interval, expected in ((result.area, area), (result.volume, volume)):
        exact = expected * MP.pi
        assert contains(interval, exact, 1e-15 * float(exact))
        assert interval is not None
        assert interval.high - interval.low <= tolerance * interval.value
    assert result.reached
    assert result.closed
    assert result.centroid is not None
    assert all(
        contains(interval, coordinate, 1e-15)
        for interval, coordinate in zip(result.centroid, (0, 0, height), strict=True)
    )
    assert not result.boundaries
    assert result.boundary_length == Interval(0.0, 0.0, 0.0)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(0.5, 3)] * 3), st.integers(0, 2**20), st.booleans())
def test_measures_of_ellipsoids_are_right(
    axes: tuple[float, float, float], seed: int, is_mirrored: bool
) -> None:
    # The formula of the area needs a > b > c.
    c, b, a = sorted(axes)
    a, b = max(a, b + 1e-3, c + 2e-3), max(b, c + 1e-3)
    rotation, _ = np.linalg.qr(RNG(seed).normal(size=(3, 3)))
    # First a rotation of determinant 1, then perhaps mirrored.
    rotation *= np.linalg.det(rotation) * (-1 if is_mirrored else 1)
    centre = RNG(seed).uniform(-9, 9, 3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation * [a, b, c], centre
    ellipsoid = GroupSurface((Member(find("octahedral-sphere").surface(), matrix=matrix),))
    # Long ellipsoids need more cells than the other surfaces.
    result = measure_surface(ellipsoid, budget=1 << 20)
    assert contains(result.area, oracle.ellipsoid_area(a, b, c), 1e-14)
    # The normals of a mirrored member still point outwards.
    assert contains(result.volume, 4 / MP.mpf(3) * MP.pi * a * b * c, 1e-13)
    assert result.centroid is not None
    assert all(
        contains(interval, coordinate, 1e-14)
        for interval, coordinate in zip(result.centroid, centre.tolist(), strict=True)
    )


NARROW = (
    "bicubic, moderate", "bicubic, wild", "degrees 1 to 8", "B-splines", "rings and tori",
    "triangles", "quadrics", "bilinear", "far away", "tiny", "almost degenerate", "creases",
)  # fmt: skip
"""Families of surfaces (`tools.certify.surfaces`) whose areas get narrow intervals."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NARROW, "rational", "rational triangles", "poles", "NURBS"])
def test_areas_agree_with_extrapolated_polyhedra(name: str) -> None:
    surface = FAMILIES[name].surface(11)
    result = measure_surface(surface, 1e-8 if name in NARROW else 1e-4)
    expected, error = oracle.measure_area(
        build_sheets(surface), levels=4 if isinstance(surface, BsplineSurface) else 5
    )
    assert contains(result.area, expected, error)
    # The intervals of rational surfaces and of poles may be wider than the area.
    assert result.area.high - result.area.low < (1e-6 if name in NARROW else 20) * expected


def test_cells_are_halved_although_the_patches_exceed_the_budget() -> None:
    """Then the cells may have up to three times the control points of the patches."""
    x, y = np.meshgrid(np.arange(12.0), np.arange(12.0), indexing="ij")
    net = np.stack([x, y, np.sin(x / 4) * np.cos(y / 4)], axis=-1)
    surface = BsplineSurface(net, (3, 3))
    result = measure(surface.lower(), MeasureQuery(1e-4, budget=100))
    assert result.reached
    assert contains(result.area, measure_surface(surface, 1e-9).area.value)


def test_cells_are_halved_until_the_budget_is_used_up() -> None:
    """Even with budget 0, cells may have three times the control points of the patches.

    So the four patches become cells of twelve nets.
    """
    cells = build_cells(RNG(6).uniform(-0.5, 0.5, (4, 3, 3, 3)), np.arange(4), 0.0)
    result = refine([cells], "size", allowed=np.full(1, 1e-30), budget=0)
    assert sum(bounded.size for bounded in result.bounded) == 3 * cells.size


@pytest.mark.parametrize("degree", [(1, 1), (3, 3), (2, 5)])
def test_the_flux_of_polynomial_patches_is_exact_up_to_rounding(degree: tuple[int, int]) -> None:
    nets = RNG(sum(degree)).uniform(-0.5, 0.5, (2, degree[0] + 1, degree[1] + 1, 3))
    cells = build_cells(nets, np.arange(2), 0.0)
    refinement = refine([cells], "flux", allowed=np.ones(2), budget=0)
    # Each patch is a part. Column 0 has the sums of all parts, column 1 + k those of part k.
    sums, errors = refinement.integrate().over_parts(np.arange(2), 2)
    for k, net in enumerate(nets):
        expected = oracle.exact_flux([to_exact_net(net)])
        assert abs(sums[0, 1 + k] - expected) <= errors[0, 1 + k] < 1e-11


@pytest.mark.slow
def test_volumes_of_closed_splines_are_right() -> None:
    angle = 2 * pi * np.arange(3) / 3
    directions = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)[:, np.newaxis]
    heights = np.cos(angle)[:, np.newaxis] * [0.0, 0, 1]
    net = directions * (2 + np.sin(angle))[:, np.newaxis] + heights
    net += RNG(3).uniform(-0.2, 0.2, net.shape)
    surface = BsplineSurface(net, (2, 2), ("periodic", "periodic"))
    result = measure_surface(surface)
    volume = result.volume
    assert volume is not None
    (batch,) = surface.lower().batches
    expected = oracle.exact_flux([to_exact_net(points) for points in batch.points]) / 3
    assert contains(volume, expected)
    assert volume.high - volume.low < 1e-9 * abs(volume.value)
    rational = BsplineSurface(
        net, (2, 2), ("periodic", "periodic"), RNG(4).uniform(0.5, 2, net.shape[:2])
    )
    flux, error = oracle.measure_flux(build_sheets(rational), first=8, levels=5)
    assert contains(measure_surface(rational).volume, flux / 3, error)


def test_an_open_surface_has_no_volume_and_lists_its_borders() -> None:
    sphere = find_example("sphere")
    result = measure_surface(replace(sphere, patches=sphere.patches[:7], parts=()))
    assert not result.closed
    assert result.volume is None
    assert result.centroid is None
    assert (result.open_edges, result.inconsistent_edges) == (3, 0)
    assert [fault.is_open for fault in result.faulty_edges] == [True] * 3
    (loop,) = result.boundaries
    assert loop.closed
    assert loop.edges == 3
    assert contains(loop.length, 3 * MP.pi / 2, 1e-15)
    assert contains(result.boundary_length, 3 * MP.pi / 2, 1e-15)


def test_a_reversed_patch_makes_edges_inconsistent() -> None:
    torus = find_example("torus")
    patches = np.array(torus.patches)
    patches[5] = patches[5].transpose(1, 0)
    result = measure_surface(replace(torus, patches=patches))
    assert result.volume is None
    # Both sides of each of the four edges of the patch.
    assert (result.open_edges, result.inconsistent_edges) == (0, 8)
    assert {fault.request_side.patch for fault in result.faulty_edges} >= {5}
    reversed_torus = measure_surface(
        replace(torus, patches=np.array(torus.patches).transpose(0, 2, 1))
    )
    assert reversed_torus.volume is not None
    assert reversed_torus.volume.value == pytest.approx(-0.32 * pi * pi)


def test_borders_have_the_right_lengths_and_places() -> None:
    result = measure_surface(find("utah-teapot").surface())
    # The rim, both ends of handle and spout, and the lid.
    assert [loop.edges for loop in result.boundaries] == [4, 2, 2, 2, 2, 4]
    sheets = build_sheets(find("utah-teapot").surface().lower())
    rim = result.boundaries[0]
    assert (rim.first.patch, rim.first.side) == (0, "v=0")
    expected = [
        oracle.measure_length(lambda t, k=k: sheets[k].at(np.stack([t, 0 * t], axis=1)))  # type: ignore[misc]
        for k in range(4)
    ]
    assert contains(rim.length, *map(sum, zip(*expected, strict=True)))
    spline = find("bspline-hills").surface()
    (border,) = measure_surface(spline).boundaries
    assert border.edges == 18  # 4 × 5 spans
    assert border.first.patch is None
    assert border.first.uv == ((0.0, 0.0), (0.0, 1.0))
    triangle = measure_surface(find("monkey-saddle").surface())
    assert [fault.request_side.side for fault in triangle.faulty_edges] == ["s=0", "r=0", "t=0"]
    assert triangle.faulty_edges[1].request_side.uv == ((1.0, 0.0), (0.0, 1.0))


def build_halves(is_mirrored: bool) -> GroupSurface:
    """A torus as two members: half of it, and a copy of this half that is mirrored or rotated."""
    torus = find_example("torus")
    half = replace(torus, patches=torus.patches[:8], parts=())
    placement = np.diag([1.0, -1, 1, 1]) if is_mirrored else np.diag([-1.0, -1, 1, 1])
    return GroupSurface((Member(half), Member(half, name="other", matrix=placement)))


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_members_that_meet_enclose_a_volume(is_mirrored: bool) -> None:
    result = measure_surface(build_halves(is_mirrored))
    assert result.closed
    assert contains(result.volume, MP.mpf("0.32") * MP.pi**2, 1e-14)
    assert [part.name for part in result.parts] == ["torus", "other"]
    assert all(part.volume is None for part in result.parts)
    assert all(contains(part.area, 0.8 * MP.pi**2, 1e-14) for part in result.parts)


def test_open_sides_of_mirrored_triangles_are_reported_as_in_the_request() -> None:
    sphere = find_example("octahedral-sphere")
    rows = np.array(sphere.triangles)
    rows_of_half = rows[(sphere.vertices[rows][..., 0] > -1e-9).all(axis=1)]
    half = replace(sphere, triangles=rows_of_half, parts=())
    incomplete_half = replace(sphere, triangles=rows_of_half[1:], parts=())
    placement = np.diag([-1.0, 1, 1, 1])
    faulty_sides = {
        (f.request_side.patch, f.request_side.side, f.request_side.uv)
        for f in measure_surface(incomplete_half).faulty_edges
    }
    mirrored = measure_surface(GroupSurface((Member(incomplete_half, matrix=placement),)))
    assert {
        (f.request_side.patch, f.request_side.side, f.request_side.uv)
        for f in mirrored.faulty_edges
    } == faulty_sides
    # Beside the complete half, only the sides of the missing triangle are open. Sides of the
    # mirrored member may be reported from either end.
    joined = measure_surface(
        GroupSurface((Member(half), Member(incomplete_half, name="other", matrix=placement)))
    )
    open_sides = [f.request_side for f in joined.faulty_edges if f.request_side.surface == 1]
    assert {(side.patch, side.side) for side in open_sides} <= {
        (patch, side) for patch, side, _ in faulty_sides
    }
    ends_of_side = {side: set(uv) for _, side, uv in faulty_sides}
    assert open_sides
    assert all(set(side.uv) == ends_of_side[side.side] for side in open_sides)


@pytest.mark.slow
def test_each_closed_member_has_a_volume() -> None:
    far = np.diag([2.0, 2, -2, 1])  # larger, mirrored and translated
    far[:3, 3] = 100
    sphere = find_example("sphere")
    open_sphere = replace(sphere, patches=sphere.patches[1:], parts=())
    members = (
        Member(sphere),
        Member(open_sphere, name="open", matrix=far @ np.diag([3.0, 3, 3, 1])),
        Member(sphere, name="far", matrix=far),
    )
    result = measure_surface(GroupSurface(members))
    assert result.volume is None
    volumes = [part.volume for part in result.parts]
    assert volumes[1] is None
    assert contains(volumes[0], 4 * MP.pi / 3, 1e-14)
    assert contains(volumes[2], 32 * MP.pi / 3, 1e-13)
    assert result.faulty_edges[0].request_side.surface == 1
    # A member that only places others has a number, too.
    tree = (Member(matrix=far), *(replace(each, parent=0) for each in members))
    below = measure_surface(GroupSurface(tree))
    assert below.faulty_edges[0].request_side.surface == 2
    assert [part.name for part in below.parts] == [f"assembly/{part.name}" for part in result.parts]
    assert contains(below.parts[0].volume, 32 * MP.pi / 3, 1e-13)
    mirrored_group = GroupSurface((Member(open_sphere, matrix=far),))
    (first, *_) = measure_surface(mirrored_group).faulty_edges
    plain = measure_surface(open_sphere).faulty_edges
    assert first.request_side.side in {fault.request_side.side for fault in plain}


def test_closing_gaps_widens_the_interval_of_the_volume() -> None:
    sphere = find_example("sphere")
    points = sphere.vertices[sphere.patches]
    assert sphere.weights is not None
    weights = sphere.weights[sphere.patches]
    moved_points = points + RNG(5).uniform(-1e-7, 1e-7, points.shape)
    patches = tuple(BezierSurface(net, w) for net, w in zip(moved_points, weights, strict=True))
    surface = MultipatchSurface(patches)
    assert measure_surface(surface).volume is None
    result = measure_surface(surface, weld=1e-6)
    assert result.moved > 1e-8
    assert result.volume is not None
    assert 1e-7 < result.volume.high - result.volume.low < 2e-5
    assert contains(result.volume, 4 / MP.mpf(3) * MP.pi)
    expected, error = oracle.measure_flux(build_sheets(surface), levels=5)
    assert contains(result.volume, expected / 3, error)


@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.integers(0, 2**20), st.floats(-9, 9))
def test_the_volume_of_an_affine_image_is_scaled_by_the_determinant(
    seed: int, offset: float
) -> None:
    torus = find_example("torus")
    matrix = np.eye(3) + RNG(seed).uniform(-0.5, 0.5, (3, 3))
    image = replace(torus, vertices=torus.vertices @ matrix.T + offset)
    result = measure_surface(image, 1e-1)
    det = float(np.linalg.det(matrix))
    volume = float(MP.mpf("0.32") * MP.pi**2 * det)
    assert contains(
        result.volume, volume, 1e-13 * float(np.abs(matrix).max()) ** 3 * (1 + abs(offset))
    )
    assert measure_surface(image, 1e-1) == result  # the same query has the same result
