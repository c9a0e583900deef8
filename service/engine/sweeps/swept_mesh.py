"""Makes one mesh from swept grids: welds samples to vertices, and computes the report."""

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.cancellation import checkpoint
from service.engine.extent import choose_origin, find_extent
from service.engine.mesh.mesh_value import Mesh, MeshPart, Overlay
from service.engine.mesh.report import MeshReport
from service.engine.options import MeshOptions
from service.engine.plans.borders import count_borders
from service.engine.plans.weld import Welding, weld
from service.engine.sweeps.rows import SweptGrids
from service.surface.checks import Up


def build_swept_mesh(
    name: str,
    swept: SweptGrids,
    options: MeshOptions,
    *,
    is_float32: bool = False,
    up: Up = "y",
    polygon: FloatArray | None = None,
) -> Mesh:
    """The mesh of tubes or ribbons, one part of this name.

    Parameters
    ----------
    options : MeshOptions
        Only normals, uvs, weld, crease_angle and the overlay of the control net are used; `swept`
        already has the faces.
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    polygon : ndarray of float64, shape (K, 3), optional
        The control polygon of the curve.
    """
    checkpoint()
    normals = swept.normals.copy() if options.normals else None  # `weld` writes means into them
    welding = _weld(swept, normals, options)
    triangles, quads = (
        welding.vertex[rows].astype(np.uint32) for rows in (swept.triangles, swept.quads)
    )
    checkpoint()
    positions = swept.positions[welding.samples]
    origin = np.zeros(3)
    if is_float32:
        origin = choose_origin(positions.min(axis=0), positions.max(axis=0))
    dtype = np.float32 if is_float32 else np.float64
    stored: RealArray = (positions - origin).astype(dtype) if is_float32 else positions
    welds = _welds(welding) if options.weld else None
    checkpoint()
    boundary_edges, watertight = count_borders((triangles, quads), welds)
    low, high = (bound.astype(np.float64) + origin for bound in find_extent(stored))
    overlays: tuple[Overlay, ...] = ()
    if polygon is not None and "control_net" in options.overlays:
        overlays = (_polygon_overlay(polygon, origin, dtype),)
    return Mesh(
        name=name,
        positions=stored,
        normals=None if normals is None else normals[welding.samples].astype(dtype),
        uvs=swept.uvs[welding.samples].astype(dtype) if options.uvs else None,
        triangles=triangles,
        quads=quads,
        parts=(MeshPart(name, (0, len(triangles)), (0, len(quads))),),
        grids=tuple(welding.vertex[grid].astype(np.uint32) for grid in swept.grids),
        welds=welds,
        overlays=overlays,
        origin=origin,
        up=up,
        report=MeshReport(
            vertices=int((welding.welds == np.arange(len(stored))).sum()),
            triangles=len(triangles),
            quads=len(quads),
            patches=0,
            bounds_min=(float(low[0]), float(low[1]), float(low[2])),
            bounds_max=(float(high[0]), float(high[1]), float(high[2])),
            watertight=watertight,
            boundary_edges=boundary_edges,
            poles_repaired=0,
        ),
    )


def _polygon_overlay(
    polygon: FloatArray, origin: FloatArray, dtype: type[np.float32] | type[np.float64]
) -> Overlay:
    """The control polygon of a curve, (K, 3), as an overlay."""
    number = np.arange(len(polygon), dtype=np.uint32)
    segments = np.stack([number[:-1], number[1:]], axis=1)
    return Overlay("control_net", (polygon - origin).astype(dtype), segments)


def _weld(swept: SweptGrids, normals: RealArray | None, options: MeshOptions) -> Welding:
    """Make vertices from samples: one for each sample, or one for each set of welded samples."""
    own_numbers = np.arange(len(swept.same_position))
    if not options.weld:
        return Welding(vertex=own_numbers, samples=own_numbers, welds=own_numbers)
    is_used = np.zeros(len(swept.same_position), dtype=bool)
    is_used[swept.triangles] = True
    is_used[swept.quads] = True
    # With texture coordinates every sample stays a vertex, because those of a seam differ.
    is_merged = not options.uvs
    return weld(
        swept.same_position, np.flatnonzero(is_used), normals, options.crease_angle, is_merged
    )


def _welds(welding: Welding) -> IndexArray | None:
    """For each vertex the first vertex at its position; None if all positions differ."""
    if (welding.welds == np.arange(len(welding.welds))).all():
        return None
    return welding.welds.astype(np.uint32)
