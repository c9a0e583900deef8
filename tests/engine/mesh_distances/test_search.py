"""Intervals of the largest distance between meshes, compared with samples and known answers."""

from collections.abc import Callable
from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.cancellation import Cancellation, Cancelled, cancelled_by
from service.engine.mesh_distances.nearest import find_nearest
from service.engine.mesh_distances.search import LargestDistance, bound_largest_distance
from service.engine.mesh_distances.tree import TriangleTree
from tests.engine.mesh_distances.meshes import (
    build_sheet,
    globe,
    measure_exactly,
    saddle,
    sample_triangles,
    wave,
)

SQUARE = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]])


def measure(a: FloatArray, b: FloatArray, relative_width: float = 0.1) -> LargestDistance:
    """The largest distance of A from B."""
    return bound_largest_distance(a, TriangleTree(b), relative_width=relative_width, floor=1e-12)


def scatter(seed: int) -> FloatArray:
    """Triangles without any order, each of them three times."""
    rng = np.random.default_rng(seed)
    corners = 0.3 * rng.normal(size=(60, 3, 3)) + rng.normal(size=(60, 1, 3))
    return np.concatenate([corners] * 3)


PAIRS: dict[str, Callable[[], tuple[FloatArray, FloatArray]]] = {
    "two meshes": lambda: (build_sheet(wave, 12, 13), build_sheet(wave, 17, 9)),
    "fine and coarse": lambda: (build_sheet(wave, 40, 40), build_sheet(wave, 5, 6)),
    "coarse and fine": lambda: (build_sheet(wave, 5, 6), build_sheet(wave, 40, 40)),
    "saddle": lambda: (build_sheet(saddle, 9, 9), build_sheet(saddle, 11, 8)[:, ::-1]),
    "spheres": lambda: (build_sheet(globe, 9, 11), 1.01 * build_sheet(globe, 13, 12)),
    "soup": lambda: (scatter(0), scatter(1)),
    "hole": lambda: (build_sheet(wave, 9, 9), np.delete(build_sheet(wave, 9, 9), 40, axis=0)),
    "far": lambda: (build_sheet(wave, 6, 6) + 1e6, build_sheet(wave, 6, 6)),
    "needles": lambda: (build_sheet(wave, 3, 150), build_sheet(wave, 100, 2)),
}


@pytest.mark.parametrize("name", PAIRS)
def test_intervals_contain_samples_and_are_narrow(name: str) -> None:
    a, b = PAIRS[name]()
    tree = TriangleTree(b)
    largest = bound_largest_distance(a, tree, relative_width=0.05, floor=1e-12)
    assert largest.reached
    assert largest.low <= largest.high
    assert largest.high - largest.low <= max(0.05 * largest.high, 1e-12)
    samples = find_nearest(tree, sample_triangles(a, 4000))
    assert samples.low.max() <= largest.high
    # The place that is named has this distance.
    assert find_nearest(tree, largest.point[np.newaxis]).high[0] >= largest.low
    assert find_nearest(tree, a.reshape(-1, 3)).low.max() <= largest.high


@pytest.mark.parametrize(
    ("a", "b", "distance"),
    [
        (SQUARE, SQUARE, 0.0),
        (SQUARE * 0.5 + 0.25, SQUARE, 0.25),
        (SQUARE, SQUARE + np.array([0, 0, 3]), 3.0),
        (SQUARE, SQUARE[:1], sqrt(0.5)),
        # over a valley: the floor is furthest from the walls on the line between them
        (
            np.array([[[-1.0, -1, 1], [1, -1, 1], [0, 1, 1]]]),
            np.array(
                [
                    [[0.0, -9, 0], [0, 9, 0], [9, 0, 9]],
                    [[0.0, -9, 0], [0, 9, 0], [-9, 0, 9]],
                ]
            ),
            sqrt(0.5),
        ),
        # a segment over the middle of a hole
        (np.array([[[0.0, 0, 0], [2, 0, 0], [2, 0, 0]]]), np.zeros((1, 3, 3)), 2.0),
    ],
)
def test_known_distances(a: FloatArray, b: FloatArray, distance: float) -> None:
    largest = measure(a, b, 1e-6)
    assert largest.low <= distance <= largest.high
    assert largest.high - largest.low <= 1e-6 * distance + 1e-12


def test_a_flat_mesh_on_a_flat_mesh_ends_at_once() -> None:
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    flat = build_sheet(lambda u, v: (u, v, 0 * u), 12, 12)
    tree = TriangleTree(3 * build_sheet(lambda u, v: (u, v, 0 * u), 19, 17) - [1, 1, 0])
    for floor in (1e-11, 0.0):
        largest = bound_largest_distance(
            flat @ turn.T, tree, relative_width=0.1, floor=floor, effort=3000
        )
        assert largest.reached
        assert largest.high < 1e-11


def test_moved_and_enlarged_meshes_have_the_same_distances() -> None:
    a, b = build_sheet(wave, 5, 6), build_sheet(wave, 7, 8)
    first = measure(a, b)
    for size, shift in ((2.0**90, 0.0), (2.0**-40, 0.0), (1.0, 1e6)):
        other = bound_largest_distance(
            a * size + shift,
            TriangleTree(b * size + shift),
            relative_width=0.1,
            floor=1e-12 * size,
        )
        assert other.low / size == pytest.approx(first.low, rel=1e-6)
        assert other.high / size == pytest.approx(first.high, rel=1e-6)


@pytest.mark.parametrize(("a_size", "b_size"), [(3e38, 1e-300), (1e-300, 3e38)])
def test_very_large_and_very_small_coordinates(a_size: float, b_size: float) -> None:
    # Both surfaces contain the origin, and one of them is hardly more than this point.
    a, b = build_sheet(wave, 3, 3) * a_size, build_sheet(wave, 4, 5) * b_size
    largest = bound_largest_distance(a, TriangleTree(b), relative_width=0.1, floor=0.0)
    distance = np.linalg.norm(a / 3e38, axis=-1).max() * 3e38
    assert largest.low <= distance * (1 + 1e-12)
    assert largest.high >= distance * (1 - 1e-12)
    assert largest.reached
    assert largest.high - largest.low <= 1e-11 * max(a_size, b_size)


def test_less_effort_gives_wider_intervals() -> None:
    a, b = build_sheet(wave, 6, 6), build_sheet(wave, 30, 30)
    full = measure(a, b)
    for effort in (0, 100, 1000):
        less = bound_largest_distance(
            a, TriangleTree(b), relative_width=0.1, floor=1e-12, effort=effort
        )
        assert not less.reached
        assert less.low <= full.high
        assert less.high >= full.low


def test_equal_requests_have_equal_answers() -> None:
    a, b = build_sheet(saddle, 9, 9), build_sheet(wave, 8, 8)
    first, second = measure(a, b), measure(a, b)
    assert (first.low, first.high, first.source) == (second.low, second.high, second.source)
    assert (first.point == second.point).all()


@given(
    corners=arrays(np.int8, st.tuples(st.integers(2, 7), st.just(3), st.just(3))),
    count=st.integers(1, 6),
    exponent=st.integers(-80, 80),
)
def test_any_triangles(corners: NDArray[np.int8], count: int, exponent: int) -> None:
    # Whole numbers make equal, touching, crossing, flat and degenerate triangles.
    soup = np.ldexp((corners // 16).astype(np.float64), exponent)
    a, b = soup[: min(count, len(soup) - 1)], soup[min(count, len(soup) - 1) :]
    size = 2.0**exponent
    largest = bound_largest_distance(
        a, TriangleTree(b), relative_width=0.05, floor=1e-9 * size, effort=20_000
    )
    assert largest.reached
    distances = measure_exactly(sample_triangles(a, 20), b).min(axis=1)
    assert distances.max() <= largest.high + 1e-14 * size
    assert measure_exactly(largest.point[np.newaxis], b).min() >= largest.low - 1e-14 * size


def test_a_search_can_be_cancelled() -> None:
    cancellation = Cancellation()
    cancellation.cancel()
    with cancelled_by(cancellation), pytest.raises(Cancelled):
        measure(build_sheet(wave, 3, 3), build_sheet(wave, 2, 2))
