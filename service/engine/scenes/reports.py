"""The report on a scene: sums over all copies, each placed, without placing whole meshes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.engine.mesh.brep_report import add_brep_reports
from service.engine.mesh.mesh import Mesh, MeshReport, find_largest_angle, merge_ranges
from service.engine.scenes.copies import (
    Placements,
    batch_copies,
    bound_placing_errors,
    find_distance,
    find_extents,
    list_copies,
    stack_placements,
)
from service.engine.scenes.placing import place_normals, place_points
from service.surface.lowered import PlacedModel

_SUMS = ("vertices", "triangles", "quads", "patches", "boundary_edges", "poles_repaired",
         "merged_knots")  # fmt: skip
"""Fields of a report that are sums over copies."""


def find_spreads(
    meshes: Sequence[Mesh], copies: Sequence[PlacedModel], placements: Placements
) -> tuple[FloatArray, FloatArray]:
    """The factors and errors of all copies, (N,) each.

    The first is the largest factor by which placing multiplies distances, the second the rounding
    error that it adds.
    """
    distances = [
        find_distance(np.array(mesh.report.bounds_min), np.array(mesh.report.bounds_max))
        for mesh in meshes
    ]
    return placements.most, bound_placing_errors(copies, placements, distances)


def report_copies(meshes: Sequence[Mesh], copies: Sequence[PlacedModel]) -> MeshReport:
    """The report on all copies of meshes together; it is watertight if each mesh is.

    Bounds of the deviation of a copy are those of its mesh times the stretch of its placement, plus
    the rounding of placing. Skipped faces of breps are listed once for each mesh.
    """
    placements = stack_placements(copies)
    stretches, errors = find_spreads(meshes, copies, placements)
    numbers = list_copies(copies, len(meshes))
    low, high = _find_bounds(meshes, numbers, placements)
    used = [(mesh.report, rows) for mesh, rows in zip(meshes, numbers, strict=True) if len(rows)]
    first = meshes[copies[0].model].report
    sums = {name: sum(getattr(report, name) * len(rows) for report, rows in used) for name in _SUMS}
    breps = []
    for report, rows in used:
        if report.brep is not None:
            breps.append((report.brep.scale(float(stretches[rows].max())), len(rows)))
    return replace(
        first,
        **sums,
        bounds_min=(low[0], low[1], low[2]),
        bounds_max=(high[0], high[1], high[2]),
        watertight=all(report.watertight for report, _ in used),
        closure=first.closure if len(copies) == 1 else None,
        deviation_bound=_find_largest("deviation_bound", used, stretches, errors),
        mesh_deviation_bound=_find_largest("mesh_deviation_bound", used, stretches, errors),
        normal_angle=_find_angle(meshes, copies, numbers),
        curvature=merge_ranges([report.curvature for report, _ in used]),
        moved=max(report.moved * float(stretches[rows].max()) for report, rows in used),
        brep=add_brep_reports(breps),
    )


def _find_bounds(
    meshes: Sequence[Mesh], numbers: Sequence[Ints], placements: Placements
) -> tuple[list[float], list[float]]:
    """Least and greatest coordinates of all copies."""
    lows: list[FloatArray] = []
    highs: list[FloatArray] = []
    for mesh, rows in zip(meshes, numbers, strict=True):
        moved = rows[placements.is_moved[rows]]
        if len(moved) < len(rows):
            lows.append(np.array([mesh.report.bounds_min]))
            highs.append(np.array([mesh.report.bounds_max]))
        if not len(moved):
            continue
        points = place_points(find_shown_points(mesh), None, mesh.origin)
        matrices = placements.matrices[moved]
        for batch in batch_copies(len(matrices), len(points)):
            low, high = find_extents(points, matrices[batch])
            lows.append(low)
            highs.append(high)
    least, greatest = np.concatenate(lows).min(axis=0), np.concatenate(highs).max(axis=0)
    return least.tolist(), greatest.tolist()


def _find_largest(
    name: str, used: Sequence[tuple[MeshReport, Ints]], stretches: FloatArray, errors: FloatArray
) -> float | None:
    """The largest bound of all copies with faces; None if there is none, or if one is None."""
    largest: list[float] = []
    for report, rows in used:
        if report.triangles + report.quads:
            bound = getattr(report, name)
            if bound is None:
                return None
            largest.append(float((bound * stretches[rows] + errors[rows]).max()))
    return max(largest, default=None)


def _find_angle(
    meshes: Sequence[Mesh], copies: Sequence[PlacedModel], numbers: Sequence[Ints]
) -> float | None:
    """The largest angle between normals of a placed copy, if it is known for all with faces."""
    angles: list[float] = []
    for mesh, rows in zip(meshes, numbers, strict=True):
        report = mesh.report
        if not len(rows) or not report.triangles + report.quads:
            continue
        if report.normal_angle is None:
            return None
        # Copies that are only moved have one angle.
        linear = {b"" if (m := copies[k].matrix) is None else m[:3, :3].tobytes(): m for k in rows}
        for matrix in linear.values():
            angle: float | None = report.normal_angle
            if matrix is not None and mesh.normals is not None:
                angle = find_largest_angle(mesh.triangles, place_normals(mesh.normals, matrix))
            if angle is None:
                return None
            angles.append(angle)
    return max(angles, default=None)


def find_shown_points(mesh: Mesh) -> RealArray:
    """The points (N, 3) that determine the bounds of a mesh: its vertices, or else its lines.

    If the mesh has neither, they are the corners of the bounds in its report.
    """
    if len(mesh.positions):
        return mesh.positions
    lines = [overlay.positions for overlay in mesh.overlays if len(overlay.positions)]
    corners = np.array([mesh.report.bounds_min, mesh.report.bounds_max]) - mesh.origin
    return np.concatenate(lines) if lines else corners
