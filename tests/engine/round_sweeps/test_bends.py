"""Bounds of cells, compared with samples of the curve and of its derivatives."""

import numpy as np
import pytest

from oracles.sweeps import Path
from service.engine.round_sweeps.bends import bound_bends, bound_tube_lines
from service.engine.round_sweeps.path_nets import build_path_nets, find_lines, find_unit
from tests.engine.round_sweeps.sweeps import TUBES, bezier, bspline, tube


@pytest.mark.parametrize("seed", range(12))
def test_bounds_of_cells_hold_for_samples(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(6, 3)) + 3 * np.arange(6)[:, None]
    weights = 2.0 ** rng.uniform(-1, 1, 6) if seed % 2 else None
    curve = bspline(points, 3, weights=weights) if seed % 3 else bezier(points, weights)
    model = tube(curve, rng.uniform(0.1, 1, 3)).lower()
    cells = build_path_nets(model, find_lines(model), slice(None))
    for _ in range(3):
        cells = cells.halve()
    bends, unit = bound_bends(cells), find_unit(model)
    path = Path.of(curve)
    for cell in range(len(cells.piece)):
        low, high = path.breaks[cells.piece[cell] : cells.piece[cell] + 2]
        begin = low + (high - low) * cells.first[cell]
        width = (high - low) * cells.width[cell]
        t = np.clip(begin + width * np.linspace(0, 1, 401), low, high)
        value, slope = path.spline(t), path.spline.derivative()(t)
        place = value[:, :3] / value[:, 3:]
        velocity = width * (slope[:, :3] - place * slope[:, 3:]) / value[:, 3:]
        speed = np.linalg.norm(velocity, axis=1)
        tangent = velocity / speed[:, None]
        step = 400.0
        turn = np.linalg.norm(np.diff(tangent, axis=0), axis=1) * step
        assert turn.max() <= bends.turn[cell] * (1 + 1e-6)
        assert speed.max() <= unit * bends.speed[cell] * (1 + 1e-12)
        assert np.abs(np.diff(speed)).max() * step <= unit * bends.speed_change[cell] * (1 + 1e-6)
        second = np.diff(tangent, 2, axis=0) * step**2
        across = second - (second * tangent[1:-1]).sum(axis=1)[:, None] * tangent[1:-1]
        assert np.linalg.norm(across, axis=1).max() <= bends.turn_change[cell] * (1 + 1e-3) + 1e-3
        np.testing.assert_allclose(bends.begin[:, cell], tangent[0], atol=1e-12)
        chord = np.linalg.norm(place[-1] - place[0])
        assert unit * bends.progress[cell] <= chord * (1 + 1e-12)


def test_the_lines_of_a_torus_are_about_as_far_from_their_chords_as_its_outer_circle() -> None:
    model = TUBES["torus"].lower()
    cells = build_path_nets(model, find_lines(model), slice(None))
    for _ in range(4):
        cells = cells.halve()
    bends = bound_bends(cells)
    bound = find_unit(model) * bound_tube_lines(bends)
    sagitta = 1.4 * (1 - np.cos(bends.turn / 2))
    assert (bound > 0.99 * sagitta).all()
    assert (bound < 1.5 * sagitta).all()
