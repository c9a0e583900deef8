"""Tables of quadrature, compared with 40 digits; bounds of remainders of coarse rules."""

import mpmath
import numpy as np
import pytest

from oracles.sheets import bernstein
from service.engine.measures.cells import CellNets, MeasuredCells
from service.engine.measures.patch_cells import build_cells
from service.engine.measures.quadrature import (
    Integrand,
    apply_rule,
    basis_at_nodes,
    gauss,
    weights_at_nodes,
)
from service.engine.measures.remainders import RADII, bound_remainders, chebyshev, ellipse_bounds
from service.engine.vectors import UNIT


@pytest.mark.parametrize("count", [2, 5, 10, 33])
def test_nodes_and_weights_are_rounded_once(count: int) -> None:
    """`gauss` has the nodes in [0, ½]; relative errors are at most the unit roundoff `UNIT`."""
    nodes, weights = gauss(count)
    with mpmath.workdps(40):
        for t, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
            x = mpmath.findroot(lambda x: mpmath.legendre(count, x), 1 - 2 * mpmath.mpf(t))
            slope = mpmath.diff(lambda x: mpmath.legendre(count, x), x)
            assert abs((1 - x) / 2 / t - 1) <= UNIT
            assert abs(1 / ((1 - x**2) * slope**2) / weight - 1) <= UNIT
    assert weights_at_nodes(count).sum() == pytest.approx(1, abs=1e-15)
    basis = basis_at_nodes(5, count)
    # The integral of each Bernstein polynomial of degree 5 is 1/6. A rule of m nodes is exact up to
    # degree 2 m − 1.
    if count > 2:
        np.testing.assert_allclose(weights_at_nodes(count) @ basis, 1 / 6, rtol=1e-14)


@pytest.mark.parametrize("degree", [0, 1, 4, 17])
def test_chebyshev_coefficients_give_the_bernstein_basis(degree: int) -> None:
    """Checks also the bounds of `remainders`: of sums of coefficients, and of |T_k| on ellipses."""
    matrix = chebyshev(degree)
    t = np.linspace(0, 1, 31)
    chebyshev_values = np.cos(np.arange(degree + 1)[:, np.newaxis] * np.arccos(2 * t - 1))
    np.testing.assert_allclose(matrix.T @ chebyshev_values, bernstein(degree)(t).T, atol=1e-14)
    assert np.abs(matrix).sum(axis=1).max() <= 2 + 1e-13
    angle = np.linspace(0, 2 * np.pi, 60)
    for radius, bounds in zip(RADII, ellipse_bounds(degree), strict=True):
        z = radius * np.exp(1j * angle)
        for k, bound in enumerate(bounds, start=1):
            assert np.abs((z**k + z**-k) / 2).max() <= bound * (1 + 1e-9)


def build_random_cells(seed: int, is_rational: bool, degree: tuple[int, int]) -> MeasuredCells:
    """40 random cells that are nearly flat."""
    rng = np.random.default_rng(seed)
    p, q = degree
    x, y = np.meshgrid(np.linspace(-0.4, 0.4, p + 1), np.linspace(-0.4, 0.4, q + 1), indexing="ij")
    nets = np.stack([x, y, 0 * x], axis=-1) + rng.uniform(-0.04, 0.04, (40, p + 1, q + 1, 3))
    if is_rational:
        weights = rng.uniform(0.9, 1, (40, p + 1, q + 1, 1))
        nets = np.concatenate([nets * weights, weights], axis=-1)
    return build_cells(nets, np.arange(40), 0.0)


@pytest.mark.parametrize(
    ("integrand", "is_rational", "degree"),
    [
        ("size", False, (3, 3)),
        ("size", False, (3, 0)),  # degree 0 along v: cells of curves, whose size is a length
        ("size", True, (2, 4)),
        ("size", True, (3, 0)),
        ("flux", True, (3, 3)),
        ("flux", True, (2, 4)),
    ],
)
def test_errors_of_coarse_rules_are_within_the_bounds_of_remainders(
    integrand: Integrand, is_rational: bool, degree: tuple[int, int]
) -> None:
    """Compares rules of 2, 3 and 4 nodes with a rule of 24 nodes."""
    cells = build_random_cells(sum(degree), is_rational, degree)
    nets = CellNets(cells)
    fine_sums, fine_rounding = apply_rule(nets, integrand, 24)
    ratios = []
    for count in (2, 3, 4):
        bound, _ = bound_remainders(nets, integrand, count)
        sums, rounding = apply_rule(nets, integrand, count)
        errors = np.abs(sums - fine_sums)
        if integrand == "flux":  # rows: the flux, and three coordinates of its moment
            errors = np.stack([errors[0], np.sqrt((errors[1:] ** 2).sum(axis=0))])
        assert (errors <= bound + rounding + fine_rounding).all()
        assert (errors > rounding).mean() > 0.7  # otherwise the test would prove nothing
        ratios.append(float(np.median(bound / errors)))
    assert ratios[0] < 2e4  # with 2 nodes
    # Both halves of a cell together are the same surface, and their remainders are smaller, again
    # with 4 nodes. The first halves of all 40 cells come before the second halves.
    for axis in (0, 1) if degree[1] else (0,):
        halves = cells.halve(axis)
        sums, rounding = apply_rule(CellNets(halves), integrand, 24)
        assert (np.abs(sums[:, :40] + sums[:, 40:] - fine_sums)[0] <= rounding[0].max() * 3).all()
        assert bound_remainders(CellNets(halves), integrand, 4)[0].max() < bound.max()
