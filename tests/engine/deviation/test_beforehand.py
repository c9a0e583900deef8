"""Grids that are enough, against meshes that are made of them."""

import numpy as np
import pytest

from service.engine.deviation.beforehand import FINEST, enough
from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel
from tests.engine.deviation.test_bound import corners_of
from tests.examples import patches_of
from tests.oracles.deviation import surface_to_mesh
from tests.oracles.sheets import sheets_of
from tests.strategies import model_of
from tools.certify.surfaces import FAMILIES


def bowl(bend_u: float, bend_v: float, twist: float = 0.0) -> PatchModel:
    """z = (bend_u u² + bend_v v²)/2 + twist u v over the unit square."""
    x, y = np.meshgrid([0, 0.5, 1], [0, 0.5, 1], indexing="ij")
    square = np.array([0.0, 0, 0.5])
    z = bend_u * square[:, None] + bend_v * square + twist * x * y
    return model_of([np.stack([x, y, z], axis=-1)])


@pytest.mark.parametrize(
    ("bends", "depths"),
    [((8.0, 0.0), (4, 0)), ((0.0, 8.0), (0, 4)), ((8.0, 8.0), (5, 5)), ((0.0, 0.0), (0, 0))],
)
def test_patches_are_halved_where_they_bend(
    bends: tuple[float, float], depths: tuple[int, int]
) -> None:
    # A bend of 8 rises to h²: 2^-8 is 4 halvings, and two of them together need one more each.
    found = enough(bowl(*bends), 2.0**-8 * (1 + 1e-9))
    assert (found.depth_u.item(), found.depth_v.item()) == depths
    assert found.cells.item() == 2 ** sum(depths)


def test_a_twist_is_lessened_by_turns() -> None:
    found = enough(bowl(0, 0, 4.0), 2.0**-6 * (1 + 1e-9))
    assert (found.depth_u.item(), found.depth_v.item()) == (3, 3)
    np.testing.assert_allclose(found.deviation, 2.0**-6, rtol=1e-9)


@pytest.mark.parametrize(
    "family", ["bicubic, wild", "rational", "poles", "degrees 1 to 8", "triangles"]
)
@pytest.mark.parametrize("seed", range(2))
def test_meshes_of_these_grids_are_near_enough(family: str, seed: int) -> None:
    model = FAMILIES[family].surface(seed).lower()
    assert isinstance(model, PatchModel)
    low, high = model.bounds
    tolerance = 0.05 * float(np.linalg.norm(high - low))
    found = enough(model, tolerance)
    assert (found.deviation <= tolerance * (1 + 1e-9)).all()
    if isinstance(model.batches[0], TrianglePatches):
        model = PatchModel("as grids", (model.batches[0].tensor(),), model.parts)
    resolution = 2 ** int(found.depth_u.max()), 2 ** int(found.depth_v.max())
    mesh = tessellate(model, MeshOptions(resolution=resolution, normals=False))
    farthest = surface_to_mesh(sheets_of(model), corners_of(mesh), 300)
    assert farthest.distance <= found.deviation.max() + farthest.noise


def test_no_tolerance_is_too_small_to_end() -> None:
    found = enough(patches_of("sphere"), 1e-300)
    assert max(found.depth_u.max(), found.depth_v.max()) == FINEST
    assert (found.deviation > 1e-300).all()
