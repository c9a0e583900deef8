"""Gaussian and mean curvature at all samples of a mesh, as attributes of its vertices.

A scaled copy in a group has the curvatures of the scaled surface. The formulas fail at and near
poles and cusps; there the curvature is a limit. If that limit is infinite or does not exist, as at
the apex of a cone, the curvature is 0. A curvature whose absolute value is too large for float32
becomes ±the largest float32 number.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import sample_parameters
from service.bases.row_batches import row_runs
from service.bases.triangle import locate_samples
from service.engine.curvatures.forms import compute_curvatures
from service.engine.curvatures.grids import Chunk, grid_partials, triangle_partials
from service.engine.mesh.channels import ChannelRows
from service.engine.mesh.mesh import CURVATURE_NAMES
from service.engine.plans.layout import Layout
from service.engine.plans.sample_numbers import Block
from service.engine.points.evaluate import SERIES_COST, find_near_poles
from service.engine.points.jets import evaluate_jets
from service.engine.scenes.placing import place_points
from service.engine.scratch import Real
from service.errors import Issue, TooLarge
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

CHUNK_SAMPLES = 16_384
"""The most samples that are evaluated before the cost is compared with its limit again."""

MAX_MULTIPLICATIONS = 10_000_000_000
"""The most multiplications for the limits of one mesh: about 100,000 limits, which take seconds."""


@dataclass(slots=True)
class LimitCurvatures:
    """The limits of curvature of one mesh, and the multiplications spent on them."""

    spent: int = 0

    def curvatures(self, patches: Patches, index: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """Gaussian and mean curvature, (2, m), of patch `index[k]` at (u[k], v[k]).

        For triangles, u and v are the parameters s and t. A curvature is NaN where its limit is
        infinite or does not exist.

        Raises
        ------
        TooLarge
            `too_costly` if too many samples are at poles or cusps.
        """
        values = np.empty((2, len(index)))
        for first, last in row_runs(len(index), CHUNK_SAMPLES):
            rows = slice(first, last)
            samples = index[rows], u[rows], v[rows]
            jets = evaluate_jets(patches, *samples, 2)
            if jets.curvatures is None or jets.degenerate is None:
                raise ValueError("Jets of order 2 have curvatures.")
            values[:, rows] = jets.curvatures[:2]
            parameters = np.stack([u[rows], v[rows]], axis=1)
            is_near_pole = find_near_poles(patches, index[rows], parameters)
            count = int((is_near_pole | jets.degenerate).sum())
            self.refuse_if_too_costly(count, patches)
            self.spent += count * count_limit_multiplications(patches)
        return values

    def refuse_if_too_costly(self, count: int, patches: Patches) -> None:
        """Raise `TooLarge` if `count` more limits on these patches would take too long."""
        if self.spent + count * count_limit_multiplications(patches) > MAX_MULTIPLICATIONS:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "Curvatures at poles and cusps are limits, and the mesh has too many of them.",
                    "/curvatures",
                    f"more than {MAX_MULTIPLICATIONS:.3g} multiplications",
                    "fewer divisions, or no curvatures",
                )
            )


def count_limit_multiplications(patches: Patches) -> int:
    """A lower bound of the number of multiplications for the limit at one sample.

    Each control point adds at least 100 to `SERIES_COST`; homogeneous coordinates double the sum.
    """
    degrees = patches.degree if isinstance(patches, TensorPatches) else (patches.degree,) * 2
    control_points = (degrees[0] + 1) * (degrees[1] + 1)
    return (SERIES_COST + 100 * control_points) * (1 if patches.weights is None else 2)


def is_affordable(models: Sequence[PatchModel], samples: int) -> bool:
    """Whether a mesh with this number of samples stays below the limit even if all are at poles."""
    max_multiplications = max(
        count_limit_multiplications(b) for model in models for b in model.batches
    )
    return samples * max_multiplications <= MAX_MULTIPLICATIONS


FLOAT32_MAX = float(np.finfo(np.float32).max)


def layout_curvatures(model: PatchModel, layout: Layout, dtype: Real) -> tuple[ChannelRows, ...]:
    """Gaussian and mean curvature at all samples of a layout of the model, as two channels.

    Raises
    ------
    TooLarge
        `too_costly` if too many samples are at poles or cusps.
    """
    rows = np.empty((2, layout.size), dtype=dtype)
    limit_curvatures = LimitCurvatures()
    for block, patches in layout.split_batches(model.batches):
        out = rows[:, block.base : block.base + block.count * len(block.patches)]
        out = out.reshape(2, len(block.patches), block.count)
        batch = stretch_patches(patches, model.stretch)
        _write_block(block, batch, limit_curvatures, out)
        if isinstance(batch, TensorPatches):
            # The extra samples on sides of stitched patches; `along` is the parameter along a side.
            for side, owners, along, sample_rows in layout.iterate_extras(block):
                across = np.full(len(along), float(side % 2))
                u, v = (across, along) if side < 2 else (along, across)
                patch_rows = np.searchsorted(block.patches, owners)
                rows[:, sample_rows] = clip_to_storable(
                    limit_curvatures.curvatures(batch, patch_rows, u, v)
                )
    return to_channels(model, rows)


def to_channels(model: PatchModel, rows: RealArray) -> tuple[ChannelRows, ...]:
    """The rows (2, N) of Gaussian and mean curvature as two channels.

    The unit of a channel (`ChannelRows`) is the square of the model's size for Gaussian curvature,
    and the size for mean curvature, so that a curvature times its unit has no dimension.
    """
    rows += 0.0  # turns -0.0 into 0.0, as for points
    low, high = model.bounds
    size = float(np.linalg.norm(high - low))
    if model.stretch is not None:
        size *= float(np.linalg.norm(model.stretch[:3, :3], 2))
    return tuple(
        ChannelRows(name, "attribute", values[:, np.newaxis], unit)
        for name, values, unit in zip(CURVATURE_NAMES, rows, (size * size, size), strict=True)
    )


def stretch_patches(patches: Patches, stretch: FloatArray | None) -> Patches:
    """The patches after a linear map, without their channels."""
    if stretch is None:
        return replace(patches, channels=())
    points = place_points(patches.points.reshape(-1, 3), stretch)
    return replace(patches, points=points.reshape(patches.points.shape), channels=())


def clip_to_storable(curvatures: FloatArray) -> FloatArray:
    """Curvatures as numbers that every format can store: finite in float32, 0 in place of NaN."""
    return np.nan_to_num(curvatures, nan=0.0, posinf=FLOAT32_MAX, neginf=-FLOAT32_MAX).clip(
        -FLOAT32_MAX, FLOAT32_MAX
    )


def _write_block(
    block: Block, batch: Patches, limit_curvatures: LimitCurvatures, out: RealArray
) -> None:
    """Writes the curvatures (2, P, samples) of a block to `out`.

    They come from formulas, and from limits where the formulas fail.
    """
    chunks = (
        triangle_partials(batch, block.resolution[0])
        if isinstance(batch, TrianglePatches)
        else grid_partials(batch, block.resolution)
    )
    doubtful = []
    for chunk in chunks:
        curvatures, doubtful_in_chunk = _compute_chunk(chunk, batch, block)
        out[:, chunk.first : chunk.last, chunk.begin : chunk.end] = clip_to_storable(curvatures)
        doubtful.append(doubtful_in_chunk)
        limit_curvatures.refuse_if_too_costly(sum(pairs.shape[1] for pairs in doubtful), batch)
    # One call computes all limits, because preparing a patch of high degree takes half of the time.
    row, column = np.concatenate(doubtful, axis=1)
    if len(row):
        limits = limit_curvatures.curvatures(batch, row, *find_parameters(block, column))
        out[:, row, column] = clip_to_storable(limits)


def _compute_chunk(chunk: Chunk, batch: Patches, block: Block) -> tuple[FloatArray, Ints]:
    """The curvatures of a chunk, and where they are doubtful.

    Returns
    -------
    curvatures : ndarray of float64, shape (2, r, n)
    doubtful : ndarray of int, shape (2, m)
        Numbers of patches and samples whose curvatures must be computed as limits.
    """
    curvatures, is_doubtful_near_pole, is_doubtful = compute_curvatures(
        chunk.partials, chunk.squared_norm
    )
    with np.errstate(over="ignore", invalid="ignore"):
        curvatures[0] *= np.square(chunk.scale)[:, np.newaxis]
        curvatures[1] *= chunk.scale[:, np.newaxis]
    row, column = np.nonzero(is_doubtful_near_pole | is_doubtful)
    needs_limit = is_doubtful[row, column]
    row, column = row + chunk.first, column + chunk.begin
    needs_limit |= find_near_poles(batch, row, np.stack(find_parameters(block, column), axis=1))
    return curvatures, np.stack([row, column])[:, needs_limit]


def find_parameters(block: Block, sample: Ints) -> tuple[FloatArray, FloatArray]:
    """Parameters (u, v) of samples from their numbers in a patch; of triangles, (s, t)."""
    if block.is_triangle:
        return locate_samples(block.resolution[0], sample)
    i, j = np.divmod(sample, block.resolution[1] + 1)
    return sample_parameters(block.resolution[0])[i], sample_parameters(block.resolution[1])[j]
