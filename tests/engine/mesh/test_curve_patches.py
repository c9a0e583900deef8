"""Patches that are curves are no part of a mesh, if other patches of their part have the curve."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.mesh.counts import count_mesh
from service.engine.options import MeshOptions
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import check_sound, mesh_of
from tests.strategies import Array, model_of

OPTIONS: list[dict[str, Any]] = [
    {"resolution": (3, 4)},
    {"resolution": (2, 2), "faces": "quads"},
    {"resolution": (2, 1), "weld": False},
    {"accuracy": Accuracy(tolerance=1e-2)},
]


def strip(*columns: float) -> list[Array]:
    """Patches of degree (1, 2) side by side, each between two of these lines x = const."""
    y = np.array([0.0, 1.0, 2.0])
    return [
        np.array([np.stack([np.full(3, x), y, np.sin(x + y)], axis=-1) for x in pair])
        for pair in pairwise(columns)
    ]


def arrange(model: PatchModel, parts: tuple[int, ...]) -> PatchModel:
    """The model with parts that begin at these patches."""
    ends = (*parts, model.patch_count)
    return replace(
        model,
        parts=tuple(Part(str(k), ends[k], ends[k + 1]) for k in range(len(parts))),
    )


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("turned", [False, True])
def test_curves_between_patches_are_left_out(options: dict[str, Any], turned: bool) -> None:
    without, with_curves = (
        model_of([net.swapaxes(0, 1) if turned else net for net in strip(*columns)])
        for columns in ((0, 1, 2), (0, 1, 1, 1, 2))
    )
    mesh, same = mesh_of(with_curves, **options), mesh_of(without, **options)
    check_sound(mesh)
    for name in ("positions", "normals", "triangles", "quads"):
        np.testing.assert_array_equal(getattr(mesh, name), getattr(same, name))
    if "accuracy" not in options:
        counts = count_mesh(with_curves, MeshOptions(**options))
        assert (counts.vertices, counts.triangles, counts.quads) == (
            *(mesh.report.vertices, mesh.report.triangles),
            mesh.report.quads,
        )


@pytest.mark.parametrize(
    ("columns", "parts", "left"),
    [
        ((0, 1, 1, 2), (0,), 2),
        ((0, 1, 1, 2), (0, 2), 2),
        ((0, 1, 1, 2), (0, 1, 2), 3),  # a part would have no patch
        ((1, 1, 1), (0,), 2),  # no patch has the curve
        ((0, 1, 1, 1, 2, 2), (0, 3), 2),
    ],
)
def test_which_curves_stay(columns: tuple[float, ...], parts: tuple[int, ...], left: int) -> None:
    mesh = mesh_of(arrange(model_of(strip(*columns)), parts), resolution=(2, 2))
    assert (mesh.report.patches, len(mesh.parts)) == (left, len(parts))


def test_a_patch_of_one_point_is_left_out_beside_others() -> None:
    """Two crossing lines of patches without width: the patch where they cross is a point."""
    x, y = (0.0, 1.0, 1.0, 2.0), (0.0, 1.0, 1.0, 3.0)
    nets = [
        np.array([[(a, b, a * b) for b in y[m : m + 2]] for a in x[k : k + 2]])
        for k in range(3)
        for m in range(3)
    ]
    mesh = mesh_of(nets, resolution=(3, 3))
    check_sound(mesh)
    assert (mesh.report.patches, mesh.report.boundary_edges) == (4, 24)
    assert mesh_of([nets[4]], resolution=(3, 3)).report.patches == 1
