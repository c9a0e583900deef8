"""Points inside faces: away from borders by a slow test, dense where surfaces bend."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.filling.inner_points import (
    NEAR,
    LeafPoints,
    find_leaf_points,
    find_points_inside,
)
from service.engine.brep.filling.scales import find_scales
from service.engine.trims.places import SIZE
from service.errors import TooLarge
from tests.engine.brep.filled_faces import (
    BUMP,
    CYLINDER,
    HOLE,
    PLANE,
    SQUARE,
    UNIT,
    build_surfaces,
    draw_inner_places,
    fill,
)

seeds = st.integers(0, 2**32 - 1)
WHOLE = np.zeros((3, 2), np.intp), np.full((3, 2), SIZE)


@given(seeds)
def test_points_near_segments_are_left_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    faces, places = draw_inner_places(filled, rng, 40)
    sizes = rng.integers(1, 6, (40, 2)) * UNIT * rng.choice([0.3, 1.0], (40, 1))
    points = LeafPoints(faces, places, sizes, np.ones((3, 2)))
    found = find_points_inside(points, filled.polygons, WHOLE)
    loops = [np.array(loop, float) * UNIT for loop in (SQUARE, HOLE)]
    for k in range(40):
        distances = []
        for loop in loops:
            a, b = (ends / sizes[k] for ends in (loop, np.roll(loop, -1, axis=0)))
            p = places[k] / sizes[k]
            share = ((p - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
            foot = a + np.clip(share, 0, 1)[:, np.newaxis] * (b - a)
            distances.append(np.hypot(*(foot - p).T).min())
        assert found[k] == (min(distances) >= NEAR)


def test_leaves_follow_the_tolerance_and_the_surface() -> None:
    surface = build_surfaces()
    faces = np.array([BUMP, CYLINDER])
    coarse, fine = (
        find_leaf_points(surface, faces, WHOLE, Goal(tolerance), MeshLimits())
        for tolerance in (0.05, 0.001)
    )
    for points in (coarse, fine):
        rows = np.column_stack([points.faces, points.places])
        assert len(np.unique(rows, axis=0)) == len(rows)
        assert (np.diff(points.faces) >= 0).all()
        assert ((points.places >= 0) & (points.places <= SIZE)).all()
        assert points.cells[PLANE].tolist() == [SIZE, SIZE]  # no leaves
    assert len(fine.faces) > 5 * len(coarse.faces)
    # A cylinder needs no points along its axis.
    on_cylinder = fine.places[fine.faces == CYLINDER]
    assert set(on_cylinder[:, 1]) == {0, SIZE}
    # The arc of a quarter in n pieces is 1 − cos(π / 4 n) from its chords.
    assert np.pi / 4 / np.arccos(1 - 0.001) <= len(on_cylinder) / 2 - 1 <= 64


def test_leaves_of_small_boxes_are_in_them() -> None:
    surface = build_surfaces()
    low, high = WHOLE[0] + SIZE // 3, WHOLE[0] + SIZE // 3 + 1000
    points = find_leaf_points(surface, np.arange(2), (low, high), Goal(1e-3), MeshLimits())
    assert (np.bincount(points.faces) == 4).all()
    assert (np.abs(points.places - SIZE // 3 - 500) <= 502).all()


def test_work_of_cells_is_limited() -> None:
    limits = MeshLimits(effort=Effort(limit=1000.0))
    with pytest.raises(TooLarge, match="work"):
        find_leaf_points(build_surfaces(), np.arange(2), WHOLE, Goal(1e-3), limits)


def test_scales_make_cells_square_in_space() -> None:
    surface = build_surfaces()
    equal = np.full((3, 2), float(SIZE))
    scales = find_scales(surface, *WHOLE, equal)
    assert (np.frexp(scales)[0] == 0.5).all()
    # The cylinder is π/2 long along u and 2 along v: cells as long as the whole are divided alike.
    assert scales[CYLINDER] == 1.0
    # Cells of 1/16 along u: v counts 1/16.
    cells = equal * [1 / 16, 1]
    assert find_scales(surface, *WHOLE, cells)[CYLINDER] == 1 / 16
