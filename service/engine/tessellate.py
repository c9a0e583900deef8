"""Makes one mesh from a model of Bézier patches: samples, shared edges, faces, report.

1. Find which sides of which patches are one edge, and give each edge its divisions.
2. Evaluate the patches; overwrite their borders with the samples of the edges.
3. Weld: samples become vertices.
4. Make faces of the vertices by the index pattern of each patch.
"""

from dataclasses import replace

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.engine.bounds.mesh_deviation import bound_deviations, bound_parts, find_largest_bound
from service.engine.connectivity.closure import OPEN, find_closure
from service.engine.connectivity.connect import connect, connect_if_apart, may_be_cut
from service.engine.connectivity.curve_patches import leave_out_curves
from service.engine.connectivity.incidence import hash_arrays
from service.engine.curvatures.rows import layout_curvatures
from service.engine.extent import AT_ZERO, choose_origin, find_stored_bounds
from service.engine.joining.join import Allow, allow_any, join, join_further
from service.engine.mesh.channels import match_values, split_by_kind
from service.engine.mesh.filling import SampleRows, fill_vertices, sample_model
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, find_ranges
from service.engine.mesh.overlays import draw_overlays
from service.engine.options import MeshOptions
from service.engine.plans.face_plan import FacePlan, plan_faces
from service.engine.plans.layout import Layout
from service.engine.plans.vertices import Sharing, find_creases, merge_samples
from service.engine.scratch import Real
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel


def tessellate(
    model: PatchModel, options: MeshOptions, *, is_float32: bool = False, allow: Allow = allow_any
) -> Mesh:
    """The mesh of a model.

    Parameters
    ----------
    model : PatchModel
    options : MeshOptions
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    allow : callable
        Called with a model that was cut for joining; it raises an error if the model is too large.
    """
    # Joining is slow, so it is skipped if it is certain that it would change nothing.
    seams = connect_if_apart(model, options.weld_tolerance)
    if seams is None or may_be_cut(model, seams):
        model, seams = join_further(model, seams, options.weld_tolerance, allow)
    # A surface without any shared edge is open; `find_closure` need not compare its borders.
    # Without a domain, the patches are not one surface, and `find_closure` returns None.
    may_close = seams.connectivity.is_joined or model.domain is None
    closure = find_closure(model, seams.connectivity) if may_close else OPEN
    if seams.connectivity.has_thin:  # some patches may be curves
        model = leave_out_curves(model, seams.connectivity)
        seams = connect(model)
    layout = Layout.plan(seams.connectivity, options.resolution)
    dtype: Real = np.float32 if is_float32 else np.float64
    origin = choose_origin(*model.bounds) if is_float32 else AT_ZERO
    rows = sample_model(model, seams, layout, options, dtype=dtype, origin=origin)
    if options.curvatures:
        curvatures = layout_curvatures(model, layout, dtype)
        rows = replace(rows, channels=(*rows.channels, *curvatures))
    checkpoint()
    bounds = bound_deviations(model, seams, layout, options, rows, origin=origin)
    del seams  # the curves of all edges: their memory serves for the faces
    checkpoint()
    plan = plan_faces(layout, options, _find_sharing(layout, rows, options), model.sequence)
    rows = fill_vertices(rows, plan)
    bound = find_largest_bound(bounds)
    low, high = find_stored_bounds(rows.positions, origin)
    uvs, colors, attributes = split_by_kind(rows.channels) if rows.channels else (None, None, ())
    return Mesh(
        name=model.name,
        positions=rows.positions,
        normals=rows.normals,
        uvs=uvs,
        triangles=plan.triangles,
        quads=plan.quads,
        parts=_build_parts(model, plan, bounds, bound),
        grids=plan.grids,
        welds=plan.welds,
        overlays=draw_overlays(model, options, origin, dtype) if options.overlays else (),
        origin=origin,
        up=model.up,
        report=MeshReport(
            vertices=plan.position_count,
            triangles=len(plan.triangles),
            quads=len(plan.quads),
            patches=model.patch_count,
            bounds_min=low,
            bounds_max=high,
            watertight=plan.watertight,
            boundary_edges=plan.boundary_edges,
            poles_repaired=rows.poles,
            closure=closure,
            deviation_bound=bound,
            curvature=find_ranges(attributes) if attributes else None,
            merged_knots=model.merged_knots,
            moved=model.moved,
        ),
        colors=colors,
        attributes=attributes,
    )


def predict_size(model: PatchModel, options: MeshOptions) -> tuple[int, int, int]:
    """Upper bounds of vertices, triangles and quads, from shapes and seams, without evaluation.

    For patches that do not meet, the bounds are exact, except for triangles beside quads. Welding
    and collapsed sides only reduce the numbers.
    """
    ru, rv = options.resolution
    triangle_patches = sum(b.count for b in model.batches if isinstance(b, TrianglePatches))
    tensor_patches = model.patch_count - triangle_patches
    triangle_faces = triangle_patches * max(ru, rv) ** 2
    cells, border = tensor_patches * ru * rv, 2 * (ru + rv) * tensor_patches
    size = tensor_patches * (ru + 1) * (rv + 1) + triangle_patches * triangle.count_points(
        max(ru, rv)
    )
    is_stitched = False
    if ru != rv:  # else no patch is stitched, because all edges have the same divisions
        _, seams = join(model, options.weld_tolerance)
        layout = Layout.plan(seams.connectivity, options.resolution)
        size, is_stitched = layout.size, layout.is_stitched
        # A stitched patch has at least two divisions in each direction, also if ru or rv is 1.
        shapes = [(b.resolution, len(b.patches)) for b in layout.blocks if not b.is_triangle]
        cells = sum(along_u * along_v * count for (along_u, along_v), count in shapes)
        border = sum(2 * (along_u + along_v) * count for (along_u, along_v), count in shapes)
    # A stitched patch of V samples, B of them on its border, has 2V − B − 2 triangles, fewer than
    # 2V.
    if options.faces == "quads":
        # Quads at collapsed sides become triangles: at most one for each division of a border.
        return size, (2 * size if is_stitched else border + triangle_faces), cells
    return size, (2 * size if is_stitched else 2 * cells + triangle_faces), 0


def _find_sharing(layout: Layout, rows: SampleRows, options: MeshOptions) -> Sharing | None:
    """Which samples at one position share a vertex; None if all of them do, or without welding.

    Samples at one position may have different normals, colours or texture coordinates, and then
    stay separate. If the mesh has channels, this function also replaces nearly equal normals at a
    position by their mean, in `rows.normals`.
    """
    if not (options.weld and layout.has_shared_samples):
        return None
    if rows.channels:
        leaders_at_position = layout.find_leaders()
        same_values = match_values(leaders_at_position, rows.channels)
        leader = merge_samples(leaders_at_position, rows.normals, options.crease_angle, same_values)
        leaders = leader.take(layout.averages.members)  # only samples that share a position
        return Sharing(leaders, hash_arrays(leaders), is_averaged=True)
    if rows.normals is None:
        return None
    return find_creases(rows.normals, layout.averages, options.crease_angle)


def _build_parts(
    model: PatchModel, plan: FacePlan, patch_bounds: FloatArray, mesh_bound: float | None
) -> tuple[MeshPart, ...]:
    """The parts of a mesh: runs of its faces, each with a bound of its deviation.

    The arguments are the bounds of the deviation of each patch, (P,), and of the whole mesh.
    """
    if len(model.parts) == 1:
        all_faces = (0, len(plan.triangles)), (0, len(plan.quads))
        return (MeshPart(model.parts[0].name, *all_faces, deviation_bound=mesh_bound),)
    # The number of triangles, and of quads, before each patch.
    triangles, quads = plan.ends.tolist()
    return tuple(
        MeshPart(
            part.name,
            (triangles[part.first], triangles[part.last]),
            (quads[part.first], quads[part.last]),
            deviation_bound=part_bound,
        )
        for part, part_bound in zip(model.parts, bound_parts(model, patch_bounds), strict=True)
    )
