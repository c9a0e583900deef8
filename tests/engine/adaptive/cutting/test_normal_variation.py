"""Angles of normals in cells, compared with exact angles; and cells whose angles no cut reduces."""

from math import asin, pi, sin

import numpy as np
import pytest

from service.bases.arrays import Bools
from service.engine.adaptive.cutting.normal_variation import (
    FINEST,
    ROUGH,
    Scale,
    compare_normals,
    estimate_normals,
    find_chord,
    find_height_limit,
)
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.surface.bspline import BsplineSurface
from tests.engine.adaptive.cutting.test_subdivision import build_leaves
from tests.strategies import Array, build_model

HALVES = np.array([0.0, 0.5, 1.0])


def shape_nine_points(points: Array) -> Array:
    """Nine points of one cell, (3, 3, 3) for u, v and coordinates, as (3, 3, 3, 1)."""
    return points[..., np.newaxis]


def build_arc(turn: float, radius: float = 1.0) -> Array:
    """Nine points of a cell of a cylinder whose normals turn by `turn` along u."""
    u, v = np.meshgrid(turn * HALVES, HALVES, indexing="ij")
    return shape_nine_points(np.stack([radius * np.sin(u), v, -radius * np.cos(u)], axis=-1))


def build_scale(share_u: float, share_v: float, size: float = 1e3) -> Scale:
    """The scale of a cell with these shares of its span in a patch of this size in space.

    The default size is so large that only the shares tell whether the cell is small.
    """
    return Scale(np.array([[share_u], [share_v]]), np.array([size]))


def find_cut(cuts: tuple[Bools, Bools]) -> tuple[bool, bool]:
    """Whether the only cell is cut for its normals, and whether its v is halved."""
    return bool(cuts[0][0]), bool(cuts[1][0])


@pytest.mark.parametrize("turn", [0.05, 0.2, 0.6])
def test_an_arc_turns_by_its_angle(turn: float) -> None:
    """The angle is that along u, or along v for the transposed arc; across the arc it is 0."""
    for angle, exceeds in ((0.95 * turn, True), (1.05 * turn, False)):
        at = build_arc(turn)
        assert find_cut(compare_normals(at, angle, build_scale(1, 1))) == (exceeds, False)
        result = compare_normals(at.swapaxes(0, 1), angle, build_scale(1, 1))
        assert find_cut(result) == (exceeds, True)


@pytest.mark.parametrize("noise", [0.0, 1e-15])
def test_the_normal_at_a_pole_is_extrapolated_from_its_neighbours(noise: float) -> None:
    """The cap of a sphere, also if the points of its pole differ by rounding."""
    u, v = np.meshgrid(0.5 * HALVES, 0.2 * HALVES, indexing="ij")
    cap = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
    cap[1, 0, 1] += noise
    result = estimate_normals(shape_nine_points(cap))
    # The pole is the side v = 0: all three samples there have the normal ±z.
    for i in range(3):
        apart = np.linalg.norm(np.abs(result[i][0][:, 0]) - [0.0, 0.0, 1.0])
        assert 2 * asin(apart / 2) < 0.02


def build_fold(skew: float) -> Array:
    """A sheet folded on itself along u + skew v = 0.3 (1 + skew): it turns by π in one half."""
    u, v = np.meshgrid(HALVES, HALVES, indexing="ij")
    return shape_nine_points(np.stack([(u + skew * v - 0.3 * (1 + skew)) ** 2, v, 0 * u], axis=-1))


@pytest.mark.parametrize(("skew", "least"), [(1.0, ROUGH), (0.0, FINEST)])
def test_a_fold_is_not_cut_for_ever(skew: float, least: float) -> None:
    """A fold along v adds one cell at every halving; any other fold doubles the cells along it.

    So cells at a fold along v may become as short as `FINEST`, others only as short as `ROUGH`.
    """
    large, small = (
        find_cut(compare_normals(build_fold(skew), 0.5, build_scale(s, s)))
        for s in (2 * least, least)
    )
    assert large == (True, False)
    assert small[0] is False


@pytest.mark.parametrize("angle", [0.1, 1.0, 3.0])
def test_a_roof_at_the_height_limit_turns_by_the_angle(angle: float) -> None:
    """A roof over a chord of length 2: each half rises over a length of 1."""
    height = find_height_limit(angle, np.array([2.0]))[0]
    assert 2 * np.arctan(height) == pytest.approx(angle)
    assert find_chord(angle) == pytest.approx(2 * sin(angle / 2))
    assert find_height_limit(pi, np.array([2.0]))[0] == np.inf
    # A cell that is small in one direction is not cut for its height.
    assert find_height_limit(angle, np.array([2.0]), build_scale(1, ROUGH))[0] == np.inf


def test_bends_between_nine_places_are_not_missed() -> None:
    """A wave of degree 8 along u is 0 at u = 0, ½ and 1, so all nine points are in one plane."""
    t = np.linspace(0, 1, 9)
    wave = np.array([0, 0, 0.0, 2.0, 0.0, -2.0, 0, 0, 0])
    net = np.stack(
        [np.tile(t[:, None], 2), np.tile([0.0, 1.0], (9, 1)), np.tile(wave[:, None], 2)], axis=-1
    )
    assert len(build_leaves(build_model([net]), Goal(np.inf, 0.3))) > 8
    assert len(build_leaves(build_model([net]), Goal(np.inf))) == 1


def build_cusp(c: float) -> tuple[list[float], list[float]]:
    """Nets, of degree 3, of (t − c)² and (t − c)³: the coordinates of a curve with a cusp at c."""
    d = 1.0 - c
    square = [c * c, (c * c - 2 * c * d) / 3, (d * d - 2 * c * d) / 3, d * d]
    return square, [-(c**3), c * c * d, -c * d * d, d**3]


def test_leaves_at_a_cusp_are_not_cut_for_ever() -> None:
    """A cusp along u within a patch adds a leaf at every halving, until leaves are too short."""
    square, cube = build_cusp(0.4)
    net = np.stack(
        [np.tile([[0.0], [1.0]], 4), np.tile(square, (2, 1)), np.tile(cube, (2, 1))], axis=-1
    )
    leaves = build_leaves(build_model([net]), Goal(np.inf, 0.3))
    assert len(leaves) < 64
    least = (leaves.extents).min() / SPAN
    assert FINEST <= least < ROUGH


@pytest.mark.parametrize("spans", [(1, 5), (5, 1), (4, 4)])
def test_division_of_spans_ends_as_that_of_patches_does(spans: tuple[int, int]) -> None:
    """B-splines that fold back along a line of parameters, or are lines."""
    shape = tuple(n + 3 for n in spans)
    u, v = np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in shape), indexing="ij")
    for axis, t in enumerate((u, v)):
        net = np.stack([u, v, np.abs(t) ** 0.1], axis=-1)
        net[..., axis] = 0.0
        for points in (net, np.stack([t, 0 * t, 0 * t], axis=-1)):
            model = BsplineSurface(points, (3, 3), ("clamped", "clamped")).lower()
            assert len(build_leaves(model, Goal(np.inf, 0.3))) < 600


def test_a_cell_that_is_large_in_space_is_cut_though_small_in_parameters() -> None:
    """A cell of length 1 with a fold is cut if its patch has the size 1, but not the size 50."""
    assert (
        find_cut(compare_normals(build_fold(1.0), 0.5, build_scale(ROUGH, ROUGH, size=1.0)))[0]
        is True
    )
    assert (
        find_cut(compare_normals(build_fold(1.0), 0.5, build_scale(ROUGH, ROUGH, size=50.0)))[0]
        is False
    )


def test_turns_across_a_narrow_cell_are_not_cut_lengthwise() -> None:
    """A cell that is too narrow to be cut across is not cut along its length for ever."""
    u, v = np.meshgrid(HALVES, 1e-6 * HALVES, indexing="ij")
    trough = shape_nine_points(np.stack([u, v, 5e5 * v * v + 0.05 * u * u], axis=-1))
    result = compare_normals(trough, 0.5, build_scale(1.0, 1.0, size=1.0))
    assert find_cut(result)[0] is False
