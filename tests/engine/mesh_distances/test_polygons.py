"""Parts of cut polygons cover them, whatever the numbers at their corners are."""

import numpy as np
import pytest

from service.bases.arrays import Bools, FloatArray
from service.engine.mesh_distances.polygons import Polygons, join_polygons


def build_polygon(corners: FloatArray) -> Polygons:
    """One polygon with corners (k, 2) in a plane."""
    points = np.vstack([corners.T, np.zeros(len(corners))])
    return Polygons(
        points, np.array([len(corners)]), np.array([7]), np.array([5]), np.zeros(1, np.intp)
    )


def build_regular(count: int) -> FloatArray:
    """The corners (count, 2) of a regular polygon."""
    angles = 2 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def list_polygons(polygons: Polygons) -> list[FloatArray]:
    """The corners (k, 2) of each polygon."""
    return [part.T for part in np.split(polygons.corners[:2], polygons.starts[1:], axis=1)]


def measure_area(corners: FloatArray) -> float:
    """The area of a polygon with corners (k, 2)."""
    (x, y), (next_x, next_y) = corners.T, np.roll(corners, -1, axis=0).T
    return float((x * next_y - next_x * y).sum() / 2)


def is_inside(points: FloatArray, corners: FloatArray) -> Bools:
    """Whether points (m, 2) are in a convex polygon, or hardly outside."""
    way = np.roll(corners, -1, axis=0) - corners
    relative = points[:, np.newaxis] - corners
    inside = way[:, 0] * relative[..., 1] - way[:, 1] * relative[..., 0] >= -1e-12
    result: Bools = np.all(inside, axis=1)
    return result


@pytest.mark.parametrize("seed", range(6))
def test_parts_cover_the_polygon(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = build_regular(int(rng.integers(3, 9)))
    polygon = build_polygon(corners)
    samples = rng.dirichlet(np.full(len(corners), 0.5), 300) @ corners
    choices = rng.integers(-1, 2, len(corners)).astype(np.float64), rng.normal(size=len(corners))
    for numbers in choices:
        parts = [part for both in polygon.cut(numbers) for part in list_polygons(both)]
        assert np.any([is_inside(samples, part) for part in parts], axis=0).all()


def test_a_line_divides_polygons_without_an_overlap() -> None:
    shapes = [build_regular(5), 0.5 * build_regular(3), build_regular(4) + 3.0]
    polygons = join_polygons([build_polygon(shape) for shape in shapes])
    below, above = polygons.cut(polygons.corners[0] - 0.1)
    assert below.sizes.tolist() == [4, 4]
    assert above.sizes.tolist() == [5, 3, 4]
    assert below.cuts.tolist() == [1, 1]
    assert above.cuts.tolist() == [1, 1, 0]
    areas = sum(measure_area(part) for part in list_polygons(below) + list_polygons(above))
    assert areas == pytest.approx(sum(measure_area(shape) for shape in shapes), rel=1e-14)


def test_a_polygon_that_touches_the_line_stays_whole() -> None:
    polygon = build_polygon(build_regular(4))
    for numbers, whole in (([0, 1, 2, 1], 1), ([0, -1, -2, -1], 0), ([0, 0, 0, 0], 0)):
        parts = polygon.cut(np.array(numbers, np.float64))
        assert len(parts[1 - whole]) == 0
        assert (parts[whole].corners == polygon.corners).all()
        assert parts[whole].cuts.tolist() == [0]


def test_values_at_corners() -> None:
    polygons = join_polygons([build_polygon(build_regular(3)), build_polygon(build_regular(4))])
    values = np.array([1.0, 3, 2, 9, 7, 8, 6])
    assert polygons.find_largest(values).tolist() == [3, 9]
    assert polygons.find_worst(values).tolist() == [1, 3]
    assert np.abs(polygons.find_centers()).max() < 1e-15
    assert polygons.take(np.array([1])).corners.tolist() == polygons.corners[:, 3:].tolist()
