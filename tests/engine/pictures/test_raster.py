"""Which triangle each pixel shows: compared with a search over all triangles at every sample."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import Ints
from service.engine.pictures import raster
from service.engine.pictures.raster import SAMPLES, Visible, find_visible
from tests.strategies import Array


def draw(corners: Array, depths: Array, triangles: Ints, size: tuple[int, int]) -> Visible:
    """The pairs of all strips."""
    strips = list(find_visible(corners, depths, triangles, size))
    return Visible(
        np.concatenate([each.pixel for each in strips]),
        np.concatenate([each.triangle for each in strips]),
        np.concatenate([each.share for each in strips]),
        np.concatenate([each.weights for each in strips], axis=1),
    )


def search(
    corners: Array, depths: Array, triangles: Ints, size: tuple[int, int]
) -> dict[tuple[int, int], float]:
    """The shares of pairs (pixel, triangle), by solving a system for each sample and triangle."""
    shares: dict[tuple[int, int], float] = {}
    width, height = size
    for row in range(height * SAMPLES):
        for column in range(width * SAMPLES):
            ray = np.array([(column + 0.5) / SAMPLES, (row + 0.5) / SAMPLES, 1.0])
            nearest, shown = np.inf, -1
            for number, triangle in enumerate(triangles):
                matrix = corners[:, triangle]
                if abs(np.linalg.det(matrix)) < 1e-12:
                    continue
                weights = np.linalg.solve(matrix, ray)
                if (weights >= 0).all() or (weights <= 0).all():
                    depth = float(weights @ depths[triangle] / weights.sum())
                    if 0 < depth < nearest:
                        nearest, shown = depth, number
            if shown >= 0:
                key = row // SAMPLES * width + column // SAMPLES, shown
                shares[key] = shares.get(key, 0.0) + 1 / SAMPLES**2
    return shares


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_each_sample_shows_the_nearest_triangle(seed: int, orthographic: bool) -> None:
    """Some triangles reach behind the eye, and out of the picture."""
    rng, size = np.random.default_rng(seed), (7, 5)
    points = rng.uniform(-1, 1, (3, 24))
    depths = points[2] + 0.6
    w = np.ones(24) if orthographic else depths
    middle = np.array(size) / 2
    corners = np.stack([*(5 * points[:2] + middle[:, None] * w), w])
    triangles = np.array([rng.choice(24, 3, replace=False) for _ in range(20)])
    visible = draw(corners, depths, triangles, size)
    pairs = zip(visible.pixel.tolist(), visible.triangle.tolist(), strict=True)
    found = dict(zip(pairs, visible.share.tolist(), strict=True))
    assert found == search(corners, depths, triangles, size)
    assert (np.diff(visible.pixel) >= 0).all()
    np.testing.assert_allclose(visible.weights.sum(axis=0), 1.0, rtol=1e-12)
    assert (visible.weights >= 0).all()


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_triangles_with_common_edges_leave_no_sample_out_and_share_none(
    seed: int, snapped: bool
) -> None:
    """A fan that covers the picture; its corners may be at samples, and its edges along rows."""
    rng = np.random.default_rng(seed)
    size = (6, 4)
    rim = np.array([[-1, -1], [3, -1], [8, -1], [8, 2], [8, 6], [2, 6], [-1, 6], [-1, 3]], float)
    points = np.concatenate([rim, rng.uniform((0, 0), size, (1, 2))])
    if snapped:
        points = np.round(points * 4) / 4
    count = len(rim)
    fan = [(k, (k + 1) % count, count)[:: rng.choice((-1, 1))] for k in range(count)]
    corners = np.stack([*points.T, np.ones(count + 1)])
    visible = draw(corners, np.ones(count + 1), np.array(fan), size)
    total = np.bincount(visible.pixel, visible.share, size[0] * size[1])
    assert (total == 1.0).all()
    # Each sample belongs to one triangle, so each alone draws what it shows among the others.
    for number, triangle in enumerate(fan):
        alone = draw(corners, np.ones(count + 1), np.array([triangle]), size)
        rows = visible.triangle == number
        np.testing.assert_array_equal(alone.pixel, visible.pixel[rows])
        np.testing.assert_array_equal(alone.share, visible.share[rows])


def test_of_equal_triangles_the_first_is_shown() -> None:
    corners, depths = np.array([[0.0, 4, 0], [0, 0, 4], [1, 1, 1]]), np.ones(3)
    for triangles in ([[0, 1, 2], [0, 1, 2]], [[2, 1, 0], [0, 1, 2]]):
        assert set(draw(corners, depths, np.array(triangles), (4, 4)).triangle.tolist()) == {0}


def test_triangles_without_area_and_behind_the_eye_are_not_shown() -> None:
    corners = np.array([[0.0, 4, 8, 0], [0, 0, 0, 4], [1, 1, 1, 1]])
    assert not len(draw(corners, np.ones(4), np.array([[0, 1, 2]]), (4, 4)).pixel)
    assert not len(draw(-corners, -np.ones(4), np.array([[0, 1, 3]]), (4, 4)).pixel)
    assert not len(draw(corners, np.ones(4), np.zeros((0, 3), int), (4, 4)).pixel)


def test_the_result_does_not_depend_on_strips_and_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-3, 20, (2, 60))
    corners, depths = np.stack([*points, np.ones(60)]), rng.uniform(1, 2, 60)
    triangles = rng.integers(0, 60, (50, 3))
    whole = draw(corners, depths, triangles, (16, 16))
    monkeypatch.setattr(raster, "STRIP_PIXELS", 40)
    monkeypatch.setattr(raster, "FRAGMENTS", 50)
    parts = draw(corners, depths, triangles, (16, 16))
    for name in ("pixel", "triangle", "share", "weights"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
