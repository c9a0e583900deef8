"""Parameter curves of foot points, against the nearest of many points of the surface."""

import numpy as np
import pytest
from hypothesis import given

from service.engine.trims import foot_curves, inversion
from service.engine.trims.closure import ClosedSurfaces, find_closure
from service.engine.trims.foot_curves import fit_feet, project_to_planes
from service.engine.trims.foot_tables import make_guesses
from service.engine.trims.inversion import find_feet
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.brep.closed_faces import build_net
from tests.engine.trims.tables import seeds
from tests.engine.trims.test_gaps import build_curve, build_plane

GOAL = 1e-8
ZERO = np.zeros(1, np.intp)


def build_wave(seed: int) -> ClosedSurfaces:
    """A surface of degree (3, 2) with several spans, a little higher and lower than a plane."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 8, 7), np.linspace(0, 6, 5), indexing="ij")
    net = np.stack([x, y, 0.3 * rng.random(x.shape)], axis=-1)
    table = SurfaceTable(
        np.array([[3, 2]]),
        np.array([[7, 5]]),
        net.reshape(-1, 3),
        np.ones(net[..., 0].size),
        np.array([False]),
        np.array([0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4, 0, 0, 0, 1, 2, 3, 3, 3], float),
    )
    return ClosedSurfaces.open(FaceSurfaces.of(table))


def build_edge(seed: int) -> Splines:
    """A curve of degree 3 near the wave."""
    rng = np.random.default_rng(seed + 1)
    points = np.array([[1, 1, 0.1], [3, 5, 0.1], [5, 1, 0.1], [7, 5, 0.1]], float)
    return build_curve(3, (points + 0.1 * rng.random((4, 3))).tolist())


def fit(surfaces: ClosedSurfaces, curve: Splines) -> Splines:
    nothing = build_curve(2, [[0, 0], [1, 1]])
    guesses = make_guesses(surfaces, ZERO, curve, (nothing, np.array([-1])), GOAL)
    return fit_feet(surfaces, ZERO, curve, guesses, GOAL)


@given(seeds)
def test_no_other_point_of_the_surface_is_nearer(seed: int) -> None:
    surfaces, curve = build_wave(seed), build_edge(seed)
    pcurve = fit(surfaces, curve)
    t = np.linspace(0, 1, 25)
    zeros = np.zeros(len(t), np.intp)
    points = curve.evaluate(zeros, t)
    reached = np.linalg.norm(surfaces.evaluate(zeros, pcurve.evaluate(zeros, t)) - points, axis=1)
    u, v = np.meshgrid(np.linspace(0, 4, 81), np.linspace(0, 3, 61), indexing="ij")
    grid = np.stack([u.ravel(), v.ravel()], axis=1)
    dense = surfaces.evaluate(np.zeros(len(grid), np.intp), grid)
    nearest = np.linalg.norm(dense[np.newaxis] - points[:, np.newaxis], axis=2).min(axis=1)
    assert (reached <= nearest + 2 * GOAL).all()


@given(seeds)
def test_ends_of_parts_meet(seed: int) -> None:
    pcurve = fit(build_wave(seed), build_edge(seed))
    inner = pcurve.breaks[1:-1]
    zeros = np.zeros(len(inner), np.intp)
    after = pcurve.evaluate(zeros, inner)
    before = pcurve.evaluate(zeros, np.nextafter(inner, 0))
    np.testing.assert_allclose(before, after, rtol=0, atol=1e-9)


@given(seeds)
def test_an_edge_on_the_surface_has_the_curve_that_made_it(seed: int) -> None:
    surfaces = build_wave(seed)
    line = build_curve(2, [[0.5, 0.25], [3.5, 2.75]])
    t = np.linspace(0, 1, 200)
    zeros = np.zeros(200, np.intp)
    points = surfaces.evaluate(zeros, line.evaluate(zeros, t))
    feet, distance = find_feet(surfaces, zeros, points, line.evaluate(zeros, t) + 0.05)
    np.testing.assert_allclose(feet, line.evaluate(zeros, t), rtol=0, atol=1e-7)
    assert distance.max() < 1e-7


def test_on_planes_images_have_the_weights_of_the_edge() -> None:
    half = np.sqrt(0.5)
    table = CurveTable(
        np.array([2]),
        np.array([3]),
        np.array([[5.0, 2, 1], [8, 2, 1], [8, 5, 1]]),
        np.array([1.0, half, 1.0]),
        np.array([True]),
        np.array([0.0, 0, 0, 1, 1, 1]),
    )
    plane, edge = build_plane(), Splines.of(table)
    pcurve = project_to_planes(plane, ZERO, edge)
    assert pcurve.degree[0] == 2
    assert pcurve.is_rational[0]
    t = np.linspace(0, 1, 33)
    zeros = np.zeros(33, np.intp)
    image = plane.evaluate(zeros, pcurve.evaluate(zeros, t))
    apart = image - edge.evaluate(zeros, t)
    np.testing.assert_allclose(apart, np.tile([0, 0, -1.0], (33, 1)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.2, 0.9])
def test_a_curve_around_a_closed_surface_is_continued(turn: float) -> None:
    net = build_net("tube", 24, 2)
    table = SurfaceTable(
        np.array([[1, 1]]),
        np.array([net.shape[:2]]),
        net.reshape(-1, 3),
        np.ones(net[..., 0].size),
        np.array([False]),
        np.concatenate([[0], np.arange(25), [24], [0, 0, 1, 2, 2]]).astype(float),
    )
    surfaces = find_closure(FaceSurfaces.of(table), 1e-9)
    assert surfaces.is_closed.tolist() == [[True, False]]
    angle = 2 * np.pi * (turn + np.linspace(0, 2, 65))
    points = np.stack([np.cos(angle), np.sin(angle), 0.1 + 0 * angle], axis=1)
    knots = np.concatenate([[0], np.linspace(0, 1, 65), [1]])
    ones = np.array([1])
    curve = Splines.of(
        CurveTable(ones, np.array([65]), points, np.ones(65), np.array([False]), knots)
    )
    pcurve = fit(surfaces, curve)
    zeros = np.zeros(2, np.intp)
    begin, end = pcurve.evaluate(zeros, np.array([0.0, 1.0]))
    assert end[0] - begin[0] == pytest.approx(48, abs=0.05)


def test_a_curve_ends_when_it_has_too_many_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pieces are as they are then, and join."""
    surfaces, curve = build_wave(0), build_edge(0)
    full = fit(surfaces, curve)
    monkeypatch.setattr(foot_curves, "MOST", 2)
    few = fit(surfaces, curve)
    assert full.span_count[0] > few.span_count[0]
    assert few.span_count[0] == 4
    t = np.linspace(0, 1, 25)
    zeros = np.zeros(len(t), np.intp)
    assert np.abs(few.evaluate(zeros, t) - full.evaluate(zeros, t)).max() < 1e-2


def test_many_feet_are_found_in_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    surfaces = build_wave(1)
    points = np.random.default_rng(2).random((50, 3)) * [8.0, 6.0, 0.3]
    zeros, guess = np.zeros(50, np.intp), np.tile([2.0, 1.5], (50, 1))
    all_feet, all_distances = find_feet(surfaces, zeros, points, guess)
    monkeypatch.setattr(inversion, "BATCH", 16)
    feet, distances = find_feet(surfaces, zeros, points, guess)
    assert (feet == all_feet).all()
    assert (distances == all_distances).all()
