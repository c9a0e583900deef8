"""Meshes omit patches that are curves, if another patch of the same part has the curve."""

from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from service.bases.triangle import elevate
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.engine.plans.counts import count_mesh
from service.surface.bezier import TriangleSurface
from service.surface.lowered import Part, PatchModel
from service.surface.multipatch import MultipatchSurface
from tests.engine.meshing import build_mesh, check_sound
from tests.strategies import Array, build_model

OPTIONS: list[dict[str, Any]] = [
    {"resolution": (3, 4)},
    {"resolution": (2, 2), "faces": "quads"},
    {"resolution": (2, 1), "weld": False},
    {"accuracy": Accuracy(tolerance=1e-2)},
]


def build_strip(*columns: float) -> list[Array]:
    """Patches of degree (1, 2) side by side, between the lines x = const at these `columns`.

    A patch between two equal columns is a curve.
    """
    y = np.array([0.0, 1.0, 2.0])
    return [
        np.array([np.stack([np.full(3, x), y, np.sin(x + y)], axis=-1) for x in pair])
        for pair in pairwise(columns)
    ]


def divide_into_parts(model: PatchModel, first_patches: tuple[int, ...]) -> PatchModel:
    """The model divided into parts that begin at the patches with these numbers."""
    ends = pairwise((*first_patches, model.patch_count))
    return replace(
        model, parts=tuple(Part(str(k), begin, end) for k, (begin, end) in enumerate(ends))
    )


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("is_transposed", [False, True])
def test_curves_between_patches_are_omitted(options: dict[str, Any], is_transposed: bool) -> None:
    without_curves, with_curves = (
        build_model([net.swapaxes(0, 1) if is_transposed else net for net in build_strip(*columns)])
        for columns in ((0, 1, 2), (0, 1, 1, 1, 2))
    )
    mesh, expected = build_mesh(with_curves, **options), build_mesh(without_curves, **options)
    check_sound(mesh)
    for name in ("positions", "normals", "triangles", "quads"):
        np.testing.assert_array_equal(getattr(mesh, name), getattr(expected, name))
    if "accuracy" not in options:
        counts = count_mesh(with_curves, MeshOptions(**options))
        report = mesh.report
        assert (counts.vertices, counts.triangles, counts.quads) == (
            report.vertices, report.triangles, report.quads,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("columns", "parts", "patch_count"),
    [
        ((0, 1, 1, 2), (0,), 2),
        ((0, 1, 1, 2), (0, 2), 2),
        ((0, 1, 1, 2), (0, 1, 2), 2),  # a part has no triangles
        ((1, 1, 1, 2), (0, 2), 1),
        ((1, 1, 1), (0,), 2),  # no patch has the curve
        ((0, 1, 1, 1, 2, 2), (0, 3), 2),
    ],
)
def test_curves_are_omitted_if_a_patch_of_their_part_has_them(
    columns: tuple[float, ...], parts: tuple[int, ...], patch_count: int
) -> None:
    for options in OPTIONS:
        mesh = build_mesh(divide_into_parts(build_model(build_strip(*columns)), parts), **options)
        assert (mesh.report.patches, len(mesh.parts)) == (patch_count, len(parts))
        for part in mesh.parts:
            has_faces = any(begin < end for begin, end in (part.triangles, part.quads))
            # A part has a bound if and only if it has faces. This rule need not hold if all columns
            # are equal: then every patch is a curve, whose faces have no area.
            assert (part.deviation_bound is not None) == has_faces or max(columns) == 1


def test_a_curve_stays_if_only_another_part_has_it() -> None:
    """The other patches of its part do not have the curve, so their bounds do not include it."""
    nets = [net for pair in ((0, 1), (1, 1), (2, 3), (1, 2)) for net in build_strip(*pair)]
    mesh = build_mesh(divide_into_parts(build_model(nets), (0, 1, 3)), resolution=(2, 2))
    assert mesh.report.patches == 4


@pytest.mark.parametrize("degree", [1, 3])
def test_narrow_triangles_become_curves(degree: int) -> None:
    """A closed body of triangles, some of them 1e-13 wide; any side may be the narrow one."""
    angles = np.array([0, 1, 1 + 1e-13, 2, 2 + 2e-13, 4, 4 + 1e-13, 5, 2 * np.pi])
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    rim[-1] = rim[0]
    nets = []
    for top, (k, (a, b)) in product((1.0, -1.0), enumerate(pairwise(rim))):
        corners = [a, b, np.array([0, 0, top])]
        net = np.array(corners[k % 3 :] + corners[: k % 3])
        nets.append(elevate((net[:, np.newaxis], None), degree)[0][:, 0] if degree > 1 else net)
    surface = MultipatchSurface(tuple(TriangleSurface(net) for net in nets))
    for options in ({"resolution": (3, 3)}, {"accuracy": Accuracy(tolerance=1e-2)}):
        mesh = build_mesh(surface.lower(), **options)
        check_sound(mesh)
        # Above and below the rim, 5 of 8 triangles are wide.
        assert (mesh.report.watertight, mesh.report.patches) == (True, 2 * 5)
        # With this tolerance no control point is moved.
        assert not build_mesh(surface.lower(), weld_tolerance=0, **options).report.moved


def test_a_patch_that_is_one_point_is_omitted_beside_others() -> None:
    """A row and a column of patches have no width; the patch where they cross is one point."""
    x, y = (0.0, 1.0, 1.0, 2.0), (0.0, 1.0, 1.0, 3.0)
    nets = [
        np.array([[(a, b, a * b) for b in y[m : m + 2]] for a in x[k : k + 2]])
        for k in range(3)
        for m in range(3)
    ]
    mesh = build_mesh(nets, resolution=(3, 3))
    check_sound(mesh)
    assert (mesh.report.patches, mesh.report.boundary_edges) == (4, 24)
    # Alone, the patch that is one point stays.
    assert build_mesh([nets[4]], resolution=(3, 3)).report.patches == 1
