"""A model of Bézier patches into one mesh: samples, shared edges, faces, report.

1. Find which sides of which patches are one edge, and give each edge its divisions.
2. Evaluate the patches; overwrite their borders with the samples of the edges.
3. Weld: samples become vertices.
4. Join the vertices to faces by the pattern of each patch.
"""

from dataclasses import replace

import numpy as np

from service.bases import triangle
from service.bases.arrays import IndexArray, Ints
from service.engine.borders import borders
from service.engine.channels import agreeing, by_kind
from service.engine.closure import closure
from service.engine.curvatures.ranges import ranges
from service.engine.curvatures.rows import layout_curvatures
from service.engine.deviation.bound import deviations, largest, with_bounds
from service.engine.extent import local_origin, stored_bounds
from service.engine.join import join
from service.engine.layout import Layout
from service.engine.mesh import Mesh, MeshReport, Overlay
from service.engine.options import MeshOptions
from service.engine.overlays import draw
from service.engine.patterns import used_samples
from service.engine.sampling import SampleRows, sample
from service.engine.scratch import Real
from service.engine.weld import Welding, count_places, shared_places, weld, without_unused
from service.stopping import checkpoint
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel


def tessellate(model: PatchModel, options: MeshOptions, *, single: bool = False) -> Mesh:
    """The mesh of a model.

    Parameters
    ----------
    model : PatchModel
    options : MeshOptions
    single : bool
        float32 positions about a local origin, for formats that store them so; else float64 in
        model coordinates.
    """
    layout = Layout.plan(model, options.resolution)
    dtype: Real = np.float32 if single else np.float64
    origin = local_origin(*model.bounds) if single else np.zeros(3)
    rows = sample(layout, options, dtype, origin, model.domain)
    if options.curvatures:
        bent = layout_curvatures(model, layout, dtype)
        rows = replace(rows, channels=(*rows.channels, *bent))
    checkpoint()
    bounds = deviations(layout, options, rows, origin, lambda: places(layout))
    checkpoint()
    welding = _weld(layout, rows, options)
    checkpoint()
    triangles, quads, parts = join(model, layout, welding, options.faces)
    if welding is not None:
        if layout.folds and options.weld:
            welding = without_unused(welding, (triangles, quads))
            triangles, quads, parts = join(model, layout, welding, options.faces)
        rows = rows.take(welding.samples)
    checkpoint()
    welds = shared_places(welding) if options.weld else None
    boundary, watertight = borders(layout, options, (triangles, quads), welds)
    checkpoint()
    low, high = stored_bounds(rows.positions, origin)
    uvs, colors, attributes = by_kind(rows.channels)
    return Mesh(
        name=model.name,
        positions=rows.positions,
        normals=rows.normals,
        uvs=uvs,
        triangles=triangles,
        quads=quads,
        parts=with_bounds(model, parts, bounds),
        grids=_grids(layout, welding),
        welds=welds,
        overlays=draw(model, layout, options, origin, dtype),
        origin=origin,
        up=model.up,
        report=MeshReport(
            vertices=count_places(len(rows.positions), welds),
            triangles=len(triangles),
            quads=len(quads),
            patches=model.patch_count,
            bounds_min=low,
            bounds_max=high,
            watertight=watertight,
            boundary_edges=boundary,
            poles_repaired=rows.poles,
            closure=closure(model),
            deviation_bound=largest(bounds),
            curvature=ranges(attributes),
        ),
        colors=colors,
        attributes=attributes,
    )


def overlays_of(model: PatchModel, options: MeshOptions) -> tuple[Overlay, ...]:
    """The overlays alone, in float64 and model coordinates, for a form that has no mesh."""
    if not options.overlays:
        return ()
    layout = Layout.plan(model, options.resolution)
    zero = np.zeros(3)
    return draw(model, layout, options, zero, np.float64)


def predicted_size(model: PatchModel, options: MeshOptions) -> tuple[int, int, int]:
    """Vertices, triangles and quads at most, from shapes and seams; nothing is evaluated.

    Exact for patches that meet nowhere; welding and collapsed sides only take away.
    """
    ru, rv = options.resolution
    triangles = sum(b.count for b in model.batches if isinstance(b, TrianglePatches))
    grids = model.patch_count - triangles
    small = triangles * max(ru, rv) ** 2
    cells, border = grids * ru * rv, 2 * (ru + rv) * grids
    size = grids * (ru + 1) * (rv + 1) + triangles * triangle.size(max(ru, rv))
    framed = False
    if ru != rv:
        layout = Layout.plan(model, options.resolution)
        size, framed = layout.size, layout.framed
        # A framed grid has at least two divisions each way.
        shapes = [(b.resolution, len(b.patches)) for b in layout.blocks if not b.triangular]
        cells = sum(along_u * along_v * count for (along_u, along_v), count in shapes)
        border = sum(2 * (along_u + along_v) * count for (along_u, along_v), count in shapes)
    # A patch of V samples, B of them on its border, is 2V - B - 2 triangles.
    if options.faces == "quads":
        return size, (2 * size if framed else border + small), cells
    return size, (2 * size if framed else 2 * cells + small), 0


def _weld(layout: Layout, rows: SampleRows, options: MeshOptions) -> Welding | None:
    """Vertices from samples; None where every sample is a vertex of its own."""
    if not (layout.framed or (options.weld and layout.shares)):
        return None
    place = places(layout)
    used = _used(layout, options) if layout.framed or layout.pinched.any() else None
    # A position may have several colours or texture coordinates, as it may have several normals.
    alike = agreeing(place, rows.channels) if options.weld and rows.channels else None
    return weld(place, used, rows.normals, options.crease_angle, options.weld, alike=alike)


def places(layout: Layout) -> Ints:
    """For each sample the first one that is the same by construction: edge, corner or pole."""
    place = np.arange(layout.size)
    edge = layout.seams.edge.ravel()
    for divisions, sides in layout.side_groups():
        samples = layout.side_samples(sides, divisions)
        # The first side of every edge stands for all of them.
        _, first, back = np.unique(edge[sides], return_index=True, return_inverse=True)
        place[samples] = samples[first][back]
    corners = layout.corner_samples()
    _, first, back = np.unique(layout.seams.corner, return_index=True, return_inverse=True)
    stand_in = corners.ravel()[first]
    place[corners] = stand_in[back.reshape(corners.shape)]
    samples, corner = layout.collapsed_samples()
    place[samples] = stand_in[corner]
    return place


def _used(layout: Layout, options: MeshOptions) -> Ints:
    """Samples that occur in faces: not those that a frame replaces, nor all those at a pole."""
    samples = [
        layout.patch_samples(patches, shape)[:, used_samples(shape, options.faces)].ravel()
        for shape, patches in layout.shapes()
    ]
    return np.concatenate(samples)


def _grids(layout: Layout, welding: Welding | None) -> tuple[IndexArray, ...]:
    """The vertex at every sample of every patch; nothing where a frame or a triangle is no grid."""
    if layout.framed or layout.triangular.any():
        return ()
    grids = []
    for block in layout.blocks:
        size = block.count * len(block.patches)
        rows = slice(block.base, block.base + size)
        if welding is None:
            vertex = np.arange(rows.start, rows.stop, dtype=np.uint32)
        else:
            vertex = welding.vertex[rows].astype(np.uint32)
        grids.append(vertex.reshape(-1, block.resolution[0] + 1, block.resolution[1] + 1))
    return tuple(grids)
