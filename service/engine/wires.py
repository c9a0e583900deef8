"""Isoparametric curves as something to look at, beside the faces of a mesh or instead of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.extent import extent, local_origin
from service.engine.isocurves import IsoCurves, isocurves
from service.engine.mesh import Mesh, MeshReport, Overlay
from service.engine.options import MeshOptions
from service.engine.scratch import Real
from service.engine.tessellate import overlays_of
from service.surface.lowered import PatchModel

NAME = "isocurves"


def without_faces(model: PatchModel, options: MeshOptions, *, single: bool = False) -> Mesh:
    """What is left of the mesh of a model without its surface: its overlays."""
    origin = local_origin(*model.bounds) if single else np.zeros(3)
    dtype: Real = np.float32 if single else np.float64
    overlays = tuple(
        replace(overlay, positions=(overlay.positions - origin).astype(dtype))
        for overlay in overlays_of(model, options)
    )
    nothing = np.empty((0, 3), dtype)
    low, high = _bounds(overlays, origin, model.bounds)
    return Mesh(
        name=model.name,
        positions=nothing,
        normals=nothing if options.normals else None,
        uvs=None,
        triangles=np.empty((0, 3), np.uint32),
        quads=np.empty((0, 4), np.uint32),
        parts=(),
        grids=(),
        welds=None,
        overlays=overlays,
        origin=origin,
        up=model.up,
        report=MeshReport(
            vertices=0,
            triangles=0,
            quads=0,
            patches=model.patch_count,
            bounds_min=low,
            bounds_max=high,
            watertight=False,
            boundary_edges=0,
            poles_repaired=0,
        ),
    )


def with_lines(mesh: Mesh, model: PatchModel, options: MeshOptions) -> Mesh:
    """The mesh with the isoparametric curves as one more overlay."""
    dtype: Real = mesh.positions.dtype.type
    lines = line_overlay(isocurves(model, options.resolution, options.isocurves))
    lines = replace(lines, positions=(lines.positions - mesh.origin).astype(dtype))
    mesh = replace(mesh, overlays=(*mesh.overlays, lines))
    if len(mesh.positions):
        return mesh
    low, high = _bounds(mesh.overlays, mesh.origin, model.bounds)
    return replace(mesh, report=replace(mesh.report, bounds_min=low, bounds_max=high))


def line_overlay(curves: Sequence[IsoCurves]) -> Overlay:
    """Every curve as a line through its samples; float64, in model coordinates."""
    positions = [np.empty((0, 3))]
    segments = [np.empty((0, 2), np.uint32)]
    first = 0
    for run in curves:
        count, samples, _ = run.points.shape
        index = first + np.arange(count * samples, dtype=np.uint32).reshape(count, samples)
        segments.append(np.stack([index[:, :-1], index[:, 1:]], axis=-1).reshape(-1, 2))
        positions.append(run.points.reshape(-1, 3))
        first += count * samples
    return Overlay(NAME, np.concatenate(positions), np.concatenate(segments))


def _bounds(
    overlays: Sequence[Overlay], origin: FloatArray, otherwise: tuple[FloatArray, FloatArray]
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Bounds of the lines, or of what they belong to where there are none."""
    found = [extent(overlay.positions) for overlay in overlays if len(overlay.positions)]
    low, high = otherwise
    if found:
        low = np.min([low for low, _ in found], axis=0).astype(np.float64) + origin
        high = np.max([high for _, high in found], axis=0).astype(np.float64) + origin
    least, greatest = low.tolist(), high.tolist()
    return (least[0], least[1], least[2]), (greatest[0], greatest[1], greatest[2])
