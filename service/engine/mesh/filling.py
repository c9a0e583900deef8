"""Positions, normals and channels at all samples of a layout.

Grids are evaluated patch by patch. Then the samples of each border are overwritten with the samples
of its edge, which depend on the edge alone.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, FloatArray, RealArray
from service.engine.connectivity.edges import sample_edges
from service.engine.connectivity.seams import Seams
from service.engine.evaluation.evaluate import evaluate
from service.engine.evaluation.normals import unit_normals
from service.engine.extent import is_moved
from service.engine.mesh.channels import ChannelRows, sample_channels
from service.engine.options import MeshOptions, Method
from service.engine.plans.face_plan import FacePlan
from service.engine.plans.layout import Layout
from service.engine.plans.vertices import mean_normals
from service.engine.scratch import Real
from service.surface.batches import TensorPatches
from service.surface.lowered import PatchModel


@dataclass(frozen=True, eq=False, slots=True)
class SampleRows:
    """All samples of a mesh: positions (N, 3), normals (N, 3) or None, and channels (N, d).

    `poles` is the number of samples at which du × dv vanishes, so that the normal is a limit.
    """

    positions: RealArray
    normals: RealArray | None
    channels: tuple[ChannelRows, ...]
    poles: int


def fill_vertices(rows: SampleRows, plan: FacePlan) -> SampleRows:
    """The vertices of a plan: rows of samples, with mean normals where samples share a vertex."""
    is_vertex = plan.is_vertex
    if is_vertex is None:
        return rows
    normals = None
    if rows.normals is not None:
        normals = _keep_rows(rows.normals, is_vertex)
        if plan.means is not None:
            averages, vertices = plan.means
            normals[vertices] = mean_normals(rows.normals, averages)
    return SampleRows(
        _keep_rows(rows.positions, is_vertex),
        normals,
        tuple(replace(c, values=_keep_rows(c.values, is_vertex)) for c in rows.channels),
        rows.poles,
    )


def _keep_rows(rows: RealArray, is_kept: Bools) -> RealArray:
    """The rows (N, d) for which `is_kept` (N,) is true."""
    return _view_items(rows)[is_kept].view(rows.dtype).reshape(-1, rows.shape[1])


def _view_items(rows: RealArray) -> NDArray[np.void]:
    """Rows (N, d) as N items: NumPy copies an item two to ten times as fast as a row."""
    return rows.view(np.dtype((np.void, rows.strides[0])))[:, 0]


def sample_model(
    model: PatchModel,
    seams: Seams,
    layout: Layout,
    options: MeshOptions,
    *,
    dtype: Real,
    origin: FloatArray,
) -> SampleRows:
    """Evaluates the blocks, then replaces the samples of all sides by those of their edges."""
    results = []
    for block, patches in layout.split_batches(model.batches):
        # The connectivity knows which sides are points, so the patches need not be searched again.
        if layout.has_poles and isinstance(patches, TensorPatches):
            patches.set_collapsed(seams.collapsed[block.first + block.patches])
        results.append(
            evaluate(
                patches,
                block.resolution,
                dtype=dtype,
                normals=options.normals,
                origin=origin,
                method=options.method,
            )
        )
    poles = sum([result.poles for result in results])
    positions = _join_grids([result.positions for result in results], layout.size)
    normals = None
    if options.normals:
        normals = _join_grids([r.normals for r in results if r.normals is not None], layout.size)
    _write_edges(positions, seams, layout, origin, options.method)
    if layout.is_stitched and normals is not None:
        poles += _write_extra_normals(model, layout, normals)
    if dtype is np.float64:
        # Adding 0.0 turns -0.0 into 0.0, which is better to read in text formats.
        for rows in (positions, normals):
            if rows is not None:
                np.add(rows, 0.0, out=rows)
    channels: tuple[ChannelRows, ...] = ()
    if options.uvs or model.batches[0].channels:
        channels = sample_channels(model, layout, dtype, options.uvs)
    return SampleRows(positions, normals, channels, poles)


def _join_grids(grids: list[RealArray], size: int) -> RealArray:
    """Grids (m, Ru+1, Rv+1, d) as one array of `size` rows; rows after the grids are zero."""
    rows = [grid.reshape(-1, grid.shape[-1]) for grid in grids]
    extras = size - sum(map(len, rows))
    if len(rows) == 1 and not extras:
        return rows[0]
    return np.concatenate([*rows, np.zeros((extras, rows[0].shape[1]), rows[0].dtype)])


def _write_edges(
    positions: RealArray, seams: Seams, layout: Layout, origin: FloatArray, method: Method
) -> None:
    """Writes the samples of each edge to its sides, and control points to corners."""
    # `BorderWrites` describes the table.
    writes = layout.border_writes
    points = [
        sample_edges(seams.curves, is_chosen, divisions, method).reshape(-1, 3)
        for divisions, is_chosen in writes.groups
    ]
    points.append(seams.corner_points)
    table = np.empty((sum(map(len, points)), 3), positions.dtype)
    shift, begin = origin if is_moved(origin) else 0.0, 0
    for part in points:
        np.subtract(part, shift, out=table[begin : begin + len(part)], casting="same_kind")
        begin += len(part)
    rows = table.take(writes.sources, axis=0)
    _view_items(positions)[writes.targets] = _view_items(rows)


def _write_extra_normals(model: PatchModel, layout: Layout, normals: RealArray) -> int:
    """Writes the normals of the extra samples of stitched sides; returns how many are limits.

    A normal is a limit where du × dv vanishes.
    """
    total_limits = 0
    for block in layout.blocks:
        batch = model.batches[block.batch]
        if not isinstance(batch, TensorPatches):
            continue  # triangles have no extra samples
        for side, patches, along, samples in layout.iterate_extras(block):
            across = np.full(len(along), float(side % 2))
            u, v = (across, along) if side < 2 else (along, across)
            normals[samples], limit_count = unit_normals(batch, patches, u, v)
            total_limits += limit_count
    return total_limits
