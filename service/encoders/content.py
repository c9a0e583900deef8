"""Computes from a mesh what several formats write: positions, faces, colours, reports, comments."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, Bytes, FloatArray, IndexArray, Ints, RealArray
from service.bases.cache import Result, derive_once
from service.encoders.format import MeshSize
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE, digits, rows
from service.engine.clustering import find_leaders
from service.engine.mesh.brep_report import BrepReport
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, Orientation, Overlay
from service.errors import Issue, UnsupportedByFormat
from service.surface.brep_model import SkippedFace


def to_bytes(colors: RealArray) -> Bytes:
    """Colours, with or without opacity, as bytes from 0 to 255; halves are rounded to even."""
    return np.rint(colors.astype(np.float64) * 255).astype(np.uint8)


def add_opacity(colors: RealArray) -> NDArray[np.float32]:
    """Colours as red, green, blue and opacity, as OOGL and OFF need them: shape (V, 4).

    Colours without an opacity get the opacity 1.
    """
    rgba = np.ones((len(colors), 4), dtype=np.float32)
    rgba[:, : colors.shape[1]] = colors
    return rgba


def is_translucent(colors: RealArray) -> bool:
    """Whether any vertex has an opacity below 1."""
    return colors.shape[1] == 4 and bool((colors[:, 3] < 1).any())


def absolute(positions: RealArray, mesh: Mesh) -> FloatArray:
    """Positions (K, 3) in model coordinates; the argument is relative to `mesh.origin`."""
    if not mesh.origin.any():
        return positions.astype(np.float64, copy=False)
    return positions.astype(np.float64) + mesh.origin


def find_shared_positions(mesh: Mesh) -> tuple[FloatArray, IndexArray | None]:
    """The distinct positions of a mesh, for formats that index positions separately from normals.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3), W <= V
        Model coordinates, in the order of the vertices. Vertices that differ only in their normal
        or (u, v) share a position.
    row : ndarray of uint32, shape (V,), or None
        For each vertex, the row of its position; None if this is the number of the vertex.
    """
    welds, positions = mesh.welds, mesh.positions
    if welds is None:
        return absolute(positions, mesh), None
    # `welds` has the leader of each vertex: the first vertex at its position.
    leaders = derive_once((welds,), "leaders", lambda: np.flatnonzero(_is_leader(welds)))
    row = derive_once((welds,), "rows of leaders", lambda: _number_leaders(welds))
    return absolute(positions.take(leaders, axis=0), mesh), row


def find_colored_positions(mesh: Mesh) -> tuple[FloatArray, RealArray | None, IndexArray | None]:
    """The distinct pairs of position and colour, for formats that store both together.

    Returns
    -------
    positions : ndarray of float64, shape (W, 3)
        Model coordinates. A position with several colours has several rows.
    colors : ndarray, shape (W, 3) or (W, 4), or None
        The colour of each row; None for a mesh without colours.
    row : ndarray of uint32, shape (V,), or None
        For each vertex, its row; None if this is the number of the vertex.
    """
    if mesh.colors is None or mesh.welds is None:
        positions, row = find_shared_positions(mesh)
        return positions, mesh.colors, row
    # Among the vertices at one position, those of equal colour get one leader.
    leaders = find_leaders(mesh.welds.astype(np.intp), mesh.colors, radius=0.0)
    is_leader = _is_leader(leaders)
    return (
        absolute(mesh.positions[is_leader], mesh),
        mesh.colors[is_leader],
        _number_leaders(leaders),
    )


def keep_with_faces(
    mesh: Mesh, row: IndexArray | None, name: Hashable, build: Callable[[], Result]
) -> Result:
    """The result of `build()`, which must depend only on the faces of the mesh and on `row`.

    The result is cached by these arrays and `name`.
    """
    sources = mesh.triangles, mesh.quads
    return derive_once(sources if row is None else (*sources, row), name, build)


def write_counted_faces(mesh: Mesh, row: IndexArray | None) -> bytes:
    """Lines of text, one for each quad and then one for each triangle.

    A line has the number of corners, and the rows of the corners in the file. `row`, shape (V,),
    has the row of each vertex of the mesh; None if this is the number of the vertex.
    """

    def build() -> bytes:
        quads = rows(rename_vertices(mesh.quads, row), b"4 ")
        return quads + rows(rename_vertices(mesh.triangles, row), b"3 ")

    return keep_with_faces(mesh, row, "counted faces", build)


def rename_vertices(faces: IndexArray, row: IndexArray | None) -> IndexArray:
    """Faces with rows of a file in place of vertex numbers; unchanged if `row` is None."""
    return faces if row is None else row.take(faces)


def _is_leader(leader: Ints | IndexArray) -> Bools:
    """Whether each vertex is its own leader: the first of the vertices that are one point."""
    return np.asarray(leader == np.arange(len(leader), dtype=leader.dtype))


def _number_leaders(leader: Ints | IndexArray) -> IndexArray:
    """For each vertex the position of its leader among the leaders alone.

    The result is writeable if `leader` is: `keep_with_faces` caches only by read-only arrays.
    """
    row = (np.cumsum(_is_leader(leader), dtype=np.uint32) - np.uint32(1)).take(leader)
    row.flags.writeable = leader.flags.writeable
    return row


def find_nonempty(overlays: tuple[Overlay, ...]) -> tuple[Overlay, ...]:
    """The overlays with at least one segment: formats cannot store empty overlays."""
    return tuple(overlay for overlay in overlays if len(overlay.segments))


def refuse_quads(mesh: Mesh, title: str) -> None:
    """Refuse a mesh with quads; `title` is the name of the format for the message."""
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
"""The most characters of the line in which a format writes `bound_comment`."""

REPORT_PART_CHARS = len('{"name":"","deviation_bound":},') + FLOAT64_CHARS
"""The most characters of a part in a report, without its name."""

MAX_LISTED_FACES = 10_000
"""The most parts that a report or a JSON file lists, if a part is a face of a brep."""

BREP_CHARS = 420 + 4 * FLOAT64_CHARS
"""The most characters of the fields of a report that only breps have, without skipped faces."""

SKIPPED_FACE_CHARS = 320
"""The most characters of a skipped face in a report."""


def bound_orientation_chars(listed_patches: int) -> int:
    """The most characters of the lists of patches that were turned or have no orientation."""
    return 64 + 9 * listed_patches if listed_patches else 0


def bound_brep_chars(defined_faces: int, placed_faces: int, name_bytes: int) -> int:
    """The most characters that the faces of breps add to a report, with their names.

    The parameters are those of `MeshSize`; `name_bytes` are those of the names of placed faces.
    """
    if not defined_faces:
        return 0
    chars = BREP_CHARS + defined_faces * SKIPPED_FACE_CHARS
    if placed_faces > MAX_LISTED_FACES:
        return chars
    return chars + placed_faces * REPORT_PART_CHARS + name_bytes * LONGEST_ESCAPE


def bound_report_chars(size: MeshSize) -> int:
    """The most characters of the lists of parts and of lines, the report, and the keys of all."""
    # A part: keys, its range of faces, a colour of 4 numbers, and its entry in the report.
    part = 100 + 2 * digits(size.triangles + size.quads) + 4 * FLOAT64_CHARS + REPORT_PART_CHARS
    # 14 numbers: bounds (6), curvatures (4), two bounds, normal angle and unit. 640 characters
    # suffice for the keys and brackets of the document, for whole numbers and for `moved`.
    report = 640 + 14 * FLOAT64_CHARS
    # Names of faces are in the list of parts, too.
    brep = 2 * bound_brep_chars(size.defined_faces, size.placed_faces, size.face_name_bytes)
    return (
        (size.drawables + min(size.faces, MAX_LISTED_FACES)) * part
        + brep
        + bound_orientation_chars(size.listed_patches)
        # The report repeats the names of parts.
        + 2 * size.name_bytes * LONGEST_ESCAPE
        + report
    )


def list_parts(mesh: Mesh) -> Iterator[dict[str, object]]:
    """For each part its name, its range [first, last) of all faces, and its base colour if any.

    The faces are in the order of JSON: part by part, the quads of a part before its triangles.
    """
    first = 0
    for part in mesh.parts:
        last = first + part.quads[1] - part.quads[0] + part.triangles[1] - part.triangles[0]
        color = {} if part.color is None else {"color": part.color}
        yield {"name": part.name, "faces": [first, last], **color}
        first = last


def report_object(report: MeshReport, parts: Sequence[MeshPart]) -> dict[str, object]:
    """The report on a mesh as a JSON object, for the formats that store a report.

    It has no values that were not computed. The parts are listed if at least one of them has a
    deviation bound; those of breps only if there are at most `MAX_LISTED_FACES`.
    """
    closure, curvature = report.closure, report.curvature
    # None along u or v: the surface is open in this direction.
    continuity = {} if closure is None else {"u": closure.u, "v": closure.v}
    has_bounds = any(part.deviation_bound is not None for part in parts)
    report_fields = omit_none(
        {
            "vertices": report.vertices,
            "triangles": report.triangles,
            "quads": report.quads,
            "patches": report.patches,
            "bounds": {"min": report.bounds_min, "max": report.bounds_max},
            "watertight": report.watertight,
            "boundary_edges": report.boundary_edges,
            "poles_repaired": report.poles_repaired,
            **{f"closed_{name}": value is not None for name, value in continuity.items()},
            **{f"continuity_{name}": value for name, value in continuity.items()},
            "deviation_bound": report.deviation_bound,
            "mesh_deviation_bound": report.mesh_deviation_bound,
            "normal_angle": report.normal_angle,
            "parts": [
                {"name": part.name} | omit_none({"deviation_bound": part.deviation_bound})
                for part in parts
            ]
            if has_bounds and lists_parts(report, parts)
            else None,
            "curvature": curvature and dict(zip(("gaussian", "mean"), curvature, strict=True)),
            "merged_knots": report.merged_knots or None,
            "moved": report.moved or None,
            **_orientation_fields(report.orientation),
            "metres_per_unit": report.metres_per_unit,
            "engine": report.engine,
        }
    )
    return report_fields if report.brep is None else report_fields | _brep_fields(report.brep)


def _orientation_fields(orientation: Orientation | None) -> dict[str, object]:
    """The fields of a report on an oriented surface: at most `MAX_LISTED_FACES` numbers each."""
    if orientation is None:
        return {}
    return {
        "turned": orientation.turned[:MAX_LISTED_FACES],
        "not_orientable": orientation.not_orientable[:MAX_LISTED_FACES],
    }


def lists_parts(report: MeshReport, parts: Sequence[MeshPart]) -> bool:
    """Whether a file lists the parts: always, unless they are the faces of very large breps."""
    return report.brep is None or len(parts) <= MAX_LISTED_FACES


def _brep_fields(brep: BrepReport) -> dict[str, object]:
    """The fields of a report that only breps have."""
    # A bound that was requested but is not finite is null, and has a reason.
    no_bound = {"mesh_deviation_bound": None, "mesh_deviation_reason": brep.unbounded_reason}
    return {
        "reached": brep.reached,
        "gap_bound": brep.gap_bound,
        "pcurves_replaced": brep.pcurves_replaced,
        "complete": brep.complete,
        "non_manifold_edges": brep.non_manifold_edges,
        "double_edges": brep.double_edges,
        "degenerate_faces": brep.degenerate_faces,
        "collapsed_edges": {"count": brep.collapsed_edges, "longest_chain": brep.longest_chain},
        "skipped_faces": list_skipped_faces(brep.skipped_faces, "face"),
        **({} if brep.unbounded_reason is None else no_bound),
    }


def list_skipped_faces(faces: Iterable[SkippedFace], name: str) -> list[dict[str, object]]:
    """Faces that were left out, and why, as JSON objects; the number of a face has this name."""
    return [
        {
            name: each.face,
            "code": each.issue.code,
            "got": each.issue.got,
            "needed": each.issue.needed,
        }
        for each in faces
    ]


def omit_none(fields: dict[str, object]) -> dict[str, object]:
    """The fields that have a value."""
    return {name: value for name, value in fields.items() if value is not None}


def bound_comment(report: MeshReport) -> str:
    """The comment with the deviation bound, for formats without a report; "" without a bound."""
    if report.deviation_bound is None:
        return ""
    return f"deviation_bound {report.deviation_bound!r}"
