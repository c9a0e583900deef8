"""Gaussian and mean curvature at all samples of a mesh, as attributes of its vertices.

The curvatures of a scaled copy in a group are those of the scaled surface. Where a limit is
infinite or does not exist, as at the apex of a cone, the curvature is 0. A curvature beyond float32
becomes the largest number of float32.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import sample_parameters
from service.bases.triangle import row_starts
from service.engine.curvatures.forms import compute_curvatures
from service.engine.curvatures.grids import Chunk, grid_partials, triangle_partials
from service.engine.curvatures.limit_curvature import LimitCurvatures
from service.engine.curvatures.ranges import NAMES
from service.engine.mesh.channels import ChannelRows
from service.engine.mesh.layout import Layout
from service.engine.mesh.runs import Block
from service.engine.points.evaluate import find_near_poles
from service.engine.scenes.scene import place_points
from service.engine.scratch import Real
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

LARGEST = float(np.finfo(np.float32).max)


def layout_curvatures(model: PatchModel, layout: Layout, dtype: Real) -> tuple[ChannelRows, ...]:
    """Both curvatures at all samples of a layout of the model.

    Raises
    ------
    TooLarge
        `too_costly` if there are too many poles.
    """
    rows = np.empty((2, layout.size), dtype=dtype)
    limit_curvatures = LimitCurvatures()
    for block, patches in layout.split_batches(model.batches):
        out = rows[:, block.base : block.base + block.count * len(block.patches)]
        out = out.reshape(2, len(block.patches), block.count)
        batch = stretch_patches(patches, model.stretch)
        _write_block(block, batch, limit_curvatures, out)
        if isinstance(batch, TensorPatches):
            for side, owners, along, places in layout.iterate_extras(block):
                across = np.full(len(along), float(side % 2))
                u, v = (across, along) if side < 2 else (along, across)
                patch_rows = np.searchsorted(block.patches, owners)
                rows[:, places] = limit_to_storable(
                    limit_curvatures.curvatures(batch, patch_rows, u, v)
                )
    return to_channels(model, rows)


def to_channels(model: PatchModel, rows: RealArray) -> tuple[ChannelRows, ...]:
    """Rows (2, N) as channels. Values are compared in units of the model's size."""
    # As for points: adding 0.0 turns -0.0 into 0.0.
    rows += 0.0
    low, high = model.bounds
    size = float(np.linalg.norm(high - low))
    if model.stretch is not None:
        size *= float(np.linalg.norm(model.stretch[:3, :3], 2))
    return tuple(
        ChannelRows(name, "attribute", values[:, np.newaxis], unit)
        for name, values, unit in zip(NAMES, rows, (size * size, size), strict=True)
    )


def stretch_patches(patches: Patches, stretch: FloatArray | None) -> Patches:
    """The patches after a linear map, without their channels."""
    if stretch is None:
        return replace(patches, channels=())
    points = place_points(patches.points.reshape(-1, 3), stretch)
    return replace(patches, points=points.reshape(patches.points.shape), channels=())


def limit_to_storable(curvatures: FloatArray) -> FloatArray:
    """Curvatures limited to numbers that every format can store."""
    return np.nan_to_num(curvatures, nan=0.0, posinf=LARGEST, neginf=-LARGEST).clip(
        -LARGEST, LARGEST
    )


def _write_block(
    block: Block, batch: Patches, limit_curvatures: LimitCurvatures, out: RealArray
) -> None:
    """Curvatures (2, P, samples) of a block: by formulas, and by limits where the formulas fail."""
    if isinstance(batch, TrianglePatches):
        chunks = triangle_partials(batch, block.resolution[0])
    else:
        chunks = grid_partials(batch, block.resolution)
    doubtful = []
    for chunk in chunks:
        curvatures, left = _compute_chunk(chunk, batch, block)
        out[:, chunk.first : chunk.last, chunk.begin : chunk.end] = limit_to_storable(curvatures)
        doubtful.append(left)
        limit_curvatures.check(sum(left.shape[1] for left in doubtful), batch)
    # All limits in one call: the preparation of a patch of high degree takes half of the time.
    row, column = np.concatenate(doubtful, axis=1)
    if len(row):
        limits = limit_curvatures.curvatures(batch, row, *find_parameters(block, column))
        out[:, row, column] = limit_to_storable(limits)


def _compute_chunk(chunk: Chunk, batch: Patches, block: Block) -> tuple[FloatArray, Ints]:
    """Curvatures (2, r, n) of a chunk; and patches and samples (2, m) where they are doubtful."""
    curvatures, beside_poles, anywhere = compute_curvatures(chunk.partials, chunk.measure)
    with np.errstate(over="ignore", invalid="ignore"):
        curvatures[0] *= np.square(chunk.scale)[:, np.newaxis]
        curvatures[1] *= chunk.scale[:, np.newaxis]
    row, column = np.nonzero(beside_poles | anywhere)
    surely = anywhere[row, column]
    row, column = row + chunk.first, column + chunk.begin
    surely |= find_near_poles(batch, row, np.stack(find_parameters(block, column), axis=1))
    return curvatures, np.stack([row, column])[:, surely]


def find_parameters(block: Block, sample: Ints) -> tuple[FloatArray, FloatArray]:
    """Parameters (u, v) of samples by their number in a patch; of triangles (s, t)."""
    if block.is_triangle:
        divisions = block.resolution[0]
        starts = row_starts(divisions)
        row = np.searchsorted(starts, sample, side="right") - 1
        return (sample - starts[row]) / divisions, row / divisions
    i, j = np.divmod(sample, block.resolution[1] + 1)
    return sample_parameters(block.resolution[0])[i], sample_parameters(block.resolution[1])[j]
