"""Cells keep all their fields, and the surface over them, when they are halved."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.cells.cells import NetCells


@dataclass(frozen=True, eq=False, slots=True)
class NumberedCells(NetCells):
    """Cells with a field of their own."""

    number: Ints


def evaluate(nets: FloatArray, u: float, v: float) -> FloatArray:
    """The points (D, K) of nets (p+1, q+1, D, K) at one place."""
    basis_u, basis_v = (
        bernstein(size - 1, [t])[0] for size, t in zip(nets.shape, (u, v), strict=False)
    )
    return np.asarray(np.einsum("i,j,ijdk->dk", basis_u, basis_v, nets))


def test_the_four_quarters_of_a_cell_follow_each_other_and_have_its_surface() -> None:
    nets = np.random.default_rng(0).normal(size=(4, 3, 3, 2))
    rectangle = np.repeat([[0.0], [1.0], [0.0], [1.0]], 2, axis=1)
    quarters = NumberedCells(rectangle, nets, np.array([7, 8])).halve_along((0, 1))
    np.testing.assert_array_equal(quarters.number, [7, 7, 7, 7, 8, 8, 8, 8])
    np.testing.assert_array_equal(quarters.rectangle[0], [0, 0, 0.5, 0.5] * 2)
    np.testing.assert_array_equal(quarters.rectangle[2], [0, 0.5, 0, 0.5] * 2)
    for k, (u0, u1, v0, v1) in enumerate(quarters.rectangle.T):
        expected = evaluate(nets, (u0 + 3 * u1) / 4, (v0 + v1) / 2)[:, k // 4]
        point = evaluate(quarters.nets, 0.75, 0.5)[:, k]
        np.testing.assert_allclose(point, expected, atol=1e-14)


def test_places_are_halved_at_whole_numbers() -> None:
    cells = NetCells(np.array([[0], [8], [2], [4]]), np.zeros((2, 2, 1)))
    lower, upper = cells.halve(1)
    np.testing.assert_array_equal(
        [lower.rectangle[:, 0], upper.rectangle[:, 0]], [[0, 8, 2, 3], [0, 8, 3, 4]]
    )
    assert lower.rectangle.dtype == np.intp
