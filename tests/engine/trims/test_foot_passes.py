"""Curves that pass near a pole of a sphere: the angle of their feet turns by π in a short way."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from oracles.solids import read_solid
from service.bases.arrays import FloatArray
from service.engine.trims.closure import ClosedSurfaces, find_closure
from service.engine.trims.foot_curves import fit_feet
from service.engine.trims.foot_passes import find_pole_cuts
from service.engine.trims.foot_tables import make_guesses
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.test_gaps import build_curve

CENTER, RADIUS = np.array([1.0, 2.0, 3.0]), 7.0
GOAL = 1e-8
ZERO = np.zeros(1, np.intp)
WEIGHT = np.sqrt(0.5)


def build_circle(tilt: float, radius: float, azimuth: float) -> Splines:
    """The curve of `build_circle_table`."""
    return Splines.of(build_circle_table(tilt, radius, azimuth))


def build_circle_table(tilt: float, radius: float, azimuth: float) -> CurveTable:
    """A circle on the sphere of angular radius `radius`, around an axis `tilt` from the pole."""
    axis = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    x = np.cross(axis, [0.3, 0.2, 0.9])
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    plan = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    ring = np.array([a * x + b * y for a, b in plan])
    points = CENTER + RADIUS * (np.cos(radius) * axis + np.sin(radius) * ring)
    weights = np.array([1, WEIGHT, 1, WEIGHT, 1, WEIGHT, 1, WEIGHT, 1])
    knots = np.array([0.0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4])
    ones = np.array([1])
    return CurveTable(2 * ones, 9 * ones, points, weights, np.array([True]), knots)


def list_dense(curve: Splines, beside: float) -> FloatArray:
    """Parameters all over the curve, and close together around its nearest point to the pole."""
    t = np.linspace(0, 4, 4001)
    points = curve.evaluate(np.zeros(len(t), np.intp), t)
    pole = CENTER + np.array([0.0, 0.0, RADIUS])
    middle = t[np.linalg.norm(points - pole, axis=1).argmin()]
    steps = beside * np.geomspace(0.01, 1e3, 200)
    near = np.concatenate([middle + np.linspace(-2e-3, 2e-3, 999), middle - steps, middle + steps])
    return np.sort(np.clip(np.concatenate([t, near]), 0, 4))


@pytest.mark.slow
@pytest.mark.parametrize("azimuth", [0.7, 2.2])
@pytest.mark.parametrize("radius", [0.3, 1.1])
@pytest.mark.parametrize("beside", [1e-2, 1e-3, -1.7e-3, 1e-4, -1e-4, 1e-6, -1e-6])
def test_feet_beside_a_pole_are_on_the_curve(beside: float, radius: float, azimuth: float) -> None:
    surfaces = find_closure(FaceSurfaces.of(lower(read_solid("sphere")).surfaces), 1e-6)
    curve = build_circle(radius + beside, radius, azimuth)
    nothing = build_curve(2, [[0, 0], [1, 1]])
    guesses = make_guesses(surfaces, ZERO, curve, (nothing, np.array([-1])), GOAL)
    pcurve = fit_feet(surfaces, ZERO, curve, guesses, GOAL)
    t = list_dense(curve, abs(beside))
    zeros = np.zeros(len(t), np.intp)
    feet = pcurve.evaluate(zeros, t)
    apart = surfaces.evaluate(zeros, feet) - curve.evaluate(zeros, t)
    assert np.linalg.norm(apart, axis=1).max() < 2 * GOAL
    # Around the axis once, if the pole is inside, else there and back; not more often.
    closed = surfaces.is_closed[0].argmax()
    turns = np.diff(feet[:, closed]) / surfaces.period[0, closed]
    assert turns.sum() == pytest.approx(np.rint(turns.sum()), abs=1e-6)
    assert abs(np.rint(turns.sum())) == (beside < 0)
    assert np.abs(turns).sum() < 1.05
    assert pcurve.span_count[0] < 200


@pytest.mark.parametrize("beside", [1e-2, -1e-3, 1e-4, -1e-5])
@pytest.mark.parametrize("stretch", [0.25, 5.0, 20.0])
def test_poles_of_ellipsoids_are_passed_as_those_of_spheres(beside: float, stretch: float) -> None:
    """An affine map keeps the parameters of all points, and so the parameter curve."""
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([1.0, 1.5, stretch]) @ (np.eye(3) + 0.4 * np.triu(np.ones((3, 3)), 1))
    model = lower(read_solid("sphere")).surfaces
    model = replace(model, points=(model.points - CENTER) @ matrix.T)
    surfaces = find_closure(FaceSurfaces.of(model), 1e-6)
    table = build_circle_table(0.8 + beside, 0.8, 2.2)
    curve = Splines.of(replace(table, points=(table.points - CENTER) @ matrix.T))
    nothing = build_curve(2, [[0, 0], [1, 1]])
    guesses = make_guesses(surfaces, ZERO, curve, (nothing, np.array([-1])), GOAL)
    pcurve = fit_feet(surfaces, ZERO, curve, guesses, GOAL)
    t = list_dense(build_circle(0.8 + beside, 0.8, 2.2), abs(beside))
    zeros = np.zeros(len(t), np.intp)
    apart = surfaces.evaluate(zeros, pcurve.evaluate(zeros, t)) - curve.evaluate(zeros, t)
    assert np.linalg.norm(apart, axis=1).max() < 2 * GOAL


@pytest.mark.parametrize("azimuth", [0.1, 0.5, 2.2, 4.0])
def test_feet_around_a_sharp_rim_are_on_the_right_side(azimuth: float) -> None:
    """Across the rim of a flat ellipsoid, near points of a grid are on the other side."""
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([1.0, 1.0, 0.04]) @ (np.eye(3) + 0.4 * np.triu(np.ones((3, 3)), 1))
    model = lower(read_solid("sphere")).surfaces
    model = replace(model, points=(model.points - CENTER) @ matrix.T)
    surfaces = find_closure(FaceSurfaces.of(model), 1e-6)
    table = build_circle_table(1.1, 0.9, azimuth)
    curve = Splines.of(replace(table, points=(table.points - CENTER) @ matrix.T))
    nothing = build_curve(2, [[0, 0], [1, 1]])
    guesses = make_guesses(surfaces, ZERO, curve, (nothing, np.array([-1])), GOAL)
    pcurve = fit_feet(surfaces, ZERO, curve, guesses, GOAL)
    t = np.linspace(0, 4, 2001)
    zeros = np.zeros(len(t), np.intp)
    apart = surfaces.evaluate(zeros, pcurve.evaluate(zeros, t)) - curve.evaluate(zeros, t)
    assert np.linalg.norm(apart, axis=1).max() < 2 * GOAL


def test_cuts_double_from_the_nearest_point() -> None:
    surfaces = find_closure(FaceSurfaces.of(lower(read_solid("sphere")).surfaces), 1e-6)
    cuts = find_pole_cuts(surfaces, ZERO, build_circle(0.3001, 0.3, 0.7), 1e-6)
    assert len(cuts.t) > 8
    points = build_circle(0.3001, 0.3, 0.7).evaluate(cuts.curve, cuts.t)
    pole = CENTER + np.array([0.0, 0.0, RADIUS])
    apart = np.sort(np.linalg.norm(points - pole, axis=1))
    assert apart[0] == pytest.approx(RADIUS * 1e-4, rel=1e-3)
    assert (apart[1:] / apart[:-1] < 2.5).all()


def test_curves_through_or_far_from_poles_are_not_cut() -> None:
    surfaces = find_closure(FaceSurfaces.of(lower(read_solid("sphere")).surfaces), 1e-6)
    for beside in (0.0, 0.3):
        curve = build_circle(0.5 + beside, 0.5, 0.7)
        assert not len(find_pole_cuts(surfaces, ZERO, curve, 1e-6).t)


def build_horn_torus(radius: float) -> ClosedSurfaces:
    """A torus that touches its axis in the origin, v = ±2 there; u runs around the axis."""
    ring = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)])
    half = np.where(np.arange(9) % 2, WEIGHT, 1.0)
    across = radius * (1.0 - ring[:, 0])
    net = np.empty((9, 9, 3))
    net[..., :2] = ring[:, np.newaxis] * across[:, np.newaxis]
    net[..., 2] = -radius * ring[:, 1]
    knots = np.array([0.0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4])
    table = SurfaceTable(
        np.array([[2, 2]]),
        np.array([[9, 9]]),
        net.reshape(-1, 3),
        np.outer(half, half).ravel(),
        np.array([True]),
        np.concatenate([knots, knots - 2.0]),
    )
    return find_closure(FaceSurfaces.of(table), 1e-9)


@pytest.mark.parametrize("height", [0.16, 0.1, 1e-3])
def test_circles_around_a_cusp_are_not_cut(height: float) -> None:
    """All directions are one at the point where a torus touches its axis."""
    radius = 0.16
    surfaces = build_horn_torus(radius)
    assert surfaces.is_pole[0, 1].all()
    assert surfaces.is_closed[0].tolist() == [True, False]
    table = build_circle_table(0.0, pi / 2, 0.0)
    reach = radius - np.sqrt(radius**2 - height**2)
    points = (table.points - CENTER) / RADIUS * reach + [0.0, 0.0, height]
    curve = Splines.of(replace(table, points=points))
    assert not len(find_pole_cuts(surfaces, ZERO, curve, 1e-7).t)
    nothing = build_curve(2, [[0, 0], [1, 1]])
    guesses = make_guesses(surfaces, ZERO, curve, (nothing, np.array([-1])), 1e-9)
    pcurve = fit_feet(surfaces, ZERO, curve, guesses, 1e-9)
    t = np.linspace(0, 4, 501)
    zeros = np.zeros(len(t), np.intp)
    feet = pcurve.evaluate(zeros, t)
    apart = surfaces.evaluate(zeros, feet) - curve.evaluate(zeros, t)
    assert np.linalg.norm(apart, axis=1).max() < 2e-9
    assert abs(feet[-1, 0] - feet[0, 0]) == pytest.approx(4.0)
