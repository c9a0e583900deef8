"""Closed surfaces and poles are found; surfaces beyond their domains repeat themselves."""

import numpy as np
import pytest
from hypothesis import given

from service.engine.trims.closure import find_closure
from service.engine.trims.surfaces import FaceSurfaces
from service.engine.trims.unrolling import unroll
from service.surface.spline_tables import SurfaceTable
from tests.engine.brep.closed_faces import KINDS, LONG, WIDE, build_face
from tests.engine.trims.tables import seeds


def build_surfaces() -> SurfaceTable:
    """One surface of each kind."""
    tables = [build_face(kind, []).surfaces for kind in KINDS]
    columns = [
        np.concatenate([getattr(table, name) for table in tables])
        for name in ("degrees", "counts", "points", "weights", "is_rational", "knots")
    ]
    return SurfaceTable(*columns)


def test_closed_axes_and_poles_are_found() -> None:
    closed = find_closure(FaceSurfaces.of(build_surfaces()), 1e-9)
    assert closed.is_closed.tolist() == [[True, False], [True, False], [True, True]]
    assert closed.is_pole[:, 0].sum() == 0
    assert closed.is_pole[:, 1].tolist() == [[False, False], [True, True], [False, False]]


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
def test_surfaces_narrower_than_the_tolerance_are_closed_or_not_all_the_same(
    tolerance: float,
) -> None:
    table = build_surfaces()
    table.points[:] *= [1e-4, 1e-4, 1.0]
    tube = find_closure(FaceSurfaces.of(table), tolerance)
    assert tube.is_closed[0].tolist() == [True, False]
    assert not tube.is_pole[0].any()
    # A slit along the tube, a tenth of its radius wide.
    table.points[42:49, :2] += [0.0, 1e-5]
    strip = find_closure(FaceSurfaces.of(table), tolerance)
    assert not strip.is_closed[0].any()
    assert not strip.is_pole[0].any()


def test_a_point_is_a_pole_however_small_the_surface() -> None:
    table = build_surfaces()
    table.points[:] *= 1e-7
    closed = find_closure(FaceSurfaces.of(table), 1e-3)
    assert closed.is_closed.tolist() == [[True, False], [True, False], [True, True]]
    assert closed.is_pole[:, 1].tolist() == [[False, False], [True, True], [False, False]]


@given(seeds)
def test_unrolled_surfaces_repeat_themselves(seed: int) -> None:
    rng = np.random.default_rng(seed)
    closed = find_closure(FaceSurfaces.of(build_surfaces()), 1e-9)
    low = closed.low + rng.integers(-3, 3, (3, 2)) / 2 * closed.period
    high = low + rng.integers(1, 5, (3, 2)) / 2 * closed.period
    low, high = (np.where(closed.is_closed, x, y) for x, y in ((low, 0.0), (high, [WIDE, LONG])))
    unrolled = unroll(closed, low, high)
    assert (unrolled.low <= low + 1e-9).all()
    assert (unrolled.high >= high - 1e-9).all()
    face = np.repeat(np.arange(3), 40)
    parameters = low[face] + rng.random((120, 2)) * (high - low)[face]
    np.testing.assert_allclose(
        unrolled.evaluate(face, parameters), closed.evaluate(face, parameters), rtol=0, atol=1e-12
    )


def test_loops_inside_the_domain_need_no_unrolling() -> None:
    surfaces = FaceSurfaces.of(build_surfaces())
    closed = find_closure(surfaces, 1e-9)
    assert unroll(closed, surfaces.low, surfaces.high) is surfaces
    nowhere = np.full((3, 2), np.inf)
    assert unroll(closed, nowhere, -nowhere) is surfaces
