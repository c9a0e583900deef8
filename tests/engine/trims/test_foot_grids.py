"""Feet on surfaces that go around several times without being closed."""

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.trims.test_foot_curves import fit
from tests.engine.trims.test_gaps import build_curve

SPANS, SPAN = 8, 7.157
"""Each span of a screw turns by more than a whole turn."""


def build_helix(degree: int, radius: float, start: float) -> FloatArray:
    """Control points of spans that turn by `SPAN`; the pitch is 1."""
    x = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    matrix = np.linalg.inv(bernstein(degree, x))
    spans = []
    for span in range(SPANS):
        angle = SPAN * (span + x)
        helix = np.stack([radius * np.cos(angle), radius * np.sin(angle), angle / (2 * np.pi)], 1)
        points = matrix @ (helix + np.array([0.0, 0.0, start]))
        spans.append(points if span == 0 else points[1:])
    points = np.concatenate(spans)
    return points


def build_screw(degree: int) -> tuple[ClosedSurfaces, FloatArray]:
    """The flank of a thread: from radius 3 to 2.5; and its knots along the helix."""
    rows = [build_helix(degree, 3.0, 0.0), build_helix(degree, 2.46, 0.31)]
    net = np.stack(rows, axis=1)
    knots = np.repeat(
        SPAN * np.arange(SPANS + 1), [degree + 1, *[degree] * (SPANS - 1), degree + 1]
    )
    table = SurfaceTable(
        np.array([[degree, 1]]),
        np.array([[len(net), 2]]),
        net.reshape(-1, 3),
        np.ones(2 * len(net)),
        np.array([False]),
        np.concatenate([knots, [0.0, 0.0, 1.0, 1.0]]),
    )
    return ClosedSurfaces.open(FaceSurfaces.of(table)), knots


@pytest.mark.parametrize("degree", [8, 13])
@pytest.mark.parametrize("side", [0, 1])
def test_borders_of_screws_are_found(side: int, degree: int) -> None:
    surfaces, knots = build_screw(degree)
    points = build_helix(degree, 3.0, 0.0) if side == 0 else build_helix(degree, 2.46, 0.31)
    ones = np.array([1])
    table = CurveTable(
        degree * ones, len(points) * ones, points, np.ones(len(points)), np.array([False]), knots
    )
    pcurve = fit(surfaces, Splines.of(table))
    t = np.linspace(0, SPAN * SPANS, 301)
    feet = pcurve.evaluate(np.zeros(len(t), np.intp), t)
    assert np.abs(feet - np.stack([t, np.full(len(t), float(side))], axis=1)).max() < 1e-6


@pytest.mark.parametrize("degree", [8, 13])
@pytest.mark.parametrize("angle", np.linspace(0.0, SPAN * SPANS, 14).tolist())
def test_lines_across_screws_are_on_their_turn(angle: float, degree: int) -> None:
    surfaces, _ = build_screw(degree)
    ends = surfaces.evaluate(np.zeros(2, np.intp), np.array([[angle, 0.0], [angle, 1.0]]))
    pcurve = fit(surfaces, build_curve(3, ends.tolist()))
    t = np.linspace(0, 1, 9)
    feet = pcurve.evaluate(np.zeros(9, np.intp), t)
    assert np.abs(feet - np.stack([np.full(9, angle), t], axis=1)).max() < 1e-6
