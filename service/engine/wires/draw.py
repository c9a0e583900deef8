"""Adds isoparametric curves to a mesh, as lines, tubes or ribbons, with or without its faces."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.extent import choose_origin, find_stored_bounds
from service.engine.mesh.mesh import Mesh, MeshReport, Overlay
from service.engine.mesh.overlays import draw_overlays, draw_polylines
from service.engine.options import MeshOptions
from service.engine.scenes.merge import merge_meshes
from service.engine.scenes.scene import round_to_single
from service.engine.scratch import Real
from service.engine.stored_positions import round_to_grid
from service.engine.sweeps.profiles import build_ribbons, build_tubes
from service.engine.sweeps.rows import join_grids
from service.engine.sweeps.sweep import build_swept_mesh
from service.engine.wires.isocurves import IsoCurves
from service.engine.wires.wire_paths import build_wire_paths
from service.surface.lowered import Color, PatchModel

NAME = "isocurves"
"""The name of the part or overlay with the curves."""

RELATIVE_WIDTH = 1 / 300
"""The default width of a wire, as a fraction of the diagonal of the box of control points."""

RELATIVE_LIFT = 1 / 20
"""The distance of ribbons from the faces, in units of their width. Without it, faces and ribbons
have the same depth, and a renderer shows parts of both."""

COLOR: Color = (0.93, 0.54, 0.25, 1.0)
"""The colour of tubes and ribbons."""


def draw_without_faces(
    model: PatchModel, options: MeshOptions, *, is_float32: bool = False
) -> Mesh:
    """A mesh that has the overlays of a model, and no faces."""
    origin = choose_origin(*model.bounds) if is_float32 else np.zeros(3)
    dtype: Real = np.float32 if is_float32 else np.float64
    return build_line_mesh(
        model, options, draw_overlays(model, options, origin, dtype), origin, dtype
    )


def build_line_mesh(
    model: PatchModel,
    options: MeshOptions,
    overlays: tuple[Overlay, ...],
    origin: FloatArray,
    dtype: Real,
) -> Mesh:
    """A mesh without faces, from overlays of this dtype and relative to this origin."""
    no_vertices = np.empty((0, 3), dtype)
    low, high = (bound.tolist() for bound in model.bounds)
    mesh = Mesh(
        name=model.name,
        positions=no_vertices,
        normals=no_vertices if options.normals else None,
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
            bounds_min=(low[0], low[1], low[2]),
            bounds_max=(high[0], high[1], high[2]),
            watertight=False,
            boundary_edges=0,
            poles_repaired=0,
            merged_knots=model.merged_knots,
            moved=model.moved,
        ),
    )
    return _bound_lines(mesh)


def add_wires(
    mesh: Mesh, model: PatchModel, options: MeshOptions, curves: Sequence[IsoCurves]
) -> Mesh:
    """The mesh with isoparametric curves of the model, in the form that the options name."""
    if options.has_solid_wires:
        return _add_solids(mesh, model, options, curves)
    lines = line_overlay(curves)
    # From model coordinates to the origin, grid and precision of the mesh.
    positions = lines.positions.astype(np.float64)
    if mesh.step:
        positions = round_to_grid(positions, mesh.step)
    stored = (positions - mesh.origin).astype(mesh.positions.dtype)
    mesh = replace(mesh, overlays=(*mesh.overlays, replace(lines, positions=stored)))
    return mesh if len(mesh.positions) else _bound_lines(mesh)


def _add_solids(
    mesh: Mesh, model: PatchModel, options: MeshOptions, curves: Sequence[IsoCurves]
) -> Mesh:
    """The mesh with one more part: tubes or ribbons along the isoparametric curves.

    Ribbons face in the direction of the surface's normals; on an edge, of the normals of one of its
    patches. Ribbons lie on the surface; if the faces of the surface are drawn, too, ribbons lie a
    little above them.
    """
    width = find_width(model, options)
    swept = [
        build_tubes(run.paths, width / 2, options.wire_sides, faces=options.faces)
        if options.wires == "tubes"
        else build_ribbons(
            run.lift(width * RELATIVE_LIFT if options.has_faces else 0.0),
            width,
            facing=run.normals,
            faces=options.faces,
        )
        for run in build_wire_paths(model, curves, options.crease_angle)
    ]
    if not swept:
        return mesh
    solid_options = replace(options, overlays=(), isocurves=(0, 0), has_faces=True)
    wires = build_swept_mesh(NAME, join_grids(swept), solid_options, up=model.up)
    if mesh.positions.dtype == np.float32:
        wires = round_to_single(wires, mesh.origin, mesh.step)
    (part,) = wires.parts
    # Meshes can be merged only if they have the same attributes: those of wires are 0.
    attributes = tuple(
        (name, np.zeros((len(wires.positions), rows.shape[1]), rows.dtype))
        for name, rows in mesh.attributes
    )
    wires = replace(wires, parts=(replace(part, color=COLOR),), attributes=attributes)
    if mesh.colors is not None:
        # If the mesh has colours, vertices of wires need them too, in place of a base colour.
        color = np.array(COLOR[: mesh.colors.shape[1]], mesh.colors.dtype)
        wires = replace(wires, parts=(part,), colors=np.tile(color, (len(wires.positions), 1)))
    if not options.has_faces:
        report = replace(wires.report, patches=model.patch_count)
        return replace(wires, name=mesh.name, overlays=mesh.overlays, report=report)
    merged = merge_meshes([mesh, wires], mesh.name)
    # The deviation is bounded for the surface alone: wires have no exact shape to deviate from.
    report = replace(
        merged.report,
        closure=mesh.report.closure,
        deviation_bound=mesh.report.deviation_bound,
        mesh_deviation_bound=mesh.report.mesh_deviation_bound,
        normal_angle=mesh.report.normal_angle,
        curvature=mesh.report.curvature,
        merged_knots=mesh.report.merged_knots,
        moved=mesh.report.moved,
    )
    return replace(merged, report=report)


def find_width(model: PatchModel, options: MeshOptions) -> float:
    """The width of tubes or ribbons, in model units."""
    if options.wire_width is not None:
        return options.wire_width
    low, high = model.bounds
    return RELATIVE_WIDTH * float(np.linalg.norm(high - low))


def bound_solid_counts(curves: int, samples: int, options: MeshOptions) -> tuple[int, int, int]:
    """Upper bounds of the vertices, triangles and quads of tubes or ribbons.

    There are `curves` curves with together `samples` samples.
    """
    # Where two curves are joined, a path has at most two frames, as they have samples there. A
    # tube has two caps, each with two rows of samples and one row of triangles.
    if options.wires == "ribbons":
        return 2 * samples, 2 * samples, samples
    ring_samples = options.wire_sides + 1
    return (
        (samples + 4 * curves) * ring_samples,
        2 * (samples + curves) * ring_samples,
        samples * ring_samples,
    )


def line_overlay(curves: Sequence[IsoCurves]) -> Overlay:
    """Every curve as a polyline through its samples; float64, in model coordinates."""
    return draw_polylines(NAME, (run.points for run in curves), np.float64)


def _bound_lines(mesh: Mesh) -> Mesh:
    """A mesh without vertices, with the bounds of its lines in its report, if it has lines."""
    lines = [overlay.positions for overlay in mesh.overlays if len(overlay.positions)]
    if not lines:
        return mesh
    low, high = find_stored_bounds(np.concatenate(lines), mesh.origin)
    return replace(mesh, report=replace(mesh.report, bounds_min=low, bounds_max=high))
