"""Surfaces of many faces at once, against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import given

from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import SurfaceTable
from tests.engine.trims.tables import build_surfaces, find_surface_point, seeds


@given(seeds)
def test_points_are_those_of_the_surfaces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = build_surfaces(rng, 4)
    surfaces = FaceSurfaces.of(table)
    face = rng.integers(0, 4, 6)
    share = rng.choice([0.0, 0.25, 0.6, 1.0], (6, 2))
    parameters = surfaces.low[face] + share * (surfaces.high - surfaces.low)[face]
    points = surfaces.evaluate(face, parameters)
    partials = surfaces.evaluate_partials(face, parameters, 2)
    for k in range(6):
        exact = [float(x) for x in find_surface_point(table, face[k], *parameters[k])]
        np.testing.assert_allclose(points[k], exact, rtol=0, atol=1e-12)
        np.testing.assert_allclose(partials[0, k], exact, rtol=0, atol=1e-11)


@given(seeds)
def test_partials_are_limits_of_quotients(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = build_surfaces(rng, 3)
    surfaces = FaceSurfaces.of(table)
    face = rng.integers(0, 3, 3)
    share = rng.choice([0.0, 0.25, 0.6], (3, 2))
    parameters = surfaces.low[face] + share * (surfaces.high - surfaces.low)[face]
    partials = surfaces.evaluate_partials(face, parameters, 2)
    step = Fraction(1, 2**40)
    for k in range(3):
        s = [
            [
                np.array(
                    find_surface_point(
                        table,
                        face[k],
                        Fraction(parameters[k, 0]) + i * step,
                        Fraction(parameters[k, 1]) + j * step,
                    )
                )
                for j in range(3)
            ]
            for i in range(3)
        ]
        exact = np.array(
            [
                s[0][0],
                (s[1][0] - s[0][0]) / step,
                (s[0][1] - s[0][0]) / step,
                (s[2][0] - 2 * s[1][0] + s[0][0]) / step**2,
                (s[1][1] - s[1][0] - s[0][1] + s[0][0]) / step**2,
                (s[0][2] - 2 * s[0][1] + s[0][0]) / step**2,
            ],
            float,
        )
        errors = np.abs(partials[:, k] - exact).max(axis=1)
        assert (errors <= 1e-7 * np.abs(exact).max(axis=1) + 1e-8).all()


def build_planes() -> SurfaceTable:
    """A plane over [0, 1]², a bilinear patch that is no plane, and a rational one."""
    plane = [[0, 0, 1], [0, 2, 1], [3, 1, 1], [3, 3, 1]]
    points = np.array([plane, [*plane[:3], [3, 3, 2]], plane], float).reshape(-1, 3)
    weights = np.ones(12)
    weights[8] = 2.0
    return SurfaceTable(
        np.ones((3, 2), np.intp),
        np.full((3, 2), 2),
        points,
        weights,
        np.array([False, False, True]),
        np.tile([0.0, 0, 1, 1], 6),
    )


def test_planes_have_no_ends_and_move_to_their_pcurves() -> None:
    surfaces = FaceSurfaces.of(build_planes())
    np.testing.assert_array_equal(surfaces.is_planar, [True, False, False])
    face = np.zeros(2, np.intp)
    parameters = np.array([[2.5, -1.0], [0.5, 0.5]])
    expected = [[7.5, 0.5, 1], [1.5, 1.5, 1]]
    np.testing.assert_allclose(surfaces.evaluate(face, parameters), expected, atol=1e-14)
    low, high = np.array([[-2.0, 0.5], [0, 0], [0, 0]]), np.array([[3.0, 0.5], [1, 1], [1, 1]])
    moved = surfaces.move_planes(low, high)
    np.testing.assert_allclose(moved.evaluate(face, parameters), expected, atol=1e-12)
    np.testing.assert_allclose(
        moved.evaluate_partials(face, parameters)[1:, 0], [[3, 1, 0], [0, 2, 0]], atol=1e-12
    )
    assert -2.01 < moved.low[0, 0] < -2
    assert moved.low[0, 1] < 0.5 < moved.high[0, 1]
    np.testing.assert_array_equal(moved.low[1:], 0)
    assert (surfaces.errors[1:] == 0).all()
    assert 0 < moved.errors[0] < 1e-13


def test_errors_are_those_of_patches_that_were_computed() -> None:
    """A Bézier net is as given; the Bézier points of a spline are rounded."""
    table = build_surfaces(np.random.default_rng(5), 40)
    surfaces = FaceSurfaces.of(table)
    given_points = set(map(tuple, table.points.tolist()))
    is_given = np.ones(len(table), bool)
    count = surfaces.faces.spans.prod(axis=0)
    points = [net for batch in surfaces.model.batches for net in batch.points]
    for f in range(len(table)):
        nets = points[surfaces.faces.first[f] : surfaces.faces.first[f] + count[f]]
        is_given[f] = set(map(tuple, np.concatenate(nets).reshape(-1, 3).tolist())) <= given_points
    assert 0 < is_given.sum() < len(table)
    assert (surfaces.errors[~is_given] > 0).all()
    assert surfaces.nets.lowering == surfaces.errors.max() < 1e-10
