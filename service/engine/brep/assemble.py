"""A mesh from the triangles of a brep: normals, channels, vertices, parts, lines, report."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints, RealArray
from service.engine.adaptive.assemble import store_normals, weld_samples
from service.engine.adaptive.samples import evaluate_curvatures
from service.engine.bounds.goal import Goal
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.fans import separate_fans
from service.engine.brep.prepared import PreparedBrep
from service.engine.brep.report import build_report, list_bounds
from service.engine.brep.samples import FaceSamples, find_face_samples, merge_stored_points
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.extent import find_stored_bounds
from service.engine.mesh.channels import ChannelRows, split_by_kind
from service.engine.mesh.mesh import (
    Mesh,
    MeshPart,
    MeshReport,
    Overlay,
    find_largest_angle,
    find_ranges,
)
from service.engine.mesh.places import SurfacePlaces
from service.engine.options import MeshOptions
from service.engine.plans.faces import count_borders
from service.engine.plans.patterns import NO_QUADS
from service.engine.plans.vertices import count_positions, find_shared_positions
from service.engine.scratch import Real
from service.engine.stored_positions import Storage, bound_origin_error
from service.engine.vectors import length
from service.surface.lowered import Color, PatchModel

PRIVATE_SEAM = -2
"""`PreparedBrep.edge_sources` of a seam that only one face has: it is no edge of the brep."""


def assemble(
    prepared: PreparedBrep,
    triangulation: BrepTriangulation,
    goal: Goal,
    options: MeshOptions,
    *,
    storage: Storage,
    origin: FloatArray,
) -> Mesh:
    """The mesh of a brep; its parts are the faces, in their order.

    Parameters
    ----------
    prepared : PreparedBrep
    triangulation : BrepTriangulation
    goal : Goal
        The goal of the mesh: its tolerance says whether the mesh reached it, its angle whether
        normals are measured.
    options : MeshOptions
    storage : Storage
    origin : ndarray of float64, shape (3,)
        The origin of stored positions, in model coordinates.
    """
    triangulation, unpaired = separate_fans(triangulation, prepared.model.face_shells)
    dtype, stored = storage.dtype, storage.store_positions(triangulation.positions, origin)
    corner_triangles = triangulation.points[triangulation.triangles]
    leader, stays = merge_stored_points(corner_triangles, stored)
    if storage.step:  # meshes with positions on a grid keep triangles without area
        leader, stays = np.arange(len(stored)), np.ones(len(stays), bool)
    faces = triangulation.faces[stays]
    rows, corners = find_face_samples(
        prepared.places, triangulation, triangulation.triangles[stays]
    )
    samples = replace(rows.samples, vertex=leader[rows.samples.vertex])
    model = replace(prepared.surfaces.model, stretch=prepared.model.stretch)
    normals, poles_repaired, angle_matters = None, 0, np.isfinite(goal.angle)
    if options.normals or angle_matters:
        normals, poles_repaired = evaluate_scattered_normals(
            model.batches, samples.patch, samples.u, samples.v
        )
        normals[prepared.is_reversed[rows.faces]] *= -1.0
    channels = _evaluate_channels(prepared, model, rows, options, dtype)
    welding = weld_samples(samples, normals, channels, options)
    triangles = welding.vertex.astype(np.uint32, copy=False)[corners]
    welds = find_shared_positions(welding)
    positions = stored[samples.vertex[welding.samples]]
    vertex_normals = None if normals is None else normals[welding.samples]
    uvs, colors, attributes = split_by_kind(tuple(c.take(welding.samples) for c in channels))
    # Without faces the edges are drawn; without edges too there is only the origin.
    drawn = positions if len(positions) else stored
    low, high = find_stored_bounds(drawn if len(drawn) else np.zeros((1, 3), dtype), origin)
    moves = storage.restore_positions(triangulation.positions, origin) - triangulation.positions
    error = float(length(moves, -1).max(initial=0.0)) + bound_origin_error(
        origin, np.array(low), np.array(high)
    )
    boundary, watertight = count_borders((triangles, NO_QUADS), welds)
    bounds = list_bounds(triangulation, faces, error)
    report = MeshReport(
        vertices=count_positions(len(positions), welds),
        triangles=len(triangles),
        quads=0,
        patches=model.patch_count,
        bounds_min=low,
        bounds_max=high,
        watertight=watertight and bool(len(triangles)),
        boundary_edges=boundary,
        poles_repaired=poles_repaired,
        curvature=find_ranges(attributes),
        normal_angle=(
            find_largest_angle(triangles, vertex_normals)
            if angle_matters and vertex_normals is not None
            else None
        ),
    )
    mesh = Mesh(
        name=prepared.model.name,
        positions=positions,
        normals=store_normals(vertex_normals, options, dtype),
        uvs=uvs,
        triangles=triangles,
        quads=NO_QUADS,
        parts=_build_parts(prepared, faces, bounds),
        grids=(),
        welds=welds,
        overlays=((_draw_edges(prepared, triangulation, stored),) if options.overlays else ()),
        origin=origin,
        up=prepared.model.up,
        report=build_report(
            prepared,
            triangulation,
            report,
            goal,
            faces=faces,
            unpaired=unpaired,
            error=error,
        ),
        colors=colors,
        attributes=attributes,
        step=storage.step,
        places=(
            SurfacePlaces(model, prepared.places, rows.faces, rows.places.astype(np.float64))
            if options.places
            else None
        ),
    )
    return mesh if options.has_faces else _remove_faces(mesh)


def _remove_faces(mesh: Mesh) -> Mesh:
    """The mesh with its lines alone; the report has neither counts of faces nor their bounds."""
    (overlay,) = mesh.overlays  # a mesh without faces has lines
    low, high = mesh.report.bounds_min, mesh.report.bounds_max
    if len(overlay.positions):
        low, high = find_stored_bounds(overlay.positions, mesh.origin)
    nothing = mesh.positions[:0]
    return replace(
        mesh,
        positions=nothing,
        normals=None if mesh.normals is None else nothing,
        uvs=None,
        attributes=(),
        triangles=mesh.triangles[:0],
        parts=(),
        welds=None,
        report=replace(
            mesh.report,
            vertices=0,
            triangles=0,
            bounds_min=low,
            bounds_max=high,
            watertight=False,
            boundary_edges=0,
            poles_repaired=0,
            deviation_bound=None,
            mesh_deviation_bound=None,
            normal_angle=None,
            curvature=None,
        ),
    )


def _evaluate_channels(
    prepared: PreparedBrep, model: PatchModel, rows: FaceSamples, options: MeshOptions, dtype: Real
) -> tuple[ChannelRows, ...]:
    """The parameters of the faces' surfaces, and curvatures, if the options ask for them.

    The mean curvature of a reversed face has the opposite sign, as its normal.
    """
    channels: tuple[ChannelRows, ...] = ()
    if options.uvs:
        parameters: RealArray = (
            prepared.places.to_parameters(rows.faces, rows.places) + 0.0
        ).astype(dtype)
        channels = (ChannelRows("uvs", "uvs", parameters, is_exact=True),)
    if options.curvatures:
        gaussian, mean = evaluate_curvatures(model, rows.samples, dtype)
        values = mean.values.copy()
        values[prepared.is_reversed[rows.faces]] *= -1.0
        channels += gaussian, replace(mean, values=values + dtype(0.0))
    return channels


def _build_parts(
    prepared: PreparedBrep, faces: Ints, bounds: list[float | None]
) -> tuple[MeshPart, ...]:
    """A part for each face of the brep; `faces` (T,) are those of the triangles, ascending."""
    model = prepared.model
    ends = np.searchsorted(faces, np.arange(model.face_count + 1)).tolist()
    palette: list[Color] = [(r, g, b, a) for r, g, b, a in model.palette.tolist()]
    colors = [None if k < 0 else palette[k] for k in model.face_colors.tolist()]
    return tuple(
        MeshPart(
            name or f"face {number}",
            triangles=(ends[number], ends[number + 1]),
            quads=(0, 0),
            color=color,
            deviation_bound=bound,
        )
        for number, (name, color, bound) in enumerate(
            zip(model.face_names, colors, bounds, strict=True)
        )
    )


def _draw_edges(
    prepared: PreparedBrep, triangulation: BrepTriangulation, stored: RealArray
) -> Overlay:
    """All edges as lines through the vertices of the mesh; `stored` (N, 3) are stored positions."""
    points, starts = triangulation.edge_points, triangulation.edge_starts
    has_next = np.ones(len(points), dtype=bool)
    has_next[starts[1:][np.diff(starts) > 0] - 1] = False  # the last sample of each edge
    edges = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    is_drawn: Bools = has_next & (prepared.edge_sources[edges] != PRIVATE_SEAM)
    begin = np.flatnonzero(is_drawn)
    ends = np.stack([points[begin], points[begin + 1]], axis=1)
    ends = ends[ends[:, 0] != ends[:, 1]]  # poles and collapsed edges are points
    used, number = np.unique(ends, return_inverse=True)
    segments: IndexArray = number.reshape(-1, 2).astype(np.uint32)
    return Overlay("boundary", stored[used], segments)
