"""The deviation of a mesh of equal divisions: no point of the surface is further from its faces.

Three parts add up: what patches bend between their samples (`second_derivatives`), how far written
vertices are from these (`vertex_rounding`), and what faces without area leave out
(`degenerate_faces`).

How close it is, bound over the largest deviation that dense sampling finds, at 16 divisions: 1.5
on the teapot's patches, 2.1 on the sphere's, 2.7 on random bicubic ones, 4.3 on those whose control
points lie wildly. Of the latter a factor of 2.4 is that points of equal parameters are compared,
where the mesh may well be nearer.
"""

from decimal import ROUND_CEILING, Context
from math import isfinite

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.bounds.degenerate_faces import missing_distances
from service.engine.bounds.products import grid_deviations, is_small
from service.engine.bounds.second_derivatives import (
    blocks_along,
    second_derivative_bounds,
    triangle_deviations,
)
from service.engine.bounds.vertex_rounding import (
    STEPS,
    edge_error,
    measured_errors,
    slack,
    vertex_error,
)
from service.engine.mesh.filling import SampleRows
from service.engine.mesh.layout import Layout
from service.engine.mesh.runs import Block
from service.engine.mesh.seams import Seams
from service.engine.options import MeshOptions
from service.engine.scratch import Real
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

ROUNDED_UP = Context(prec=4, rounding=ROUND_CEILING)
"""Further digits of a bound would be those of the arithmetic, not of the surface."""


def deviations(
    model: PatchModel,
    seams: Seams,
    layout: Layout,
    options: MeshOptions,
    rows: SampleRows,
    *,
    origin: FloatArray,
) -> FloatArray:
    """Bound for each patch, (P,): what it bends, what rounding moved, what has no faces.

    Parameters
    ----------
    rows : SampleRows
        As they are written, before they are welded.
    origin : ndarray of float64, shape (3,)
        Where they are written from.
    """
    found = np.empty(len(layout.base))
    beside = edge_error(seams, layout, options.method)
    for block, patches in layout.split_batches(model.batches):
        moved: FloatArray | float
        if options.method == "matrix":
            dtype: Real = rows.positions.dtype.type
            # Of the very patches that were evaluated: their number chooses the formulation.
            moved = vertex_error(patches, block.resolution, options.normals, dtype, origin)
        else:
            samples = rows.positions[block.base : block.base + block.count * len(block.patches)]
            moved = measured_errors(
                patches, block.resolution, samples.reshape(-1, block.count, 3), origin
            )
        found[block.first + block.patches] = (
            _chordal(patches, layout, block) * STEPS + moved + beside
        )
    if not layout.may_lose_faces:
        return found
    return found + missing_distances(layout, options, rows.positions)


def largest(bounds: FloatArray) -> float | None:
    """The bound of several patches, rounded up to a few digits; None if there is none."""
    return rounded_up(float(np.maximum.reduce(bounds, initial=0.0)))


def rounded_up(bound: float) -> float | None:
    """A bound with a few digits; None if it is infinite."""
    return float(ROUNDED_UP.create_decimal_from_float(bound)) if isfinite(bound) else None


def bounds_of_parts(model: PatchModel, bounds: FloatArray) -> list[float | None]:
    """For each part of a model the bound of its patches."""
    if model.sequence is not None:
        bounds = bounds[model.sequence]
    values = bounds.tolist()
    return [rounded_up(max(values[part.first : part.last], default=0.0)) for part in model.parts]


def _chordal(patches: Patches, layout: Layout, block: Block) -> FloatArray:
    """How far the patches of a block may be from triangles between points of their own: (m,)."""
    ru, rv = block.resolution
    if isinstance(patches, TrianglePatches):
        return triangle_deviations(patches, ru) + slack(patches, 1 / ru, 1 / ru)
    p, q = patches.degree
    numbers = block.first + block.patches if layout.is_framed else block.patches
    apart = layout.extra[numbers] >= 0 if layout.is_framed else None
    if apart is None or not apart.any():
        if is_small(patches, (ru, rv)):
            return grid_deviations(patches, (ru, rv)) + slack(patches, 1 / ru, 1 / rv)
        bends = second_derivative_bounds(
            patches, (ru, rv), (blocks_along(ru, p), blocks_along(rv, q))
        )
        return bends.deviations(1 / ru, 1 / rv) + slack(patches, 1 / ru, 1 / rv)
    sides = np.where(apart, layout.inner[numbers] + 1, np.inf)
    # A strip between lines of m and of n divisions goes along both in step: each of its triangles
    # lies within 1/m or 1/n along them, and within a cell across; but anywhere among the blocks.
    along_v = 1 / np.minimum(rv, sides[:, :2].min(axis=1))
    along_u = 1 / np.minimum(ru, sides[:, 2:].min(axis=1))
    bends = second_derivative_bounds(patches, (ru, rv), (1, 1))
    return bends.deviations(along_u, along_v) + slack(patches, 1.0, 1.0)
