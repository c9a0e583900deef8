"""Positions, normals and parameters at all samples of a layout.

Grids are evaluated patch by patch; then every border is overwritten with the samples of its edge,
which depend on the edge alone.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import samples as parameters
from service.engine.evaluate import evaluate
from service.engine.layout import Block, Layout
from service.engine.normals import unit_normals
from service.engine.options import MeshOptions
from service.engine.scratch import Real
from service.engine.stitch import sample_edges


@dataclass(frozen=True, eq=False, slots=True)
class SampleRows:
    """All samples in one run: (N, 3), (N, 3) or None, (N, 2) or None."""

    positions: RealArray
    normals: RealArray | None
    uvs: RealArray | None
    poles: int

    def take(self, chosen: Ints) -> "SampleRows":
        """Some of the rows, in this order."""
        return SampleRows(
            self.positions.take(chosen, axis=0),
            None if self.normals is None else self.normals.take(chosen, axis=0),
            None if self.uvs is None else self.uvs.take(chosen, axis=0),
            self.poles,
        )


def sample(layout: Layout, options: MeshOptions, dtype: Real, origin: FloatArray) -> SampleRows:
    """Evaluates the blocks, then writes the samples of every edge over its sides."""
    results = [
        evaluate(
            block.batch if block.whole else block.batch.take(block.patches),
            block.resolution,
            dtype=dtype,
            normals=options.normals,
            origin=origin,
        )
        for block in layout.blocks
    ]
    poles = sum(result.poles for result in results)
    extras = layout.size - sum(block.count * len(block.patches) for block in layout.blocks)
    positions = _run([result.positions for result in results], extras)
    normals = None
    if options.normals:
        normals = _run([r.normals for r in results if r.normals is not None], extras)
    uvs = (
        _run([_block_uvs(block, dtype) for block in layout.blocks], extras) if options.uvs else None
    )
    _write_edges(positions, layout, origin)
    if layout.framed:
        poles += _write_extras(layout, normals, uvs)
    if dtype is np.float64:
        # People read these numbers: adding 0.0 turns -0.0 into 0.0.
        for rows in (positions, normals):
            if rows is not None:
                np.add(rows, 0.0, out=rows)
    return SampleRows(positions, normals, uvs, poles)


def _run(grids: list[RealArray], extras: int) -> RealArray:
    """Grids (m, Ru+1, Rv+1, d) as one run of rows, with room for the extra samples."""
    rows = [grid.reshape(-1, grid.shape[-1]) for grid in grids]
    if len(rows) == 1 and not extras:
        return rows[0]
    return np.concatenate([*rows, np.zeros((extras, rows[0].shape[1]), rows[0].dtype)])


def _block_uvs(block: Block, dtype: Real) -> RealArray:
    u, v = (parameters(r).astype(dtype) for r in block.resolution)
    pairs = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    return np.tile(pairs, (len(block.patches), 1, 1, 1))


def _write_edges(positions: RealArray, layout: Layout, origin: FloatArray) -> None:
    """Every side gets the very samples of its edge, every corner its control point."""
    seams = layout.seams
    edge = seams.edge.ravel()
    row = np.zeros(len(seams.users), dtype=np.intp)
    for divisions, sides in layout.side_groups():
        used = np.zeros(len(row), dtype=bool)
        used[edge[sides]] = True
        ids = np.flatnonzero(used)
        row[ids] = np.arange(len(ids))
        points = sample_edges(seams.curves, used, divisions) - origin
        positions[layout.side_samples(sides, divisions)] = points[row[edge[sides]]]
    corners = seams.corner_points - origin
    positions[layout.corner_samples()] = corners[seams.corner]
    samples, corner = layout.collapsed_samples()
    positions[samples] = corners[corner]


def _write_extras(layout: Layout, normals: RealArray | None, uvs: RealArray | None) -> int:
    """Normals and parameters of the samples beside the grids; how many normals are limits."""
    limits = 0
    for block in layout.blocks:
        numbers = block.first + block.patches
        extra = layout.extra[numbers]
        patch, side = np.nonzero(extra >= 0)
        inner = layout.inner[numbers][patch, side]
        row = np.repeat(np.arange(len(patch)), inner)
        k = np.arange(len(row)) - np.repeat(np.cumsum(inner) - inner, inner)
        samples = extra[patch, side][row] + k
        along = (k + 1) / (inner[row] + 1)
        across = (side % 2)[row].astype(np.float64)
        on_u = side[row] < 2
        u, v = np.where(on_u, across, along), np.where(on_u, along, across)
        if normals is not None:
            normals[samples], found = unit_normals(block.batch, block.patches[patch[row]], u, v)
            limits += found
        if uvs is not None:
            uvs[samples] = np.stack([u, v], axis=1)
    return limits
