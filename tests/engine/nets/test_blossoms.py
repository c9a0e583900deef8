"""Nets over boxes and triangles are the same surfaces as by exact de Casteljau."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from oracles import exact, triangles
from service.engine.nets.blossoms import build_triangle_nets, restrict

Array = np.ndarray
DEGREES = [(1, 1), (1, 4), (3, 3), (2, 3), (5, 2)]


def draw_parameters(rng: np.random.Generator, count: int) -> Array:
    """Parameters that are multiples of 1/32."""
    return rng.integers(0, 33, (count, 1)) / 32


def evaluate_net(net: Array, u: Fraction, v: Fraction) -> exact.Vector:
    return exact.surface_point(exact.to_exact_net(net), u, v)


def assert_near(point: exact.Vector, expected: exact.Vector) -> None:
    assert max(abs(a - b) for a, b in zip(point, expected, strict=True)) < Fraction(1, 10**14)


@pytest.mark.parametrize(("p", "q"), DEGREES)
def test_nets_over_triangles_are_the_surface(p: int, q: int) -> None:
    rng = np.random.default_rng(p * 10 + q)
    net = rng.normal(size=(p + 1, q + 1, 3))
    u, v = draw_parameters(rng, 3), draw_parameters(rng, 3)
    built = build_triangle_nets(np.moveaxis(net, 2, 0)[np.newaxis], np.stack([u, v], axis=1))[0]
    oracle = triangles.to_exact_triangle(built.T)
    for place in triangles.places(4):
        a, b = (
            sum(
                (x * Fraction(float(t)) for x, t in zip(place, axis[:, 0], strict=True)),
                Fraction(0),
            )
            for axis in (u, v)
        )
        assert_near(triangles.value(oracle, place), evaluate_net(net, a, b))


@pytest.mark.parametrize(("p", "q"), DEGREES)
def test_nets_over_boxes_are_the_surface(p: int, q: int) -> None:
    rng = np.random.default_rng(p * 10 + q + 1)
    net = rng.normal(size=(p + 1, q + 1, 3))
    u, v = draw_parameters(rng, 2), draw_parameters(rng, 2)
    built = restrict(np.moveaxis(net, 2, 0)[np.newaxis], np.stack([u, v], axis=1))
    box_net = np.moveaxis(built[0], 0, 2)
    (begin_u, end_u), (begin_v, end_v) = (
        [Fraction(float(t)) for t in axis[:, 0]] for axis in (u, v)
    )
    for _, s, t in triangles.places(4):
        expected = evaluate_net(
            net, begin_u + s * (end_u - begin_u), begin_v + t * (end_v - begin_v)
        )
        assert_near(evaluate_net(box_net, s, t), expected)


@pytest.mark.parametrize(("p", "q"), DEGREES)
def test_nets_that_are_not_ordered_have_the_same_points(p: int, q: int) -> None:
    """With `ordered=False` only the order of the points of a net may be different.

    Halves of boxes and triangles of fans take a shorter way then, all other triangles the usual
    one. The triangles have both windings and each first corner, and are alone or with others.
    """
    rng = np.random.default_rng(p * 10 + q + 2)
    box = [(0.25, 0.5), (0.75, 0.5), (0.75, 0.625), (0.25, 0.625)]
    middles = [(0.5, 0.5), (0.75, 0.5625), (0.5, 0.625), (0.25, 0.5625)]
    # A triangle of a fan has the shape of a side of a box with the middle of the opposite side.
    fans = [(box[k], box[(k + 1) % 4], middles[(k + 2) % 4]) for k in range(4)]
    corners = [list(half) for half in permutations(box, 3)]  # 24 halves of the box
    corners += [list(triangle) for fan in fans for triangle in permutations(fan)]  # 24 of fans
    corners += [[*box[:2], (0.5, 0.6)], [*box[:2], (0.375, 0.625)]]  # two others
    parameters = np.moveaxis(np.array(corners), 0, -1)
    nets = np.repeat(rng.normal(size=(1, 3, p + 1, q + 1)), len(corners), axis=0)
    ordered = build_triangle_nets(nets, parameters)
    for some in (slice(None), slice(0, 24), slice(24, 48), slice(24, 25)):
        built = build_triangle_nets(nets[some], parameters[..., some], ordered=False)
        for one, other in zip(built, ordered[some], strict=True):
            # Each point of one net is a point of the other, and the reverse.
            away = np.linalg.norm(one[:, :, np.newaxis] - other[:, np.newaxis], axis=0)
            assert max(away.min(axis=0).max(), away.min(axis=1).max()) < 1e-14
