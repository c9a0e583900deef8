"""Counts of vertices and faces without a mesh, compared with the counts of the mesh."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases import triangle
from service.engine.joining.join import join
from service.engine.options import Faces, MeshOptions
from service.engine.plans.counts import Counts, count_mesh
from service.engine.plans.patterns import Shape, TriangleShape, build_faces, build_rim
from service.engine.tessellate import tessellate
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.examples.catalogue import EXAMPLES
from service.surface.lowered import GroupModel, Part, PatchModel
from tests.strategies import build_model, degenerate_nets, resolutions, split_models, triangle_nets

MODELS = [
    pytest.param(patch_model, id=f"{example.id}-{k}")
    for example in EXAMPLES.values()
    for model in [example.surface().lower()]
    for k, patch_model in enumerate(model.models if isinstance(model, GroupModel) else [model])
    if isinstance(patch_model, PatchModel)
]


def count_in_mesh(model: PatchModel, options: MeshOptions) -> Counts:
    """The counts in the report of the mesh."""
    report = tessellate(model, options).report
    return Counts(report.vertices, report.triangles, report.quads)


def check_counts(model: PatchModel, resolution: tuple[int, int]) -> None:
    """Compares counts of triangles and of quads, with and without welding.

    Before that, `join` makes borders equal where they meet.
    """
    model, _ = join(model, MeshOptions().weld_tolerance)
    kinds: tuple[Faces, ...] = ("triangles", "quads")
    for kind, weld in product(kinds, (True, False)):
        options = MeshOptions(resolution, faces=kind, weld=weld, normals=False)
        assert count_mesh(model, options) == count_in_mesh(model, options), (kind, weld)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_counts_of_all_examples_are_right(model: PatchModel) -> None:
    for resolution in ((1, 1), (2, 1), (2, 2), (3, 3), (2, 5)):
        check_counts(model, resolution)


def test_normals_and_creases_do_not_change_counts() -> None:
    cone = EXAMPLES["cone"].surface().lower()
    assert isinstance(cone, PatchModel)
    for angle in (0.0, 1.0):
        options = MeshOptions((5, 5), crease_angle=angle)
        assert count_mesh(cone, options) == count_in_mesh(cone, options)


@given(split_models(), resolutions)
def test_counts_of_patches_that_meet_are_right(
    net_and_pieces: Any, resolution: tuple[int, int]
) -> None:
    _, pieces = net_and_pieces
    check_counts(build_model(pieces), resolution)


@given(st.lists(degenerate_nets(), min_size=1, max_size=3), resolutions)
def test_counts_of_degenerate_patches_are_right(
    nets: list[Any], resolution: tuple[int, int]
) -> None:
    check_counts(build_model(nets), resolution)


@given(triangle_nets(), st.lists(st.sampled_from([0, 1, 2]), unique=True), resolutions)
def test_counts_of_triangles_with_collapsed_sides_are_right(
    net: Any, collapsed_sides: list[int], resolution: tuple[int, int]
) -> None:
    net = np.array(net)
    degree = triangle.degree_of(len(net))
    for side in collapsed_sides:
        row = triangle.side_rows(degree)[side]
        net[row] = net[row[0]]
    model = PatchModel("one", (TrianglePatches(net[np.newaxis]),), (Part("one", 0, 1),))
    check_counts(model, resolution)


def build_patch(*corners: int) -> Any:
    """The net of a bilinear patch; `corners` has the number of a point (0 … 3) for each corner."""
    points = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1]], dtype=np.float64)
    return points[list(corners)].reshape(2, 2, 3)


# There are 256 choices of four corners. Six of them are tested: every 43rd.
@pytest.mark.parametrize("corners", list(product(range(4), repeat=4))[::43])
def test_counts_of_patches_with_repeated_corners_are_right(corners: tuple[int, ...]) -> None:
    for resolution in ((1, 1), (1, 2), (2, 2), (3, 4)):
        check_counts(build_model([build_patch(*corners)]), resolution)
        check_counts(build_model([build_patch(*corners), build_patch(0, 1, 2, 3)]), resolution)


@pytest.mark.parametrize("kind", ["triangles", "quads"])
def test_the_faces_of_the_rim_and_of_inner_cells_are_all_faces(kind: Any) -> None:
    # The sides have the divisions of the grid, or two of them have more; all choices of collapsed
    # sides.
    shapes = [
        Shape((ru, rv), sides, (a, b, c, d))
        for ru, rv in product((2, 3, 6), repeat=2)
        for sides in ((rv, rv, ru, ru), (rv, rv + 1, ru, 2 * ru))
        for a, b, c, d in product((False, True), repeat=4)
    ]
    for shape in shapes:
        ru, rv = shape.resolution
        inner_cells = (ru - 2) * (rv - 2)
        triangles, quads = build_rim(shape, kind)
        inner_faces = (2 * inner_cells, 0) if kind == "triangles" else (0, inner_cells)
        result = len(triangles) + inner_faces[0], len(quads) + inner_faces[1]
        assert result == tuple(map(len, build_faces(shape, kind)))


def test_a_patch_of_60_000_divisions_is_counted_without_samples() -> None:
    net = np.zeros((2, 2, 3))
    net[1, :, 0] = net[:, 1, 1] = 1
    model = PatchModel("one", (TensorPatches(net[np.newaxis]),), (Part("one", 0, 1),))
    expected = Counts(60_001**2, 2 * 60_000**2, 0)
    assert count_mesh(model, MeshOptions((60_000, 60_000))) == expected


def test_inner_samples_of_a_triangle_are_counted() -> None:
    """With 4 divisions, 3 of the 15 samples are not on a side."""
    assert TriangleShape(4).inner == 3
