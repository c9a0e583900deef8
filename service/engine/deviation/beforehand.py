"""Grids that certainly are near enough, known before anything is evaluated.

By the bound of `service.engine.deviation.bends` every triangle within a cell of such a grid is near
enough, whatever its corners are. A division of the patch that is nowhere finer than the grid needs
no more cells than it has.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.deviation.bends import Bends, grid_bends, slack
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

FINEST = 30
"""Halvings at which it is given up."""

BLOCKS = 4
"""In each direction, once a grid has as many divisions."""


@dataclass(frozen=True, eq=False, slots=True)
class Enough:
    """For every patch a grid of 2^a × 2^b cells, and the bound of the deviation that it has.

    Attributes
    ----------
    depth_u, depth_v : ndarray of int, shape (P,)
        a and b; as tensor-product patches with v = 1 for a point, where patches are triangles.
    deviation : ndarray of float64, shape (P,)
        Model units, without the rounding of vertices. Above the tolerance only where `FINEST`
        halvings are not enough.
    """

    depth_u: Ints
    depth_v: Ints
    deviation: FloatArray

    @property
    def cells(self) -> FloatArray:
        """Cells of each grid, shape (P,): as numbers that do not overflow."""
        return np.exp2((self.depth_u + self.depth_v).astype(np.float64))


def enough(model: PatchModel, tolerance: float) -> Enough:
    """Grids of all patches of a model, for a tolerance in its units."""
    found = [_enough(batch, tolerance) for batch in model.batches]
    u, v, deviation = (np.concatenate(columns) for columns in zip(*found, strict=True))
    return Enough(u, v, deviation)


def _enough(patches: Patches, tolerance: float) -> tuple[Ints, Ints, FloatArray]:
    """The grids of a batch."""
    tensor = patches.tensor() if isinstance(patches, TrianglePatches) else patches
    # Of one block cells may be of any size, of several at most as large as these.
    whole = _halved(grid_bends(tensor, (1, 1), (1, 1)), 0, tolerance)
    cut = _halved(grid_bends(tensor, (BLOCKS, BLOCKS), (BLOCKS, BLOCKS)), 2, tolerance)
    better = cut[0] + cut[1] < whole[0] + whole[1]
    u, v, deviation = (np.where(better, a, b) for a, b in zip(cut, whole, strict=True))
    return u, v, deviation + slack(tensor, 1.0, 1.0)


def _halved(bends: Bends, least: int, tolerance: float) -> tuple[Ints, Ints, FloatArray]:
    """Cells halved, from 2^-least, in the direction that the worst block bends more in."""
    count = bends.uu.shape[-1]
    uu, uv, vv = (m.reshape(-1, count) for m in (bends.uu, bends.uv, bends.vv))
    u, v = np.full(count, least), np.full(count, least)
    deviation = np.zeros(count)
    left = np.arange(count)
    while len(left):
        along_u, along_v = np.exp2(-u[left]), np.exp2(-v[left])
        parts = np.stack([along_u**2 * uu[:, left], along_v**2 * vv[:, left]])
        bounds = (parts.sum(axis=0) + 2 * along_u * along_v * uv[:, left]) / 8
        worst = bounds.argmax(axis=0)
        rows = np.arange(len(left))
        deviation[left] = bounds[worst, rows]
        fails = (deviation[left] > tolerance) & (np.maximum(u[left], v[left]) < FINEST)
        first, second = parts[:, worst, rows]
        # A twist alone is lessened by either; then the coarser direction has its turn.
        along_u_next = np.where(first == second, u[left] <= v[left], first > second)
        u[left[fails & along_u_next]] += 1
        v[left[fails & ~along_u_next]] += 1
        left = left[fails]
    return u, v, deviation
