"""Bounds of the deviation of a mesh of equal divisions from its surface, patch by patch.

Three bounds are added: of the bending of patches between their samples (`second_derivatives`), of
the distance from stored vertices to these samples (`vertex_rounding`), and of the parts of the
surface that the mesh omits because their triangles have no area (`degenerate_faces`).

The bound divided by the largest deviation that dense sampling finds is, at 16 divisions: 1.5 on the
teapot's patches, 2.1 on the sphere's, 2.7 on random bicubic patches, 4.3 on patches with wildly
scattered control points.

Proof in docs/proofs.md: "Stored vertices".
"""

from decimal import ROUND_CEILING, Context
from math import isfinite

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.bounds.degenerate_faces import bound_missing_distances
from service.engine.bounds.products import bound_grid_deviations, is_small
from service.engine.bounds.second_derivatives import (
    bound_second_derivatives,
    bound_triangle_deviations,
    count_blocks,
)
from service.engine.bounds.vertex_rounding import (
    STEPS,
    bound_bending_rounding,
    bound_edge_error,
    bound_vertex_error,
    measure_errors,
)
from service.engine.connectivity.seams import Seams
from service.engine.mesh.filling import SampleRows
from service.engine.options import MeshOptions
from service.engine.plans.layout import Layout
from service.engine.plans.sample_numbers import Block
from service.engine.scratch import Real
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

ROUNDED_UP = Context(prec=4, rounding=ROUND_CEILING)
"""Four digits, rounded up: further digits would depend on the processor."""


def bound_deviations(
    model: PatchModel,
    seams: Seams,
    layout: Layout,
    options: MeshOptions,
    rows: SampleRows,
    *,
    origin: FloatArray,
) -> FloatArray:
    """Bounds (P,) of the deviation of each patch: bending, rounding, joining, omitted triangles.

    Parameters
    ----------
    rows : SampleRows
        Samples in the precision of the file, before welding.
    origin : ndarray of float64, shape (3,)
        The origin of the samples.
    """
    bounds = np.empty(len(layout.base))
    # The error of edges and of joining, which is added to the bound of every patch.
    shared_error = bound_edge_error(seams, layout, options.method) + model.moved
    for block, patches in layout.split_batches(model.batches):
        moved: FloatArray | float
        if options.method == "matrix":
            dtype: Real = rows.positions.dtype.type
            # `patches` must be all the patches that were evaluated together: their number decides
            # which formulation of `matrix` evaluated them, and so how large the rounding is.
            moved = bound_vertex_error(patches, block.resolution, options.normals, dtype, origin)
        else:
            # `block.count` is the number of samples of one patch.
            samples = rows.positions[block.base : block.base + block.count * len(block.patches)]
            moved = measure_errors(
                patches, block.resolution, samples.reshape(-1, block.count, 3), origin
            )
        chordal = _bound_chordal(patches, layout, block)
        # `STEPS` includes the rounding of parameters and of the bound itself.
        bounds[block.first + block.patches] = chordal * STEPS + (moved + shared_error)
    if not layout.may_lose_faces:
        return bounds
    return bounds + bound_missing_distances(layout, options, rows.positions)


def find_largest_bound(bounds: FloatArray) -> float | None:
    """The largest of bounds (P,), rounded up to four digits; None if it is infinite."""
    return round_up(float(np.maximum.reduce(bounds, initial=0.0)))


def round_up(bound: float) -> float | None:
    """A bound rounded up to four digits; None if it is infinite."""
    return float(ROUNDED_UP.create_decimal_from_float(bound)) if isfinite(bound) else None


def bound_parts(model: PatchModel, bounds: FloatArray) -> list[float | None]:
    """The largest bound of each part, given bounds (P,) of all patches.

    A bound is None if it is infinite, or if the part has no patches.
    """
    if model.sequence is not None:  # parts count patches in this order
        bounds = bounds[model.sequence]
    values = bounds.tolist()
    return [
        round_up(max(values[part.first : part.last])) if part.first < part.last else None
        for part in model.parts
    ]


def _bound_chordal(patches: Patches, layout: Layout, block: Block) -> FloatArray:
    """Bounds (m,) of the distances from patches of a block to triangles between their points."""
    ru, rv = block.resolution
    if isinstance(patches, TrianglePatches):
        rounding = bound_bending_rounding(patches, 1 / ru, 1 / ru)
        return bound_triangle_deviations(patches, ru) + rounding
    p, q = patches.degree
    rounding = bound_bending_rounding(patches, 1 / ru, 1 / rv)
    patch_numbers = block.first + block.patches
    # `layout.first_extra` is −1 for a side without extra samples. A strip of triangles joins a side
    # with extra samples to the grid.
    is_separate = layout.first_extra[patch_numbers] >= 0 if layout.is_stitched else None
    if is_separate is None or not is_separate.any():
        if is_small(patches, (ru, rv)):
            return bound_grid_deviations(patches, (ru, rv)) + rounding
        # Each patch is cut into blocks, and second derivatives are bounded over each block. These
        # blocks are pieces of one patch, unlike `block`, which is a group of patches.
        blocks = count_blocks(ru, p), count_blocks(rv, q)
        bends = bound_second_derivatives(patches, (ru, rv), blocks)
        return bends.bound_deviations(1 / ru, 1 / rv) + rounding
    # A side has one division more than extra samples.
    strip_divisions = np.where(is_separate, layout.extra_count[patch_numbers] + 1, np.inf)
    # A strip joins a line of m divisions to a line of n divisions. Each of its triangles is at most
    # 1/m or 1/n long along these lines, and one cell of the grid wide across them. A strip may
    # lie anywhere in the patch, so second derivatives, and rounding, are bounded over the whole
    # patch, and not over blocks.
    along_v = 1 / np.minimum(rv, strip_divisions[:, :2].min(axis=1))
    along_u = 1 / np.minimum(ru, strip_divisions[:, 2:].min(axis=1))
    bends = bound_second_derivatives(patches, (ru, rv), (1, 1))
    return bends.bound_deviations(along_u, along_v) + bound_bending_rounding(patches, 1.0, 1.0)
