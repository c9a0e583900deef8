"""Writes the edges, faces and shells of a brep as in documents, without fields that have defaults.

The written form is canonical: a spline with the knots 0 … 0, 1 … 1 is a Bézier curve or patch, all
other knots are numbers, and knots that differ by rounding alone are equal.
"""

from collections.abc import Iterator
from math import isnan
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.surface.brep import BrepSurface
from service.surface.brep_columns import list_colors
from service.surface.brep_lists import EdgeColumns, FaceColumns
from service.surface.spline_tables import CurveTable, SurfaceTable, find_starts

Object = dict[str, Any]


def write_edges(brep: BrepSurface) -> list[Object]:
    """The edges; an uncertainty that equals that of the brep is left out."""
    assert brep.edge_uncertainties is not None  # the brep has filled them
    is_own = brep.edge_uncertainties != brep.uncertainty
    return list_edges(
        EdgeColumns(
            brep.edge_vertices,
            brep.edge_curves,
            np.where(is_own, brep.edge_uncertainties, np.nan),
            brep.is_degenerate,
            brep.curves,
        )
    )


def list_edges(columns: EdgeColumns) -> list[Object]:
    """The edges of columns."""
    curves = list(_write_curves(columns.curves))
    edges: list[Object] = []
    for vertices, curve, uncertainty, is_degenerate in zip(
        columns.vertices.tolist(),
        columns.curve_numbers.tolist(),
        columns.uncertainties.tolist(),
        columns.is_degenerate.tolist(),
        strict=True,
    ):
        edge: Object = {"vertices": vertices[:1] if is_degenerate else vertices}
        if curve >= 0:
            edge["curve"] = curves[curve]
        if not isnan(uncertainty):
            edge["uncertainty"] = uncertainty
        if is_degenerate:
            edge["degenerate"] = True
        edges.append(edge)
    return edges


def write_faces(brep: BrepSurface) -> list[Object]:
    """The faces with their loops."""
    return list_faces(
        FaceColumns(
            brep.face_names,
            brep.palette,
            brep.face_colors,
            brep.is_reversed,
            brep.surfaces,
            brep.loop_faces,
            brep.loop_counts,
            brep.coedge_edges,
            brep.coedge_reversed,
            brep.coedge_pcurves,
            brep.pcurves,
        )
    )


def list_faces(columns: FaceColumns) -> list[Object]:
    """The faces of columns, with their loops."""
    faces: list[Object] = []
    for name, color, is_reversed, surface in zip(
        columns.names,
        list_colors(columns.palette, columns.colors),
        columns.is_reversed.tolist(),
        _write_surfaces(columns.surfaces),
        strict=True,
    ):
        face: Object = {"name": name} if name else {}
        if color is not None:
            face["color"] = list(color[:3] if color[3] == 1 else color)
        if is_reversed:
            face["reversed"] = True
        faces.append(face | {"surface": surface})
    for number, loop in zip(columns.loop_faces.tolist(), _write_loops(columns), strict=True):
        faces[number].setdefault("loops", []).append(loop)
    return faces


def list_columns(surface: Object) -> Object:
    """The document of a CAD file, as JSON needs it: with lists in place of columns."""
    listed = dict(surface)
    if "definitions" in listed:
        listed["definitions"] = list(map(list_columns, listed["definitions"]))
    if isinstance(listed.get("edges"), EdgeColumns):
        listed["edges"] = list_edges(listed["edges"])
    if isinstance(listed.get("faces"), FaceColumns):
        listed["faces"] = list_faces(listed["faces"])
    return listed


def write_shells(brep: BrepSurface) -> list[Object]:
    """The shells; none if all faces, in their order, are one open shell."""
    faces = brep.shell_faces
    if len(brep.is_closed) == 1 and not brep.is_closed[0] and (np.diff(faces) == 1).all():
        return []
    lists = np.split(faces, find_starts(brep.shell_counts)[1:-1])
    return [
        {"faces": numbers} | ({"closed": True} if is_closed else {})
        for numbers, is_closed in zip(lists, brep.is_closed.tolist(), strict=True)
    ]


def write_vertex_uncertainties(brep: BrepSurface) -> FloatArray:
    """The uncertainties of the vertices; none if all equal that of the brep."""
    values = brep.vertex_uncertainties
    assert values is not None  # the brep has filled them
    return values[:0] if (values == brep.uncertainty).all() else values


WRITERS = {
    "edges": write_edges,
    "faces": write_faces,
    "shells": write_shells,
    "vertex_uncertainties": write_vertex_uncertainties,
}
"""For each field of a brep in documents that is no attribute of `BrepSurface`, what writes it."""


def _write_loops(faces: FaceColumns) -> Iterator[Object]:
    """The loops of all faces; lists that say nothing are left out."""
    starts = find_starts(faces.loop_counts)
    edges, flags = faces.coedge_edges.tolist(), faces.coedge_reversed.tolist()
    numbers, curves = faces.coedge_pcurves.tolist(), list(_write_curves(faces.pcurves))
    for first, last in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        loop: Object = {}
        if edges[first] >= 0:
            loop["edges"] = edges[first:last]
        if any(flags[first:last]):
            loop["reversed"] = flags[first:last]
        if max(numbers[first:last]) >= 0:
            loop["pcurves"] = [curves[k] if k >= 0 else None for k in numbers[first:last]]
        yield loop


def _write_curves(table: CurveTable) -> Iterator[Object]:
    """Curves of one table."""
    points, knots = table.point_starts.tolist(), table.knot_starts.tolist()
    is_bezier = _is_unit(table.knots, table.knot_starts, table.degrees).tolist()
    for k, (degree, is_rational) in enumerate(
        zip(table.degrees.tolist(), table.is_rational.tolist(), strict=True)
    ):
        rows = slice(points[k], points[k + 1])
        curve: Object = {"type": "bezier" if is_bezier[k] else "bspline"}
        curve["control_points"] = table.points[rows]
        if not is_bezier[k]:
            curve |= {"degree": degree, "knots": table.knots[knots[k] : knots[k + 1]]}
        if is_rational:
            curve["weights"] = table.weights[rows]
        yield curve


def _write_surfaces(table: SurfaceTable) -> Iterator[Object]:
    """The surfaces of all faces."""
    points, knots = table.point_starts.tolist(), table.knot_starts.tolist()
    is_unit = _is_unit(table.knots, table.knot_starts, table.degrees.ravel())
    is_bezier = is_unit.reshape(-1, 2).all(axis=1).tolist()
    for k, (degrees, counts, is_rational) in enumerate(
        zip(table.degrees.tolist(), table.counts.tolist(), table.is_rational.tolist(), strict=True)
    ):
        rows = slice(points[k], points[k + 1])
        surface: Object = {"type": "bezier" if is_bezier[k] else "bspline"}
        surface["control_net"] = table.points[rows].reshape(*counts, 3)
        if not is_bezier[k]:
            first, middle, last = knots[2 * k : 2 * k + 3]
            surface["degree"] = degrees
            surface["knots"] = [table.knots[first:middle], table.knots[middle:last]]
        if is_rational:
            surface["weights"] = table.weights[rows].reshape(counts)
        yield surface


def _is_unit(knots: FloatArray, starts: Ints, degrees: Ints) -> Any:
    """Whether each knot vector is that of one Bézier span: degree + 1 times 0, then 1; (n,)."""
    lengths = np.diff(starts)
    position = np.arange(len(knots)) - np.repeat(starts[:-1], lengths)
    expected = position > np.repeat(degrees, lengths)
    is_other = np.bincount(
        np.repeat(np.arange(len(lengths)), lengths)[knots != expected], minlength=len(lengths)
    )
    return (lengths == 2 * (degrees + 1)) & (is_other == 0)
