"""Random surfaces, and their points and channels at rational parameters in exact arithmetic."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from typing import Any, TypeVar

import numpy as np

from oracles.exact import surface_point, to_exact_net
from service.surface.bezier import BezierSurface
from service.surface.channels import Channels
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.kinds import Surface
from service.surface.patches import PatchSurface

PARAMETERS = (Fraction(0), Fraction(2, 7), Fraction(1, 2), Fraction(1))
GRID = tuple(product(PARAMETERS, PARAMETERS))

Kind = TypeVar("Kind", bound=Surface)
Values = list[float]
Evaluator = Callable[[Fraction, Fraction], Values]
"""A function of (u, v): the point and the values of all channels of a patch, in one list."""


def evaluate_values(
    net: Any, weights: Any, channels: Sequence[Any], u: Fraction, v: Fraction
) -> Values:
    """The point S(u, v), then the values of the channels there."""
    point = surface_point(to_exact_net(net, weights), u, v)
    if weights is not None:
        point = tuple(x / point[3] for x in point[:3])
    for values in channels:
        point += surface_point(to_exact_net(values), u, v)
    return [float(x) for x in point]


def build_bezier_evaluator(surface: BezierSurface) -> Evaluator:
    """The function of exact values of a surface of one patch."""
    nets = [net for _, _, _, net in surface.channels.each()]
    return lambda u, v: evaluate_values(surface.control_net, surface.weights, nets, u, v)


def build_patch_evaluator(surface: PatchSurface, patch: int) -> Evaluator:
    """The function of exact values of the patch with this number."""
    grid = surface.patches[patch]
    weights = None if surface.weights is None else surface.weights[grid]
    nets = [values[grid] for _, _, _, values in surface.channels.each()]
    return lambda u, v: evaluate_values(surface.vertices[grid], weights, nets, u, v)


def random_bezier(
    degree: tuple[int, int], seed: int, is_rational: bool, has_channels: bool = True
) -> BezierSurface:
    """A random patch: with channels of degrees (1, 2), (2, 1) and its own, or without channels."""
    rng = np.random.default_rng(seed)
    shape = degree[0] + 1, degree[1] + 1
    random_channels = Channels(
        colors=rng.uniform(0, 1, (2, 3, 4)),
        uvs=rng.uniform(-1, 1, (3, 2, 2)),
        attributes=(("heat", rng.uniform(-4, 4, (*shape, 1))),),
    )
    return BezierSurface(
        rng.uniform(-4, 4, (*shape, 3)),
        rng.uniform(0.2, 5, shape) if is_rational else None,
        "z",
        "sail",
        random_channels if has_channels else Channels(),
    )


def random_patches(degree: tuple[int, int], seed: int, is_rational: bool) -> PatchSurface:
    """Two random patches that share an edge; every vertex has a value of every channel."""
    rng = np.random.default_rng(seed)
    rows, columns = 2 * degree[0] + 1, degree[1] + 1
    grid = np.arange(rows * columns).reshape(rows, columns)
    return PatchSurface(
        rng.uniform(-4, 4, (grid.size, 3)),
        np.stack([grid[: degree[0] + 1], grid[degree[0] :]]),
        rng.uniform(0.2, 5, grid.size) if is_rational else None,
        parts=(("first", (0,)),),
        up="z",
        name="sail",
        channels=Channels(
            colors=rng.uniform(0, 1, (grid.size, 3)),
            attributes=(("heat", rng.uniform(-4, 4, (grid.size, 2))),),
        ),
    )


def assert_same(
    actual: Evaluator,
    expected: Evaluator,
    change: Callable[[Fraction, Fraction], tuple[Fraction, Fraction]] = lambda u, v: (u, v),
) -> None:
    """Checks that actual(u, v) is expected(change(u, v)), up to 1e-12 times 4.

    4 is the largest coordinate.
    """
    for u, v in GRID:
        np.testing.assert_allclose(actual(u, v), expected(*change(u, v)), rtol=0, atol=4e-12)


def convert_to(kind: type[Kind], surface: Surface, *operations: Operation) -> Kind:
    """The result of the operations, which must be of this kind and keep `up` and name."""
    result = convert(surface, operations)
    assert isinstance(result, kind)
    assert (result.up, result.name) == ("z", "sail")
    return result
