"""Products of vectors do not depend on the layout of arrays, and add their terms in order."""

import numpy as np
import pytest

from service.engine.vectors import FEW, cross, dot, normalize, project

Array = np.ndarray


def draw(count: int) -> tuple[Array, Array]:
    """Two arrays of vectors (3, `count`)."""
    return tuple(np.random.default_rng(count).normal(size=(2, 3, count)))


def test_terms_are_added_in_the_order_of_coordinates() -> None:
    a, b = draw(1000)
    assert (dot(a, b) == a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).all()


@pytest.mark.parametrize("count", [1, 100, FEW])
def test_bits_do_not_depend_on_the_layout(count: int) -> None:
    """`cross` computes few vectors in another way than many."""
    a, b = draw(count)
    np.testing.assert_array_equal(cross(a.T, b.T, -1).T, cross(a, b))
    np.testing.assert_array_equal(cross(a[:, None], b[:, None], -3)[:, 0], cross(a, b))
    np.testing.assert_array_equal(cross(a[:, :1], b[:, :1]), cross(a, b)[:, :1])
    np.testing.assert_array_equal(dot(a.T, b.T, -1), dot(a, b))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b, axis=0))


def test_vectors_without_length_stay_and_points_without_weights_too() -> None:
    np.testing.assert_array_equal(normalize(np.array([[3.0, 0], [4, 0]])), [[0.6, 0], [0.8, 0]])
    homogeneous = np.array([2.0, 4.0, 6.0, 2.0])
    np.testing.assert_array_equal(project(homogeneous, -1), [1, 2, 3])
    np.testing.assert_array_equal(project(homogeneous[:3], -1), homogeneous[:3])
