"""Patches over shared vertices: lowering, parts and refusals."""

from itertools import permutations

import numpy as np
import pytest

from service.bases.arrays import FloatArray, Ints
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import InvalidRequest, Issue
from service.surface.convert.operations import Elevate, Reverse, Transpose
from service.surface.convert.table import convert
from service.surface.lowered import Part
from service.surface.patches import PatchSurface
from tools.building import build

STRIP = np.array([[x, y, x * y] for x in (0.0, 1, 2, 3) for y in (0.0, 1)])
QUADS = np.array([[[0, 1], [2, 3]], [[2, 3], [4, 5]], [[4, 5], [6, 7]]])


def list_issues(**fields: object) -> tuple[Issue, ...]:
    """The issues of the strip with these fields replaced."""
    with pytest.raises(InvalidRequest) as caught:
        PatchSurface(**({"vertices": STRIP, "patches": QUADS} | fields))  # type: ignore[arg-type]
    return caught.value.issues


def test_patches_are_lowered_to_the_vertices_of_their_indices() -> None:
    """Each control point has the position and the weight of the vertex with its index."""
    weights = np.arange(1.0, 9)
    model = PatchSurface(STRIP, QUADS, weights, up="z", name="strip").lower()
    (batch,) = model.batches
    for k, i, j in np.ndindex(3, 2, 2):
        np.testing.assert_array_equal(batch.points[k, i, j], STRIP[QUADS[k, i, j]])
        assert batch.weights is not None
        assert batch.weights[k, i, j] == weights[QUADS[k, i, j]]
    assert (model.name, model.up, model.parts) == ("strip", "z", (Part("strip", 0, 3),))


def test_patches_are_lowered_part_by_part_and_patches_without_a_part_last() -> None:
    """Patches without a part form a last part, which has the name of the surface."""
    parts = (("end", (2,)), ("middle", (1,)))
    model = PatchSurface(STRIP, QUADS, parts=parts, name="strip").lower()
    assert model.parts == (Part("middle", 0, 1), Part("end", 1, 2), Part("strip", 2, 3))
    np.testing.assert_array_equal(model.batches[0].points, STRIP[QUADS[[1, 2, 0]]])


def test_parts_are_in_the_order_of_their_first_patches() -> None:
    """Parts may be listed in any order; those without patches come first.

    The patches of a part keep their order.
    """
    parts = [("a", (2, 0)), ("b", (1,)), ("c", ())]
    for permuted in permutations(parts):
        surface = PatchSurface(STRIP, QUADS, parts=permuted)
        assert surface.parts == (("c", ()), ("b", (1,)), ("a", (2, 0)))


def build_pillow(degrees: list[tuple[int, int]]) -> tuple[FloatArray, tuple[Ints, ...]]:
    """Vertices and grids of patches over the unit square that have the same border.

    The first patch is flat, and transposed so that its normal points down.
    """
    vertices: list[tuple[float, ...]] = []
    grids: list[Ints] = []
    for height, (p, q) in enumerate(degrees):
        net = [
            (i / p, j / q, height * (0 < i < p and 0 < j < q)) for i, j in np.ndindex(p + 1, q + 1)
        ]
        grid = len(vertices) + np.arange(len(net)).reshape(p + 1, q + 1)
        grids.append(grid if height else grid.T)
        vertices += net
    return np.array(vertices), tuple(grids)


@pytest.mark.parametrize("options", [
    MeshOptions(resolution=(3, 3)),
    MeshOptions(resolution=(2, 5), faces="quads"),
    MeshOptions(accuracy=Accuracy(tolerance=0.01)),
])  # fmt: skip
@pytest.mark.parametrize("degrees", [[(1, 1), (3, 2)], [(5, 1), (3, 4)], [(2, 3), (2, 2)]])
def test_patches_of_different_degrees_with_the_same_border_are_closed(
    options: MeshOptions, degrees: list[tuple[int, int]]
) -> None:
    """Patches are closed with shared or separate vertices, in any order, and after conversions."""
    vertices, grids = build_pillow(degrees)
    distinct_vertices, number = np.unique(vertices, axis=0, return_inverse=True)
    surface_with_repeated_vertices = PatchSurface(vertices, grids)
    for surface in (
        surface_with_repeated_vertices,
        PatchSurface(distinct_vertices, tuple(number[grid] for grid in grids)),
        PatchSurface(vertices, grids[::-1], parts=(("top", (0,)), ("bottom", (1,)))),
        convert(surface_with_repeated_vertices, [Transpose(), Reverse("u")]),
        convert(surface_with_repeated_vertices, [Elevate((5, 5))]),
    ):
        report = build(surface.lower(), options).report
        assert (report.patches, report.boundary_edges) == (2, 0)


def test_a_surface_is_frozen_and_copies_the_arrays_of_the_caller() -> None:
    """Later changes of these arrays have no effect; the arrays of the surface are read-only."""
    vertices, patches = STRIP.copy(), QUADS.copy()
    surface = PatchSurface(vertices, patches)
    vertices[:], patches[:] = 9, 0
    np.testing.assert_array_equal(surface.lower().batches[0].points, STRIP[QUADS])
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0] = 0
    ((_, grids),) = surface.by_degree
    with pytest.raises(ValueError, match="read-only"):
        grids[0] = 0


def test_parts_with_unknown_or_repeated_patches_are_refused() -> None:
    """There is an issue for each fault; `/` in the name of a part is escaped in the pointer."""
    issues = list_issues(parts=(("a/b", (0, 3)), ("c", (0, -1))))
    assert [(i.code, i.pointer) for i in issues] == [
        ("index_out_of_range", "/parts/a~1b/1"),
        ("repeated_patch", "/parts/c/0"),
        ("index_out_of_range", "/parts/c/1"),
    ]
