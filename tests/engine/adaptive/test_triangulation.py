"""Triangles that rounding to float32 makes flat are left out of files with float32."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.adaptive.triangulation import Triangulation, drop_flat_triangles
from service.surface.bspline import BsplineSurface
from tests.engine.meshing import build_mesh


@pytest.mark.parametrize("seed", range(3))
def test_a_side_that_is_nearly_a_point_is_one_in_float32(seed: int) -> None:
    turn, rng = np.linspace(0, 2 * np.pi, 9), np.random.default_rng(seed)
    rows = [
        np.stack([r * np.cos(turn), r * np.sin(turn), np.full(9, 1 - r**2)], axis=1)
        for r in (1, 0.9, 0.6, 0.3, 0)
    ]
    net = np.array(rows) + np.array([1.3, 2.1, 0.7])
    net[-1] += rng.normal(size=(9, 3)) * 1e-12
    model = BsplineSurface(net).lower()
    double_mesh, single_mesh = (
        build_mesh(model, is_float32=is_float32, accuracy=Accuracy(tolerance=1e-3))
        for is_float32 in (False, True)
    )
    corners = single_mesh.positions[single_mesh.triangles]
    assert not (corners == corners[:, [1, 2, 0]]).all(axis=2).any()
    assert single_mesh.report.boundary_edges < double_mesh.report.boundary_edges
    assert (single_mesh.report.deviation_bound or 1) <= 1e-3


def build_strip(stored: list[int]) -> tuple[Triangulation, np.ndarray]:
    """Triangles 0 1 2, 2 1 3, 2 3 4 of one face, their vertices stored at some places."""
    nothing = np.zeros(5, dtype=np.intp)
    built = Triangulation(
        face=nothing,
        u=np.arange(5),
        v=nothing,
        vertex=np.arange(5),
        positions=np.zeros((5, 3)),
        triangles=np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
        bounds=np.array([1.0, 3.0, 2.0]),
        mesh_bounds=None,
    )
    return built, np.array([[place, place**2, 0.0] for place in stored])


def test_the_triangle_beside_takes_over_the_bound() -> None:
    result = drop_flat_triangles(*build_strip([0, 1, 2, 1, 4]))
    assert result.vertex.tolist() == [0, 1, 2, 1, 4]
    assert result.triangles.tolist() == [[0, 1, 2], [2, 3, 4]]
    assert result.bounds.tolist() == [1.0, 3.0] or result.bounds.tolist() == [3.0, 2.0]


@pytest.mark.parametrize("stored", [[0, 1, 2, 3, 4], [7, 7, 7, 7, 7]])
def test_triangulations_without_flat_triangles_or_with_only_flat_ones_stay(
    stored: list[int],
) -> None:
    built, places = build_strip(stored)
    assert drop_flat_triangles(built, places) is built
    apart = replace(built, face=np.array([0, 0, 0, 1, 1]))
    assert drop_flat_triangles(apart, places) is apart
