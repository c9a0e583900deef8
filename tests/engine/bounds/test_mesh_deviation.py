"""The deviation bound of a mesh by resolution, compared with sampled distances."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_sheets
from service.engine.bounds.mesh_deviation import find_largest_bound
from service.engine.build import build
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.surface.lowered import Part
from tests.engine.meshing import build_mesh
from tests.strategies import Array, apply_symmetry, build_mixed_model, build_model, translate
from tools.certify.surfaces import FAMILIES
from tools.examples import lower_patches

DIAGONALS = (((0, 1, 3), (1, 2, 3)), ((0, 1, 2), (0, 2, 3)))
"""The two diagonals along which a quad can be split."""

SAMPLES = 300
"""Samples of each surface, without those that `measure_surface_to_mesh` adds."""

SWAPPED = 5
"""For `apply_symmetry`: u is reversed, and then u and v are swapped."""


def split_faces(mesh: Mesh, diagonal: int = 0) -> Array:
    """The triangles of a mesh, (T, 3, 3), with quads split along one diagonal or the other."""
    faces = [mesh.triangles, *(mesh.quads[:, cut] for cut in DIAGONALS[diagonal])]
    corners: Array = (mesh.positions.astype(np.float64) + mesh.origin)[np.concatenate(faces)]
    return corners


def check_deviation_bound(surface: Any, mesh: Mesh, samples: int = SAMPLES) -> float:
    """Check that no sample is beyond the bound, for both diagonals of quads.

    Returns the largest sampled deviation divided by the bound.
    """
    bound = mesh.report.deviation_bound
    assert bound is not None
    share = 0.0
    for diagonal in (0, 1) if len(mesh.quads) else (0,):
        result = measure_surface_to_mesh(
            build_sheets(surface), split_faces(mesh, diagonal), samples
        )
        assert result.distance <= bound + result.rounding
        share = max(share, result.distance / bound)
    return share


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_no_point_of_a_surface_is_further_than_the_bound(family: str) -> None:
    seed = list(FAMILIES).index(family)
    surface = FAMILIES[family].surface(seed)
    rng = np.random.default_rng(seed)
    options = MeshOptions(
        resolution=tuple(rng.integers(1, 7, 2).tolist()),
        faces="quads" if seed % 2 else "triangles",
        normals=False,
    )
    check_deviation_bound(surface, build(surface.lower(), options, is_float32=seed % 3 == 0))


def test_the_bound_of_forward_differences_includes_their_rounding() -> None:
    curve = np.random.default_rng(4).uniform(-1, 1, (9, 3))
    net = np.stack([curve, translate(curve, 1.0)])
    bounds = [
        build_mesh(
            [net], is_float32=True, method=method, resolution=(2, 1024)
        ).report.deviation_bound
        for method in ("matrix", "de_casteljau", "forward_difference")
    ]
    assert None not in bounds
    # Errors accumulate over 1024 steps.
    assert bounds[2] > bounds[1] + 1e-4  # type: ignore[operator]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "resolution", "faces"),
    [
        ("rounded-box", (2, 1), "triangles"),
        ("cone", (1, 4), "quads"),
        ("torus", (3, 2), "triangles"),
    ],
)
def test_the_bound_holds_for_strips_poles_and_seams(
    name: str, resolution: tuple[int, int], faces: str
) -> None:
    model = lower_patches(name)
    check_deviation_bound(
        model, build_mesh(model, resolution=resolution, faces=faces, normals=False), SAMPLES // 3
    )


@pytest.mark.parametrize(
    ("name", "share"),
    [("octahedral-sphere", 0.3), ("sphere", 0.35), ("tveit", 0.4), ("saddle", 0.7)],
)
def test_the_bound_is_close_where_surfaces_bend_evenly(name: str, share: float) -> None:
    assert check_deviation_bound(lower_patches(name), build_mesh(name, resolution=(8, 8))) > share


def test_parts_follow_the_sequence() -> None:
    """The batches have the flat patch first, the sequence has the bent patch first."""
    flat = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    bent = translate(flat, 4.0)
    bent[1, 1, 2] = 1.0
    model = replace(
        build_mixed_model([flat, bent]),
        parts=(Part("bent", 0, 1), Part("flat", 1, 2)),
        sequence=np.array([1, 0]),
    )
    bent_part, flat_part = build(model, MeshOptions(resolution=(1, 1))).parts
    assert flat_part.deviation_bound is not None
    assert flat_part.deviation_bound < 1e-12
    assert bent_part.deviation_bound is not None
    assert bent_part.deviation_bound >= 0.25


@pytest.mark.parametrize("shift", [1e3, 1e7])
def test_rounding_far_from_the_origin_counts(shift: float) -> None:
    """The bound includes rounding, even for a flat patch."""
    net = np.random.default_rng(7).uniform(-1, 1, (2, 2, 3))
    net[1, 1] = net[0, 1] + net[1, 0] - net[0, 0]
    model = build_model([translate(net, shift, shift, -shift)])
    for is_float32 in (False, True):
        mesh = build_mesh(model, is_float32=is_float32, resolution=(7, 5))
        check_deviation_bound(model, mesh)
        bound = mesh.report.deviation_bound
        assert bound is not None
        assert 0 < bound < (1e-4 if is_float32 else 1e-10 * shift)


def test_the_rounding_of_a_stitched_patch_is_that_of_the_patches_it_is_evaluated_with() -> None:
    """Patches with strips along their sides are evaluated apart from a huge patch of the same
    batch.

    The second patch has u and v swapped, so its side on the first patch has 5 divisions, not 2.
    """
    plane = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    nets = [plane, apply_symmetry(translate(plane, 1), SWAPPED), translate(plane * 1e9, 5)]
    parts = tuple(Part(name, k, k + 1) for k, name in enumerate(("plain", "stitched", "huge")))
    mesh = build(replace(build_model(nets), parts=parts), MeshOptions(resolution=(2, 5)))
    plain, stitched, huge = (part.deviation_bound or 0.0 for part in mesh.parts)
    assert 0 < stitched < 1e-13
    assert min(plain, huge) > 1e-8


def test_the_bound_of_a_stitched_patch_does_not_depend_on_the_batches_before_it() -> None:
    """A strip joins the second patch of a batch to the edge that it shares with the first one.

    The first patch has u and v swapped, so it divides the edge into 9, not into 4.
    """
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, np.random.default_rng(9).uniform(-1, 1, (4, 4))], axis=-1)
    beside = translate(net, 3.0)
    beside[0] = net[-1]
    pair = build_model([apply_symmetry(beside, SWAPPED), net])
    bounds = []
    for before in ((), build_mixed_model([translate(net[:2, :2], 9.0)]).batches):
        count = len(before)
        parts = tuple(Part(str(k), k, k + 1) for k in range(count + 2))
        model = replace(pair, batches=(*before, *pair.batches), parts=parts)
        result = build(model, MeshOptions(resolution=(9, 4), normals=False)).parts
        bounds.append([part.deviation_bound for part in result[count:]])
    assert bounds[0] == bounds[1]


def test_bounds_are_rounded_up() -> None:
    """The largest bound has at most four digits. It is None if it is infinite."""
    assert find_largest_bound(np.array([0.5, 0.123401, 0.2])) == 0.5
    assert find_largest_bound(np.array([0.12340001])) == 0.1235
    assert find_largest_bound(np.array([3.0000001e-12])) == 3.001e-12
    assert find_largest_bound(np.array([0.0])) == 0.0
    assert find_largest_bound(np.array([1.0, np.inf])) is None
