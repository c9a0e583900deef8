"""Strips between rows, compared with samples of the bilinear surface and of both triangles."""

import numpy as np
import pytest

from oracles.distance import measure_distances
from service.engine.round_sweeps.certificate import find_sagitta, measure_strips
from tests.strategies import Array

SHARES = np.stack(np.meshgrid(*[np.linspace(0, 1, 21)] * 2), axis=-1).reshape(-1, 2)


def sample_bilinear(low: Array, high: Array) -> Array:
    """Points of the bilinear surface between two sides, (2, 3) each."""
    s, t = SHARES.T[:, :, None]
    points: Array = (1 - s) * ((1 - t) * low[0] + t * low[1]) + s * (
        (1 - t) * high[0] + t * high[1]
    )
    return points


@pytest.mark.parametrize("seed", range(40))
def test_strips_are_within_their_bound_of_two_triangles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flat = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0.0]]])
    rows = flat + rng.normal(size=(2, 2, 3)) * 10.0 ** rng.uniform(-3, 0)
    bound = measure_strips(rows, np.array([True]))[0]
    triangles = np.array(
        [[rows[0, 0], rows[1, 0], rows[0, 1]], [rows[1, 0], rows[1, 1], rows[0, 1]]]
    )
    points = sample_bilinear(*rows)
    distances = np.min(
        [measure_distances(points, np.tile(each, (len(points), 1, 1))) for each in triangles],
        axis=0,
    )
    assert distances.max() <= bound * (1 + 1e-12) + 1e-15


def test_a_trapezoid_is_flat_and_so_is_a_strip_with_two_equal_corners() -> None:
    rows = np.array([[[0, 0, 0], [1, 0, 0]], [[0.4, 1, 2], [0.6, 1, 2]], [[0.5, 2, 4]] * 2])
    assert (measure_strips(rows, np.array([True, True])) < 1e-15).all()


def test_the_sagitta_is_that_of_a_polygon() -> None:
    angle = np.linspace(0, 2 * np.pi, 2001)
    for sides in (3, 4, 17):
        corner = 2 * np.pi * np.arange(sides) / sides
        normals = np.stack([np.cos(corner + np.pi / sides), np.sin(corner + np.pi / sides)])
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        outside = (circle @ normals - np.cos(np.pi / sides)).max()
        assert outside <= find_sagitta(sides) <= outside * (1 + 1e-5)
