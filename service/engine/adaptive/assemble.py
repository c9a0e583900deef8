"""A mesh from a certified triangulation: normals, channels, vertices, parts, lines, report."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import AnyInts, FloatArray, Ints, RealArray
from service.bases.row_batches import unique_values
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.drafts.draft import Triangulation
from service.engine.adaptive.samples import (
    PatchPlaces,
    drop_flat_triangles,
    evaluate_channels,
    evaluate_curvatures,
    find_places,
    find_samples,
)
from service.engine.bounds.faces import Faces
from service.engine.connectivity.closure import Closure
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.extent import find_stored_bounds
from service.engine.mesh.channels import ChannelRows, match_values, split_by_kind
from service.engine.mesh.mesh import (
    Mesh,
    MeshPart,
    MeshReport,
    Overlay,
    find_largest_angle,
    find_ranges,
)
from service.engine.mesh.overlays import draw_control_net
from service.engine.options import MeshOptions
from service.engine.plans.faces import count_borders
from service.engine.plans.patterns import NO_QUADS
from service.engine.plans.vertices import (
    Welding,
    count_positions,
    find_shared_positions,
    merge_samples,
    number_vertices,
)
from service.engine.scratch import Real
from service.engine.stored_positions import Storage, bound_origin_error
from service.surface.lowered import PatchModel


def assemble(
    model: PatchModel,
    faces: Faces,
    triangulation: Triangulation,
    options: MeshOptions,
    overlays: tuple[Overlay, ...],
    *,
    storage: Storage,
    origin: FloatArray,
    closure: Closure | None,
) -> Mesh:
    """The mesh of a model, its triangles part by part.

    Parameters
    ----------
    faces : Faces
        The faces of the model.
    triangulation : Triangulation
        The triangles of all faces.
    overlays : tuple of Overlay
        Lines in addition to the faces, with stored positions.
    origin : ndarray of float64, shape (3,)
        The origin of stored positions, in model coordinates.
    closure : Closure or None
        The result of `find_closure`, for the report.
    """
    dtype, stored = storage.dtype, storage.store_positions(triangulation.positions, origin)
    if not storage.step:  # meshes with positions on a grid keep triangles without area
        triangulation = drop_flat_triangles(triangulation, stored)
    samples, face_of_sample, corners = find_samples(faces, triangulation)
    order, parts = _sort_by_part(
        model, faces.first[triangulation.face[triangulation.triangles[:, 0]]]
    )
    corners, bounds = corners[order], triangulation.bounds[order]
    normals, poles_repaired = None, 0
    angle_matters = options.accuracy is not None and options.accuracy.angle_tolerance is not None
    if options.normals or angle_matters:
        normals, poles_repaired = evaluate_scattered_normals(
            model.batches, samples.patch, samples.u, samples.v
        )
    channels = evaluate_channels(model, samples, dtype, uvs=options.uvs)
    if options.curvatures:
        channels += evaluate_curvatures(model, samples, dtype)
    welding = weld_samples(samples, normals, channels, options)
    triangles = welding.vertex.astype(np.uint32, copy=False)[corners]
    welds = find_shared_positions(welding) if options.weld else None
    boundary, watertight = count_borders((triangles, NO_QUADS), welds)
    positions = stored[samples.vertex[welding.samples]]
    vertex_normals = None if normals is None else normals[welding.samples]
    uvs, colors, attributes = split_by_kind(tuple(c.take(welding.samples) for c in channels))
    low, high = find_stored_bounds(positions, origin)
    origin_error = bound_origin_error(origin, np.array(low), np.array(high))
    return Mesh(
        name=model.name,
        positions=positions,
        normals=store_normals(vertex_normals, options, dtype),
        uvs=uvs,
        triangles=triangles,
        quads=NO_QUADS,
        parts=tuple(
            replace(
                part,
                deviation_bound=_find_largest_bound(bounds[slice(*part.triangles)], origin_error),
            )
            for part in parts
        ),
        grids=(),
        welds=welds,
        overlays=overlays,
        origin=origin,
        up=model.up,
        report=MeshReport(
            vertices=count_positions(len(positions), welds),
            triangles=len(triangles),
            quads=0,
            patches=model.patch_count,
            bounds_min=low,
            bounds_max=high,
            watertight=watertight,
            boundary_edges=boundary,
            poles_repaired=poles_repaired,
            closure=closure,
            deviation_bound=_find_largest_bound(bounds, origin_error),
            curvature=find_ranges(attributes),
            merged_knots=model.merged_knots,
            moved=model.moved,
            mesh_deviation_bound=(
                None
                if triangulation.mesh_bounds is None
                else _find_largest_bound(triangulation.mesh_bounds, origin_error)
            ),
            normal_angle=(
                find_largest_angle(triangles, vertex_normals)
                if angle_matters and vertex_normals is not None
                else None
            ),
        ),
        colors=colors,
        attributes=attributes,
        step=storage.step,
        places=find_places(model, faces, samples, face_of_sample) if options.places else None,
    )


def weld_samples(
    samples: PatchPlaces,
    normals: FloatArray | None,
    channels: tuple[ChannelRows, ...],
    options: MeshOptions,
) -> Welding:
    """Merge samples at one vertex of the triangulation whose normals and channels agree."""
    number = np.arange(len(samples.vertex))
    first = np.zeros(samples.vertex.max(initial=0) + 1, dtype=np.intp)
    first[samples.vertex[::-1]] = number[::-1]
    leader = first[samples.vertex]  # the first sample at the same vertex
    if len(first) == len(number) and (leader == number).all():
        # No two samples share a vertex: each is a vertex of the mesh.
        return Welding(vertex=number, samples=number, welds=number)
    shared: AnyInts = number
    if options.weld and not options.places:
        same_values = match_values(leader, channels) if channels else None
        shared = merge_samples(leader, normals, options.crease_angle, same_values)
    return number_vertices(leader, shared, is_used=None)  # triangles use all samples


def store_normals(
    normals: FloatArray | None, options: MeshOptions, dtype: Real
) -> RealArray | None:
    """The normals of vertices as they are stored; None if the mesh has none."""
    if normals is None or not options.normals:
        return None
    return (normals + 0.0).astype(dtype)  # adding 0.0 turns -0.0 into 0.0


def _sort_by_part(model: PatchModel, patch: Ints) -> tuple[Ints, list[MeshPart]]:
    """An order of triangles in which each part is a run, and the parts.

    `patch` (T,) has a patch of each triangle. All patches of a face belong to one part.
    """
    if model.sequence is not None:  # patch numbers in the order of the parts
        position = np.empty(model.patch_count, dtype=np.intp)
        position[model.sequence] = np.arange(model.patch_count)
        patch = position[patch]
    order = np.argsort(patch, kind="stable")
    first_patches = [part.first for part in model.parts] + [model.patch_count]
    # The number of triangles before each part, and the number of all triangles.
    begins = np.searchsorted(patch[order], first_patches).tolist()
    return order, [
        MeshPart(part.name, triangles=(begins[k], begins[k + 1]), quads=(0, 0))
        for k, part in enumerate(model.parts)
    ]


def _find_largest_bound(bounds: FloatArray, origin_error: float) -> float | None:
    """The largest bound of triangles, plus `origin_error`; None without triangles."""
    return float(bounds.max()) + origin_error if len(bounds) else None


def draw_overlays(
    model: PatchModel, border: Border, options: MeshOptions, storage: Storage, origin: FloatArray
) -> tuple[Overlay, ...]:
    """The overlays of the options, with positions stored as those of the mesh."""
    return tuple(
        _draw_control_net(model, storage, origin)
        if name == "control_net"
        else _draw_sides(border, storage, origin)
        for name in options.overlays
    )


def _draw_control_net(model: PatchModel, storage: Storage, origin: FloatArray) -> Overlay:
    """The control net as lines, with stored positions."""
    if not storage.step:
        return draw_control_net(model, origin, storage.dtype)
    net = draw_control_net(model, np.zeros(3), np.float64)
    return replace(net, positions=storage.store_positions(net.positions.astype(np.float64), origin))


def _draw_sides(border: Border, storage: Storage, origin: FloatArray) -> Overlay:
    """All sides of faces as lines through vertices of the mesh; a shared side occurs once."""
    has_next = np.ones(len(border.at), dtype=bool)
    has_next[border.start[1:] - 1] = False
    begin = has_next.nonzero()[0]
    ends = np.sort(np.stack([border.vertex[begin], border.vertex[begin + 1]], axis=1), axis=1)
    ends = ends[ends[:, 0] != ends[:, 1]]
    # Each segment once, in the order in which they occur first.
    first, _ = unique_values(ends[:, 0] * (len(border.points) + 1) + ends[:, 1])
    used, number = np.unique(ends[np.sort(first)], return_inverse=True)
    segments = number.reshape(-1, 2).astype(np.uint32)
    return Overlay("boundary", storage.store_positions(border.points[used], origin), segments)
