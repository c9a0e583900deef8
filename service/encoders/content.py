"""What several formats take out of a mesh in the same way."""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.encoders.text import FLOAT64_CHARS
from service.engine.clustering import leaders
from service.engine.mesh.mesh import Mesh, MeshPart, Overlay
from service.engine.mesh.report import MeshReport
from service.errors import Issue, UnsupportedByFormat


def absolute(positions: RealArray, mesh: Mesh) -> FloatArray:
    """Model coordinates of positions, shape (K, 3), that are stored relative to `mesh.origin`."""
    if not mesh.origin.any():
        return positions.astype(np.float64, copy=False)
    return positions.astype(np.float64) + mesh.origin


def shared_positions(mesh: Mesh) -> tuple[FloatArray, IndexArray]:
    """The positions that faces index where normals are indexed apart, or not written at all.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3), W <= V
        Model coordinates, in the order of the vertices; those that differ in their normal or
        their (u, v) alone are one.
    rows : ndarray of uint32, shape (V,)
        The row of `positions` that each vertex of the mesh uses.
    """
    positions = absolute(mesh.positions, mesh)
    if mesh.welds is None:
        return positions, np.arange(len(positions), dtype=np.uint32)
    first = mesh.welds == np.arange(len(mesh.welds), dtype=np.uint32)
    row = np.cumsum(first, dtype=np.uint32) - np.uint32(1)
    return positions[first], row[mesh.welds]


def colored_positions(mesh: Mesh) -> tuple[FloatArray, RealArray | None, IndexArray]:
    """The same for formats in which a position has its colour beside it.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3)
        One position has as many rows as it has colours.
    colors : ndarray, shape (W, 3) or (W, 4), or None
    rows : ndarray of uint32, shape (V,)
    """
    if mesh.colors is None or mesh.welds is None:
        positions, row = shared_positions(mesh)
        return positions, mesh.colors, row
    leader = leaders(mesh.welds.astype(np.intp), mesh.colors, 0.0)
    first = leader == np.arange(len(leader))
    row = np.cumsum(first, dtype=np.uint32) - np.uint32(1)
    return absolute(mesh.positions[first], mesh), mesh.colors[first], row[leader]


def drawn(overlays: tuple[Overlay, ...]) -> tuple[Overlay, ...]:
    """The overlays that have at least one segment: no format has a place for empty ones."""
    return tuple(overlay for overlay in overlays if len(overlay.segments))


def refuse_quads(mesh: Mesh, title: str) -> None:
    """Refuses a mesh with quads, which the format `title` does not have."""
    if len(mesh.quads):
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"{title} has only triangles.",
                "/faces",
                "quads",
                "triangles, or another format",
            )
        )


COMMENT_CHARS = len("comment deviation_bound \n") + FLOAT64_CHARS
"""Characters at most of the line that a format makes of `bound_comment`."""

REPORT_PART = len('{"name":"","deviation_bound":},') + FLOAT64_CHARS
"""Characters at most of a part in a report, beside its name."""


def report_object(report: MeshReport, parts: Sequence[MeshPart]) -> dict[str, object]:
    """The report as the JSON object that every format with a place for it carries.

    The parts are listed where the bound of any of them is known.
    """
    closed: dict[str, object] = {}
    if report.closure is not None:
        seams = {"u": report.closure.u, "v": report.closure.v}
        closed = {f"closed_{name}": seam is not None for name, seam in seams.items()}
        closed |= {f"continuity_{name}": seam for name, seam in seams.items() if seam is not None}
    return {
        "vertices": report.vertices,
        "triangles": report.triangles,
        "quads": report.quads,
        "patches": report.patches,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "watertight": report.watertight,
        "boundary_edges": report.boundary_edges,
        "poles_repaired": report.poles_repaired,
        **closed,
        **_accuracy(report, parts),
        **_curvature(report),
        "engine": report.engine,
    }


def bound_comment(report: MeshReport) -> str:
    """What formats with comments and no place for a report say of the mesh; empty if nothing."""
    if report.deviation_bound is None:
        return ""
    return f"deviation_bound {report.deviation_bound!r}"


def _accuracy(report: MeshReport, parts: Sequence[MeshPart]) -> dict[str, object]:
    """What is known of how near the mesh is to the surface; what is not is left out."""
    known = _known(
        deviation_bound=report.deviation_bound,
        mesh_deviation_bound=report.mesh_deviation_bound,
        normal_angle=report.normal_angle,
    )
    if any(part.deviation_bound is not None for part in parts):
        known["parts"] = [
            {"name": part.name} | _known(deviation_bound=part.deviation_bound) for part in parts
        ]
    return known


def _curvature(report: MeshReport) -> dict[str, object]:
    """Least and greatest curvatures, where they were asked for."""
    if report.curvature is None:
        return {}
    gaussian, mean = report.curvature
    return {"curvature": {"gaussian": gaussian, "mean": mean}}


def _known(**values: float | None) -> dict[str, object]:
    return {name: value for name, value in values.items() if value is not None}
