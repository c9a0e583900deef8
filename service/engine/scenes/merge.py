"""Merges meshes: concatenates their arrays, and combines their reports."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import IndexArray, RealArray
from service.engine.mesh.brep_report import add_brep_reports
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, merge_ranges


def merge_meshes(meshes: Sequence[Mesh], name: str) -> Mesh:
    """One mesh of all vertices, faces, parts and overlays, in the order of the meshes.

    Vertices of different meshes are not welded. The meshes must have the same precision, origin,
    vertical axis and attributes, and all or none must have normals. If only some meshes have
    colours or texture coordinates, the vertices of the other meshes become white or get (0, 0).
    """
    counts = [len(mesh.positions) for mesh in meshes]
    first_vertices = np.cumsum([0, *counts]).astype(np.uint32)
    return replace(
        meshes[0],
        name=name,
        positions=np.concatenate([mesh.positions for mesh in meshes]),
        normals=_fill_rows([mesh.normals for mesh in meshes], counts, 0.0),
        uvs=_fill_rows([mesh.uvs for mesh in meshes], counts, 0.0),
        colors=_fill_rows([mesh.colors for mesh in meshes], counts, 1.0),
        attributes=tuple(
            (title, np.concatenate([dict(mesh.attributes)[title] for mesh in meshes]))
            for title, _ in meshes[0].attributes
        ),
        triangles=_shift_faces([mesh.triangles for mesh in meshes], first_vertices),
        quads=_shift_faces([mesh.quads for mesh in meshes], first_vertices),
        parts=_join_parts(meshes),
        # The merged mesh has grids only if all meshes have grids.
        grids=tuple(
            grid + start
            for mesh, start in zip(meshes, first_vertices[:-1], strict=True)
            for grid in mesh.grids
        )
        if all(mesh.grids for mesh in meshes)
        else (),
        welds=_join_welds(meshes, first_vertices),
        overlays=tuple(overlay for mesh in meshes for overlay in mesh.overlays),
        report=add_reports([mesh.report for mesh in meshes]),
    )


def add_reports(reports: Sequence[MeshReport]) -> MeshReport:
    """The report on several meshes together; they are watertight if each mesh is."""
    low = np.min([report.bounds_min for report in reports], axis=0).tolist()
    high = np.max([report.bounds_max for report in reports], axis=0).tolist()
    return replace(
        reports[0],
        vertices=sum(report.vertices for report in reports),
        triangles=sum(report.triangles for report in reports),
        quads=sum(report.quads for report in reports),
        patches=sum(report.patches for report in reports),
        bounds_min=(low[0], low[1], low[2]),
        bounds_max=(high[0], high[1], high[2]),
        watertight=all(report.watertight for report in reports),
        boundary_edges=sum(report.boundary_edges for report in reports),
        poles_repaired=sum(report.poles_repaired for report in reports),
        closure=reports[0].closure if len(reports) == 1 else None,
        deviation_bound=_find_largest(reports, "deviation_bound"),
        mesh_deviation_bound=_find_largest(reports, "mesh_deviation_bound"),
        normal_angle=_find_largest(reports, "normal_angle"),
        curvature=merge_ranges([report.curvature for report in reports]),
        merged_knots=sum(report.merged_knots for report in reports),
        moved=max(report.moved for report in reports),
        brep=add_brep_reports([(report.brep, 1) for report in reports if report.brep]),
    )


def _find_largest(reports: Sequence[MeshReport], name: str) -> float | None:
    """The largest value in all reports with faces; None if there is none, or if a value is None."""
    values = [getattr(report, name) for report in reports if report.triangles + report.quads]
    return None if not values or None in values else max(values)


def _fill_rows(
    rows: Sequence[RealArray | None], counts: Sequence[int], value: float
) -> RealArray | None:
    """Rows of all meshes, as wide as the widest rows; None if the rows of all meshes are None.

    Missing rows and columns are filled with `value`.
    """
    arrays = [array for array in rows if array is not None]
    if not arrays:
        return None
    width = max(array.shape[1] for array in arrays)
    merged = np.full((sum(counts), width), value, dtype=arrays[0].dtype)
    first = 0
    for array, count in zip(rows, counts, strict=True):
        if array is not None:
            merged[first : first + count, : array.shape[1]] = array
        first += count
    return merged


def _shift_faces(faces: Sequence[IndexArray], first_vertices: IndexArray) -> IndexArray:
    """Faces of all meshes, with the vertex numbers of the merged mesh.

    `first_vertices` has one number more than there are meshes: the number of all vertices.
    """
    return np.concatenate(
        [rows + start for rows, start in zip(faces, first_vertices, strict=False)]
    )


def _join_parts(meshes: Sequence[Mesh]) -> tuple[MeshPart, ...]:
    """Parts of all meshes, with the face numbers of the merged mesh."""
    parts: list[MeshPart] = []
    triangles = quads = 0
    for mesh in meshes:
        parts += (
            replace(
                part,
                triangles=(part.triangles[0] + triangles, part.triangles[1] + triangles),
                quads=(part.quads[0] + quads, part.quads[1] + quads),
            )
            for part in mesh.parts
        )
        triangles += len(mesh.triangles)
        quads += len(mesh.quads)
    return tuple(parts)


def _join_welds(meshes: Sequence[Mesh], first_vertices: IndexArray) -> IndexArray | None:
    """For each vertex, the first vertex of its mesh at its position; None if all mesh welds are."""
    if all(mesh.welds is None for mesh in meshes):
        return None
    rows = (
        np.arange(len(mesh.positions), dtype=np.uint32) if mesh.welds is None else mesh.welds
        for mesh in meshes
    )
    return _shift_faces(list(rows), first_vertices)
