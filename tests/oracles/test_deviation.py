"""Tests of the oracles: sheets are compared with exact arithmetic, distances with trimesh."""

from fractions import Fraction
from itertools import pairwise
from math import cos, pi, sqrt

import numpy as np
import pytest
import trimesh
from scipy.interpolate import NdBSpline
from trimesh.proximity import closest_point_naive

from oracles import exact, splines, triangles
from oracles.deviation import (
    measure_mesh_to_surface,
    measure_seen_deviation,
    measure_surface_to_mesh,
)
from oracles.distance import Soup
from oracles.sheets import (
    Array,
    PlacedSheet,
    build_bezier_sheet,
    build_sheets,
    build_triangle_sheet,
)
from service.surface.bspline import BsplineSurface
from tools.certify.surfaces import FAMILIES, bicubic

PLACES = [(0.0, 0.0), (1.0, 1.0), (1 / 3, 5 / 7), (0.125, 0.875)]


def assert_close(points: Array, truth: Array) -> None:
    """Coordinates differ by at most 1e-14 times the largest true coordinate."""
    np.testing.assert_allclose(points, truth, rtol=0, atol=1e-14 * np.abs(truth).max())


@pytest.mark.parametrize("seed", range(4))
def test_tensor_sheets_agree_with_exact_de_casteljau(seed: int) -> None:
    # Nets of 2 to 4 rows, from 1 to 10⁶ away from zero, where a sheet must not lose digits.
    net: Array = bicubic(seed, 0.3)[: seed + 2] + 10 ** (2 * seed)
    weights = np.random.default_rng(seed).uniform(0.2, 5, net.shape[:2]) if seed % 2 else None
    sheet = build_bezier_sheet(net, weights)
    points = sheet.at(np.array(PLACES))
    exact_net = exact.to_exact_net(net, weights)
    truth = [exact.jets(exact_net, [Fraction(u)], [Fraction(v)])[0][0] for u, v in PLACES]
    origin = [Fraction(float(x)) for x in sheet.origin]
    assert_close(
        points,
        np.array([[float(x - o) for x, o in zip(t.point, origin, strict=True)] for t in truth]),
    )


@pytest.mark.parametrize("degree", [1, 2, 5])
def test_triangle_sheets_agree_with_exact_de_casteljau(degree: int) -> None:
    rng = np.random.default_rng(degree)
    net = rng.uniform(-1, 1, ((degree + 1) * (degree + 2) // 2, 3))
    weights = rng.uniform(0.2, 5, len(net))
    places = [(0.25, 0.75), (0.375, 0.125), (0.0, 0.0), (0.0, 1.0)]
    sheet = build_triangle_sheet(net, weights)
    truth = [
        triangles.jet(triangles.to_exact_triangle(net, weights), (1 - s - t, s, t)).point
        for s, t in [(Fraction(s), Fraction(t)) for s, t in places]
    ]
    points = sheet.at(np.array(places)) + sheet.origin
    assert_close(points, np.array([[float(x) for x in point] for point in truth]))


def test_spline_sheets_agree_with_exact_de_boor_and_with_scipy() -> None:
    for seed in range(12):
        surface = FAMILIES["creases" if seed % 2 else "NURBS"].surface(seed)
        assert isinstance(surface, BsplineSurface)
        (sheet,) = build_sheets(surface)
        places = sheet.samples(50)
        points = sheet.at(places) + sheet.origin
        weights = np.ones(surface.control_net.shape[:2])
        if surface.weights is not None:
            weights = surface.weights
        net = np.concatenate(
            [surface.control_net * weights[..., None], weights[..., None]], axis=-1
        )
        homogeneous = NdBSpline(surface.knot_vectors, net, surface.degree)(places)
        assert_close(points, homogeneous[:, :3] / homogeneous[:, 3:])
        u, v = places[7].tolist()  # one place, because exact arithmetic is slow
        knots = (
            splines.to_fractions(surface.knot_vectors[0]),
            splines.to_fractions(surface.knot_vectors[1]),
        )
        truth = splines.spline_surface_point(
            exact.to_exact_net(surface.control_net, weights),
            knots,
            surface.degree,
            (Fraction(u), Fraction(v)),
        )
        assert_close(points[7], np.array([float(x) for x in truth]))


def random_triangles(rng: np.random.Generator, count: int) -> Array:
    """Triangles (count, 3, 3), of which the first third is thin."""
    corners = rng.uniform(-1, 1, (count, 3, 3))
    corners[: count // 3, 2] = corners[: count // 3, 0] + 1e-3 * corners[: count // 3, 1]
    return corners


def test_distances_to_triangles_agree_with_trimesh() -> None:
    rng = np.random.default_rng(1)
    corners = random_triangles(rng, 60)
    points = rng.uniform(-2, 2, (200, 3))
    faces = np.arange(len(corners) * 3).reshape(-1, 3)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), faces, process=False)
    _, truth, _ = closest_point_naive(mesh, points)  # type: ignore[no-untyped-call]
    np.testing.assert_allclose(Soup(corners).distances(points), truth, atol=1e-12)


def test_distances_to_triangles_without_area() -> None:
    """A triangle may be a line or a point."""
    line, point = [(0, 0, 0), (2, 0, 0), (1, 0, 0)], [(0, 0, 5)] * 3
    corners = np.array([line, point], dtype=float)
    points = np.array([(3.0, 0, 0), (1, 2, 0), (0, 0, 4)])
    np.testing.assert_array_equal(Soup(corners).distances(points), [1, 2, 1])


def test_deviation_of_a_parabola() -> None:
    """The parabolic cylinder (u, v, 4u(1 − u)) has distance 1 from the plane through its ends.

    From the two planes that meet at its top it has distance 1/(4√5).
    """
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[0.5, 0, 2], [0.5, 1, 2]], [[1, 0, 0], [1, 1, 0]]])
    sheets = [build_bezier_sheet(net)]
    a, b, c, d = (np.array(p, dtype=float) for p in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)))
    corners = np.array([[a, b, c], [a, c, d]])
    result = measure_surface_to_mesh(sheets, corners)
    assert result.distance == pytest.approx(1, abs=1e-12)
    assert result.place[0] == pytest.approx(0.5, abs=1e-6)
    # The middle (½, 0) of the chord has the largest distance from the parabola. The nearest point
    # (u, 4u(1 − u)) of the parabola solves (u − ½) + 16 u (1 − u)(1 − 2u) = 0.
    u = (1 - sqrt(1 - 1 / 8)) / 2
    truth = np.hypot(0.5 - u, 4 * u * (1 - u))
    assert measure_mesh_to_surface(sheets, corners) == pytest.approx(truth, abs=1e-3)
    top, top_end = np.array([0.5, 0, 1]), np.array([0.5, 1, 1])
    roof = np.array([[a, top, top_end], [a, top_end, d], [top, b, c], [top, c, top_end]])
    assert measure_surface_to_mesh(sheets, roof).distance == pytest.approx(0.25 / sqrt(5), abs=1e-9)


def test_deviation_after_a_map_and_relative_to_the_distance_from_an_eye() -> None:
    """The map stretches the height of the parabolic cylinder to 3; the eye is 2 above its top."""
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[0.5, 0, 2], [0.5, 1, 2]], [[1, 0, 0], [1, 1, 0]]])
    matrix = np.diag([1.0, 1, 3, 1])
    matrix[:3, 3] = 5, -7, 9
    floor = np.array([[[5.0, -7, 9], [6, -7, 9], [6, -6, 9]], [[5, -7, 9], [6, -6, 9], [5, -6, 9]]])
    sheets = [PlacedSheet(build_bezier_sheet(net), matrix)]
    assert measure_surface_to_mesh(sheets, floor).distance == pytest.approx(3, abs=1e-12)
    eye = np.array([5.5, -6.5, 14])
    assert measure_seen_deviation(sheets, floor, eye, 1e-3) == pytest.approx(1.5, abs=1e-3)
    assert measure_seen_deviation(sheets, floor, eye, 9.0) == pytest.approx(1 / 3, abs=1e-9)


def test_deviation_of_a_cylinder_is_the_sagitta() -> None:
    """A cylinder far from zero has the same deviation as the cylinder near zero."""
    arc, weights = np.array([[1.0, 0], [1, 1], [0, 1]]), np.array([1, sqrt(0.5), 1])
    net = np.array([[[x, y, z] for z in (0.0, 1.0)] for x, y in arc])
    for shift in (0.0, 2.0**20):
        sheets = [build_bezier_sheet(net + shift, np.column_stack([weights, weights]))]
        t = np.linspace(0, pi / 2, 5)
        rim = np.stack([np.cos(t), np.sin(t), np.zeros(5)], axis=1) + shift
        rise = np.array([0.0, 0, 1])
        corners = [[p, q, q + rise] for p, q in pairwise(rim)]
        corners += [[p, q + rise, p + rise] for p, q in pairwise(rim)]
        result = measure_surface_to_mesh(sheets, np.array(corners))
        assert result.distance == pytest.approx(1 - cos(pi / 16), abs=1e-8)
