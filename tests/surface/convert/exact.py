"""Points and channels of surfaces at rational parameters, in exact arithmetic, and random nets."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from typing import Any, TypeVar

import numpy as np

from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.channels import Channels
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.patches import PatchSurface
from tests.oracles.exact import surface_point, to_exact_net

SHARES = (Fraction(0), Fraction(2, 7), Fraction(1, 2), Fraction(1))
GRID = tuple(product(SHARES, SHARES))

Kind = TypeVar("Kind", bound=Surface)
Values = list[float]
Evaluation = Callable[[Fraction, Fraction], Values]
"""The point and all channels of a patch, one number after the other."""


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


def define_bezier_values(surface: BezierSurface) -> Evaluation:
    """Exact values of a surface of one patch."""
    nets = [net for _, _, _, net in surface.channels.each()]
    return lambda u, v: evaluate_values(surface.control_net, surface.weights, nets, u, v)


def define_patch_values(surface: PatchSurface, patch: int) -> Evaluation:
    """Exact values of one patch of many."""
    grid = surface.patches[patch]
    weights = None if surface.weights is None else surface.weights[grid]
    nets = [values[grid] for _, _, _, values in surface.channels.each()]
    return lambda u, v: evaluate_values(surface.vertices[grid], weights, nets, u, v)


def random_bezier(
    degree: tuple[int, int], seed: int, rational: bool, channels: bool = True
) -> BezierSurface:
    """A random patch; its channels have other degrees."""
    rng = np.random.default_rng(seed)
    shape = degree[0] + 1, degree[1] + 1
    carried = Channels(
        colors=rng.uniform(0, 1, (2, 3, 4)),
        uvs=rng.uniform(-1, 1, (3, 2, 2)),
        attributes=(("heat", rng.uniform(-4, 4, (*shape, 1))),),
    )
    return BezierSurface(
        rng.uniform(-4, 4, (*shape, 3)),
        rng.uniform(0.2, 5, shape) if rational else None,
        "z",
        "sail",
        carried if channels else Channels(),
    )


def random_patches(degree: tuple[int, int], seed: int, rational: bool) -> PatchSurface:
    """Two patches that share an edge, with one value of every channel a vertex."""
    rng = np.random.default_rng(seed)
    rows, columns = 2 * degree[0] + 1, degree[1] + 1
    grid = np.arange(rows * columns).reshape(rows, columns)
    return PatchSurface(
        rng.uniform(-4, 4, (grid.size, 3)),
        np.stack([grid[: degree[0] + 1], grid[degree[0] :]]),
        rng.uniform(0.2, 5, grid.size) if rational else None,
        (("first", (0,)),),
        "z",
        "sail",
        Channels(
            colors=rng.uniform(0, 1, (grid.size, 3)),
            attributes=(("heat", rng.uniform(-4, 4, (grid.size, 2))),),
        ),
    )


def assert_same(
    got: Evaluation,
    expected: Evaluation,
    change: Callable[[Fraction, Fraction], tuple[Fraction, Fraction]] = lambda u, v: (u, v),
) -> None:
    """Checks for equal values at the parameters that `change` returns, up to 1e-12; the nets have
    size 4."""
    for u, v in GRID:
        np.testing.assert_allclose(got(u, v), expected(*change(u, v)), rtol=0, atol=4e-12)


def convert_to(kind: type[Kind], surface: Surface, *operations: Operation) -> Kind:
    """The surface after some operations, which must be a surface of this kind."""
    built = convert(surface, operations)
    assert isinstance(built, kind)
    assert (built.up, built.name) == ("z", "sail")
    return built
