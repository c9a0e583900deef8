"""Meshes omit triangles without area: the deviation bound must include some of these triangles.

This is necessary only if the mesh is coarse, or if a patch is folded.
"""

from itertools import product

import numpy as np
import pytest

from service.engine.bounds.degenerate_faces import has_missing_triangles
from service.engine.connectivity.connect import connect
from service.engine.options import Faces
from service.engine.plans.layout import FINE, Layout
from service.engine.plans.patterns import Shape, TriangleShape
from tests.engine.bounds.test_mesh_deviation import check_deviation_bound
from tests.engine.meshing import build_mesh
from tests.strategies import Array, build_model

COLLAPSED = list(product((False, True), repeat=4))


@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("collapsed", COLLAPSED)
def test_fine_patches_with_poles_have_no_missing_triangles(
    collapsed: tuple[bool, bool, bool, bool], faces: Faces
) -> None:
    for ru, rv in product(range(FINE, FINE + 2), repeat=2):
        # A side has the divisions of the grid, or three more: then the patch is stitched.
        for extra in product((0, 3), repeat=4):
            divisions = zip((rv, rv, ru, ru), extra, collapsed, strict=True)
            a, b, c, d = (n if is_pole else n + k for n, k, is_pole in divisions)
            assert not has_missing_triangles(Shape((ru, rv), (a, b, c, d), collapsed), faces)
        # The fourth side of a triangular patch always counts as collapsed.
        assert not has_missing_triangles(TriangleShape(ru, (*collapsed[:3], True)), faces)


def test_a_single_division_between_two_poles_has_missing_triangles() -> None:
    """The sides v = 0 and v = 1 are poles. With one division between them every quad is a line, and
    no side of a face in the mesh; with two divisions, quads are triangles."""
    shape = Shape((4, 1), (1, 1, 4, 4), (False, False, True, True))
    assert has_missing_triangles(shape, "triangles")
    assert not has_missing_triangles(
        Shape((4, 2), (2, 2, 4, 4), (False, False, True, True)), "triangles"
    )


def build_folded_net(height: float) -> Array:
    """A net whose sides u = 0 and v = 0 are one edge that rises to their corner."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, np.zeros_like(x)], axis=-1)
    edge = [[0, 0, height], [1, 1, 0], [1, 2, 0], [0, 3, 0]]
    net[0], net[:, 0] = edge, edge
    return net


@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("resolution", [(2, 2), (3, 3), (6, 6)])
def test_the_corner_of_a_folded_patch_is_cut_off(resolution: tuple[int, int], faces: Faces) -> None:
    model = build_model([build_folded_net(8.0)])
    assert Layout.plan(connect(model).connectivity, resolution).may_fold
    mesh = build_mesh(model, resolution=resolution, faces=faces, normals=False)
    check_deviation_bound(model, mesh)
    bound = mesh.report.deviation_bound
    # The corner itself is in no face: its distance from the nearest vertex counts.
    used = mesh.positions[np.union1d(mesh.triangles, mesh.quads)]
    assert bound is not None
    assert bound >= np.linalg.norm(used - [0, 0, 8.0], axis=1).min() > 0
