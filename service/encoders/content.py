"""Content that several formats derive from a mesh: positions, faces, reports, comments."""

from collections.abc import Callable, Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.bases.cache import Result, derive_once
from service.encoders.text import FLOAT64_CHARS, rows
from service.engine.clustering import find_leaders
from service.engine.mesh.mesh_value import Mesh, MeshPart, Overlay
from service.engine.mesh.report import MeshReport
from service.errors import Issue, UnsupportedByFormat


def absolute(positions: RealArray, mesh: Mesh) -> FloatArray:
    """Model coordinates of positions, shape (K, 3), that are stored relative to `mesh.origin`."""
    if not mesh.origin.any():
        return positions.astype(np.float64, copy=False)
    return positions.astype(np.float64) + mesh.origin


def find_shared_positions(mesh: Mesh) -> tuple[FloatArray, IndexArray | None]:
    """Positions without repetition, for formats with a separate index of normals, or no normals.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3), W <= V
        Model coordinates, in the order of the vertices; vertices that differ only in their normal
        or (u, v) share a position.
    row : ndarray of uint32, shape (V,), or None
        The row of `positions` of each vertex; None if it is the number of the vertex.
    """
    welds, positions = mesh.welds, mesh.positions
    if welds is None:
        return absolute(positions, mesh), None
    first = derive_once((welds,), "own leaders", lambda: np.flatnonzero(_leads(welds)))
    row = derive_once((welds,), "rows of leaders", lambda: _rows_of_leaders(welds))
    return absolute(positions.take(first, axis=0), mesh), row


def find_colored_positions(mesh: Mesh) -> tuple[FloatArray, RealArray | None, IndexArray | None]:
    """Positions for formats that store a colour with each position.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3)
        A position with several colours has several rows.
    colors : ndarray, shape (W, 3) or (W, 4), or None
    row : ndarray of uint32, shape (V,), or None
    """
    if mesh.colors is None or mesh.welds is None:
        positions, row = find_shared_positions(mesh)
        return positions, mesh.colors, row
    leader = find_leaders(mesh.welds.astype(np.intp), mesh.colors, 0.0)
    first = _leads(leader)
    return absolute(mesh.positions[first], mesh), mesh.colors[first], _rows_of_leaders(leader)


def keep_with_faces(
    mesh: Mesh, row: IndexArray | None, name: Hashable, build: Callable[[], Result]
) -> Result:
    """The result of `build()`, cached for the faces of the mesh and `row`, its only inputs."""
    sources = mesh.triangles, mesh.quads
    return derive_once(sources if row is None else (*sources, row), name, build)


def write_counted_faces(mesh: Mesh, row: IndexArray | None) -> bytes:
    """One line for each quad, then for each triangle: the number of corners, and their rows.

    `row`, shape (V,), maps vertices of the mesh to rows of the file.
    """

    def build() -> bytes:
        quads = rows(rename_vertices(mesh.quads, row), b"4 ")
        return quads + rows(rename_vertices(mesh.triangles, row), b"3 ")

    return keep_with_faces(mesh, row, "counted faces", build)


def rename_vertices(faces: IndexArray, row: IndexArray | None) -> IndexArray:
    """The row of each corner of each face; the number of the vertex if `row` is None."""
    return faces if row is None else row.take(faces)


def _leads(leader: Ints | IndexArray) -> NDArray[np.bool_]:
    """Whether each vertex is its own leader."""
    leads: NDArray[np.bool_] = leader == np.arange(len(leader), dtype=leader.dtype)
    return leads


def _rows_of_leaders(leader: Ints | IndexArray) -> IndexArray:
    """The row of each vertex's leader, where only leaders have rows.

    Writable if `leader` is.
    """
    row = (np.cumsum(_leads(leader), dtype=np.uint32) - np.uint32(1)).take(leader)
    row.flags.writeable = leader.flags.writeable
    return row


def find_nonempty(overlays: tuple[Overlay, ...]) -> tuple[Overlay, ...]:
    """The overlays with at least one segment: formats cannot store empty overlays."""
    return tuple(overlay for overlay in overlays if len(overlay.segments))


def refuse_quads(mesh: Mesh, title: str) -> None:
    """Refuses a mesh with quads, for the format named `title`."""
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
"""Most characters of the line that a format makes of `bound_comment`."""

REPORT_PART = len('{"name":"","deviation_bound":},') + FLOAT64_CHARS
"""Most characters of a part in a report, without its name."""


def report_object(report: MeshReport, parts: Sequence[MeshPart]) -> dict[str, object]:
    """The report as a JSON object, for all formats that store one.

    It lists the parts if any of their bounds is known.
    """
    seam_fields: dict[str, object] = {}
    if report.closure is not None:
        seams = {"u": report.closure.u, "v": report.closure.v}
        seam_fields = {f"closed_{name}": seam is not None for name, seam in seams.items()}
        seam_fields |= {
            f"continuity_{name}": seam for name, seam in seams.items() if seam is not None
        }
    return {
        "vertices": report.vertices,
        "triangles": report.triangles,
        "quads": report.quads,
        "patches": report.patches,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "watertight": report.watertight,
        "boundary_edges": report.boundary_edges,
        "poles_repaired": report.poles_repaired,
        **seam_fields,
        **_accuracy(report, parts),
        **_curvature(report),
        **({"merged_knots": report.merged_knots} if report.merged_knots else {}),
        **({"moved": report.moved} if report.moved else {}),
        "engine": report.engine,
    }


def bound_comment(report: MeshReport) -> str:
    """The comment on deviation, for formats without a report; empty if no bound is known."""
    if report.deviation_bound is None:
        return ""
    return f"deviation_bound {report.deviation_bound!r}"


def _accuracy(report: MeshReport, parts: Sequence[MeshPart]) -> dict[str, object]:
    """The certified bounds of the mesh, without those that are None."""
    known = _keep_known(
        deviation_bound=report.deviation_bound,
        mesh_deviation_bound=report.mesh_deviation_bound,
        normal_angle=report.normal_angle,
    )
    if any(part.deviation_bound is not None for part in parts):
        known["parts"] = [
            {"name": part.name} | _keep_known(deviation_bound=part.deviation_bound)
            for part in parts
        ]
    return known


def _curvature(report: MeshReport) -> dict[str, object]:
    """Least and greatest curvatures, if requested."""
    if report.curvature is None:
        return {}
    gaussian, mean = report.curvature
    return {"curvature": {"gaussian": gaussian, "mean": mean}}


def _keep_known(**values: float | None) -> dict[str, object]:
    return {name: value for name, value in values.items() if value is not None}
