"""Gaussian and mean curvature at all samples of a mesh, as attributes that it carries.

They are those of the surface as it stands: of a scaled copy in a group, those of the scaled
surface. Where a limit is infinite or there is none, as at the apex of a cone, they are 0. What is
beyond float32 is the largest number that it has.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import samples
from service.bases.triangle import barycentric
from service.engine.channels import ChannelRows
from service.engine.curvatures.care import Care
from service.engine.curvatures.forms import curvatures_of
from service.engine.curvatures.grids import Chunk, grid_partials, triangle_partials
from service.engine.curvatures.ranges import NAMES
from service.engine.layout import Block, Layout
from service.engine.scene import placed_points
from service.engine.scratch import Real
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

LARGEST = float(np.finfo(np.float32).max)


def layout_curvatures(model: PatchModel, layout: Layout, dtype: Real) -> tuple[ChannelRows, ...]:
    """Both curvatures at all samples of a layout of the model.

    Raises
    ------
    TooLarge
        `too_costly`, where there are too many poles.
    """
    rows = np.empty((2, layout.size), dtype=dtype)
    care = Care()
    for block in layout.blocks:
        batch = block.batch if block.whole else block.batch.take(block.patches)
        out = rows[:, block.base : block.base + block.count * len(block.patches)]
        out = out.reshape(2, len(block.patches), block.count)
        batch = stretched(batch, model.stretch)
        for chunk in _chunks(batch, block):
            found = stored(_found(chunk, batch, block, care))
            out[:, chunk.first : chunk.last, chunk.begin : chunk.end] = found
        if isinstance(batch, TensorPatches):
            for side, patches, along, places in layout.extras_of(block):
                across = np.full(len(along), float(side % 2))
                u, v = (across, along) if side < 2 else (along, across)
                own = np.searchsorted(block.patches, patches)
                rows[:, places] = stored(care.curvatures(batch, own, u, v))
    return as_channels(model, rows)


def as_channels(model: PatchModel, rows: RealArray) -> tuple[ChannelRows, ...]:
    """Rows (2, N) as channels; equal is what differs by nothing in units of the model's size."""
    low, high = model.bounds
    size = float(np.linalg.norm(high - low))
    if model.stretch is not None:
        size *= float(np.linalg.norm(model.stretch[:3, :3], 2))
    return tuple(
        ChannelRows(name, "attribute", values[:, np.newaxis], unit)
        for name, values, unit in zip(NAMES, rows, (size * size, size), strict=True)
    )


def stretched(patches: Patches, stretch: FloatArray | None) -> Patches:
    """The patches after a linear map, without their channels."""
    if stretch is None:
        return replace(patches, channels=())
    points = placed_points(patches.points.reshape(-1, 3), stretch)
    return replace(patches, points=points.reshape(patches.points.shape), channels=())


def stored(found: FloatArray) -> FloatArray:
    """Curvatures as any format can hold them."""
    return np.nan_to_num(found, nan=0.0, posinf=LARGEST, neginf=-LARGEST).clip(-LARGEST, LARGEST)


def _chunks(batch: Patches, block: Block) -> Iterator[Chunk]:
    if isinstance(batch, TrianglePatches):
        return triangle_partials(batch, block.resolution[0])
    return grid_partials(batch, block.resolution)


def _found(chunk: Chunk, batch: Patches, block: Block, care: Care) -> FloatArray:
    """Curvatures (2, r, n) of a chunk."""
    found, doubtful = curvatures_of(chunk.partials, chunk.least)
    with np.errstate(over="ignore"):
        found[0] *= np.square(chunk.scale)[:, np.newaxis]
        found[1] *= chunk.scale[:, np.newaxis]
    row, column = np.nonzero(doubtful)
    if len(row):
        u, v = _parameters(block, column + chunk.begin)
        found[:, row, column] = care.curvatures(batch, row + chunk.first, u, v)
    return found


def _parameters(block: Block, sample: Ints) -> tuple[FloatArray, FloatArray]:
    """Parameters (u, v) of samples by their number in a patch; of triangles (s, t)."""
    if block.triangular:
        _, s, t = barycentric(block.resolution[0]).T
        return s[sample], t[sample]
    i, j = np.divmod(sample, block.resolution[1] + 1)
    return samples(block.resolution[0])[i], samples(block.resolution[1])[j]
