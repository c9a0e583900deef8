"""Triangles that rounding to float32 makes flat are left out of files with float32."""

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.adaptive.drafts.draft import Triangulation
from service.engine.adaptive.samples import drop_flat_triangles
from service.surface.bspline import BsplineSurface
from tests.engine.meshing import build_mesh


@pytest.mark.parametrize("seed", range(3))
def test_a_side_that_is_nearly_a_point_is_one_in_float32(seed: int) -> None:
    """A dome: the points of its top differ by 1e-12, so it has a hole there in float64."""
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
    assert single_mesh.report.deviation_bound is not None
    assert single_mesh.report.deviation_bound <= 1e-3


def build_row(
    x: list[float], faces: tuple[int, int, int] = (0, 0, 0)
) -> tuple[Triangulation, np.ndarray]:
    """Triangles 0 1 2, 2 1 3, 2 3 4 of vertices stored at (x, x², 0), and these positions.

    Vertices with equal x are stored as equal positions; no others are in one line. Each triangle
    has samples of its own, in the face with this number.
    """
    vertices = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    built = Triangulation(
        face=np.repeat(faces, 3),
        u=np.arange(9),
        v=np.zeros(9, dtype=np.intp),
        vertex=vertices.ravel(),
        positions=np.zeros((5, 3)),
        triangles=np.arange(9).reshape(3, 3),
        bounds=np.array([1.0, 3.0, 2.0]),
        mesh_bounds=None,
    )
    return built, np.array([[a, a**2, 0.0] for a in x])


def test_a_triangle_beside_a_flat_one_takes_over_its_bound() -> None:
    """Vertex 3 is stored at vertex 1, so the triangle 2 1 3, with the bound 3, is flat."""
    result = drop_flat_triangles(*build_row([0, 1, 2, 1, 4]))
    assert result.vertex[result.triangles].tolist() == [[0, 1, 2], [2, 1, 4]]
    # Both other triangles have its segment, 1 2; one of them takes over the bound.
    assert result.bounds.tolist() in ([1.0, 3.0], [3.0, 2.0])


@pytest.mark.parametrize(
    ("x", "faces"),
    [
        ([0, 1, 2, 3, 4], (0, 0, 0)),  # no triangle is flat
        ([7, 7, 7, 7, 7], (0, 0, 0)),  # all are
        ([0, 1, 2, 1, 4], (0, 1, 2)),  # the triangles beside the flat one are in other faces
    ],
)
def test_a_triangulation_stays_if_no_flat_triangle_can_be_dropped(
    x: list[float], faces: tuple[int, int, int]
) -> None:
    built, stored = build_row(x, faces)
    assert drop_flat_triangles(built, stored) is built
