"""Isoparametric curves as something to look at, beside the faces of a mesh or instead of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.engine.extent import extent, local_origin
from service.engine.grid import on_grid
from service.engine.mesh.mesh_value import Mesh, Overlay
from service.engine.mesh.report import MeshReport
from service.engine.options import MeshOptions
from service.engine.scenes.merge import merged
from service.engine.scenes.scene import in_single, within
from service.engine.scratch import Real
from service.engine.sweeps.profiles import ribbons, tubes
from service.engine.sweeps.rows import Swept
from service.engine.sweeps.swept_mesh import swept_mesh
from service.engine.tessellate import overlays_of
from service.engine.wires.isocurves import IsoCurves
from service.engine.wires.paths import wire_paths
from service.surface.lowered import Color, PatchModel

NAME = "isocurves"

SHARE = 1 / 300
"""Width of a wire where none is told, in units of the diagonal of the control points' bounds."""

LIFT = 1 / 20
"""How far above the faces ribbons lie, in units of their width: in one place with them, now these
and now those would be seen."""

COLOR: Color = (0.93, 0.54, 0.25, 1.0)
"""Of wires that have faces; lines look the same."""


def without_faces(model: PatchModel, options: MeshOptions, *, single: bool = False) -> Mesh:
    """What is left of the mesh of a model without its surface: its overlays."""
    origin = local_origin(*model.bounds) if single else np.zeros(3)
    dtype: Real = np.float32 if single else np.float64
    overlays = tuple(
        replace(overlay, positions=(overlay.positions - origin).astype(dtype))
        for overlay in overlays_of(model, options)
    )
    return only_lines(model, options, overlays, origin, dtype)


def only_lines(
    model: PatchModel,
    options: MeshOptions,
    overlays: tuple[Overlay, ...],
    origin: FloatArray,
    dtype: Real,
) -> Mesh:
    """A mesh without faces, of overlays as they are stored."""
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
            merged_knots=model.merged_knots,
            moved=model.moved,
        ),
    )


def with_wires(
    mesh: Mesh, model: PatchModel, options: MeshOptions, curves: Sequence[IsoCurves]
) -> Mesh:
    """The mesh with isoparametric curves of the model, in the form that the options ask for."""
    if options.solid_wires:
        return _with_solids(mesh, model, options, curves)
    lines = line_overlay(curves)
    lines = replace(lines, positions=_written(lines.positions, mesh))
    mesh = replace(mesh, overlays=(*mesh.overlays, lines))
    if len(mesh.positions):
        return mesh
    low, high = _bounds(mesh.overlays, mesh.origin, model.bounds)
    return replace(mesh, report=replace(mesh.report, bounds_min=low, bounds_max=high))


def _written(positions: RealArray, mesh: Mesh) -> RealArray:
    """Positions in model coordinates as those of a mesh are stored."""
    if mesh.step:
        positions = on_grid(positions.astype(np.float64), mesh.step)
    written: RealArray = (positions - mesh.origin).astype(mesh.positions.dtype)
    return written


def _with_solids(
    mesh: Mesh, model: PatchModel, options: MeshOptions, curves: Sequence[IsoCurves]
) -> Mesh:
    """The mesh with tubes or ribbons along the isoparametric curves as one more part.

    Their width is the option's. Ribbons lie on the surface: they face along its normals, those of
    one of the patches where two meet; a little above it where its faces are drawn, too.
    """
    width = width_of(model, options)
    swept = [
        tubes(wires.paths, width / 2, options.wire_sides, faces=options.faces)
        if options.wires == "tubes"
        else ribbons(
            wires.lifted(width * LIFT if options.surface else 0.0),
            width,
            facing=wires.normals,
            faces=options.faces,
        )
        for wires in wire_paths(model, curves, options.crease_angle)
    ]
    if not swept:
        return mesh
    plain = replace(options, overlays=(), isocurves=(0, 0), surface=True)
    wires = swept_mesh(NAME, _together(swept), plain, up=model.up)
    positions = _written(wires.positions, mesh)
    if positions.dtype == np.float32:
        wires = in_single(wires, mesh.origin)
    if mesh.step:
        low, high = (bound.astype(np.float64) + mesh.origin for bound in extent(positions))
        report = within(wires.report, low, high)
        wires = replace(wires, positions=positions, report=report, step=mesh.step)
    (part,) = wires.parts
    zeros = ((name, np.zeros((len(wires.positions), rows.shape[1]), rows.dtype))
             for name, rows in mesh.attributes)  # fmt: skip
    wires = replace(wires, parts=(replace(part, color=COLOR),), attributes=tuple(zeros))
    if mesh.colors is not None:
        # A base colour would multiply white.
        color = np.array(COLOR[: mesh.colors.shape[1]], mesh.colors.dtype)
        wires = replace(wires, parts=(part,), colors=np.tile(color, (len(wires.positions), 1)))
    if not options.surface:
        report = replace(wires.report, patches=model.patch_count)
        return replace(wires, name=mesh.name, overlays=mesh.overlays, report=report)
    together = merged([mesh, wires], mesh.name)
    known = mesh.report
    report = replace(
        together.report,
        closure=known.closure,
        # Those of the surface: wires are what they are.
        deviation_bound=known.deviation_bound,
        mesh_deviation_bound=known.mesh_deviation_bound,
        normal_angle=known.normal_angle,
        curvature=known.curvature,
        merged_knots=known.merged_knots,
        moved=known.moved,
    )
    return replace(together, report=report)


def width_of(model: PatchModel, options: MeshOptions) -> float:
    """The width of wires that have faces."""
    if options.wire_width is not None:
        return options.wire_width
    low, high = model.bounds
    return SHARE * float(np.linalg.norm(high - low))


def most_solids(curves: int, samples: int, options: MeshOptions) -> tuple[int, int, int]:
    """Vertices, triangles and quads at most of so many curves with so many samples in all."""
    # At the joint of two curves stand as many stations as before: the last one and the first one.
    if options.wires == "ribbons":
        return 2 * samples, 2 * samples, samples
    around = options.wire_sides + 1
    return (
        (samples + 4 * curves) * around,
        2 * (samples + curves) * around,
        samples * around,
    )


def _together(swept: Sequence[Swept]) -> Swept:
    """Everything that was swept, one after another."""
    first = np.cumsum([0, *(len(one.positions) for one in swept)])[:-1]
    return Swept(
        positions=np.concatenate([one.positions for one in swept]),
        normals=np.concatenate([one.normals for one in swept]),
        uvs=np.concatenate([one.uvs for one in swept]),
        place=np.concatenate([one.place + k for one, k in zip(swept, first, strict=True)]),
        triangles=_counted([one.triangles for one in swept], first),
        quads=_counted([one.quads for one in swept], first),
        grids=tuple(
            grid + np.uint32(k) for one, k in zip(swept, first, strict=True) for grid in one.grids
        ),
    )


def _counted(faces: Sequence[IndexArray], first: Ints) -> IndexArray:
    return np.concatenate([rows + np.uint32(k) for rows, k in zip(faces, first, strict=True)])


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
