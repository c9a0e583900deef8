"""A brep as STEP entities: faces, edges with their parameter curves, shells and solids.

A plane gets no parameter curves: readers find them from the edges alone. Degenerate edges are left
out of loops, because in STEP a loop passes through a pole as through any vertex.

References
----------
ISO 10303-42, Geometric and topological representation: curves on surfaces, and topology (the loops
of a face run counter-clockwise about the face's normal).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.encoders.cad.shapes import find_lines, find_planes
from service.encoders.cad.step_geometry import (
    write_curves,
    write_line,
    write_surfaces,
)
from service.encoders.cad.step_records import Records, write_references, write_string
from service.surface.brep_columns import list_colors
from service.surface.brep_model import BrepModel
from service.surface.lowered import Color
from service.surface.spline_tables import CurveTable, find_starts

StyleItem = Callable[[int, Color], None]
"""Gives an item a colour."""


@dataclass(frozen=True, slots=True)
class BodyItem:
    """The item of a representation that a body is, and whether it is a solid."""

    number: int
    is_solid: bool


@dataclass(frozen=True, eq=False, slots=True)
class _Edges:
    """The number of each edge (0 for poles), and of the vertex at each vertex of the brep."""

    edges: list[int]
    vertices: list[int]


def write_body(
    records: Records,
    body: BrepModel,
    parameter_context: int,
    color: Color | None,
    style: StyleItem,
) -> BodyItem:
    """A solid, or a model of shells, of a body that has faces.

    Parameters
    ----------
    parameter_context : int
        The number of the context of parameter curves.
    color : tuple of four floats, or None
        The colour of faces without a colour of their own.
    style : callable
        Gives an item a colour.
    """
    is_plane = find_planes(body.surfaces)
    surfaces = write_surfaces(records, body.surfaces, is_plane)
    edges = _write_edges(records, body, surfaces, is_plane, parameter_context)
    faces = _write_faces(records, body, surfaces, edges)
    face_colors = list_colors(body.palette, body.face_colors)
    for face in sorted(body.shell_faces.tolist()):
        own_color = face_colors[face]
        if own_color is not None:
            style(faces[face], own_color)
    item = _write_shells(records, body, faces)
    if color is not None:
        style(item.number, color)
    return item


def _write_edges(
    records: Records,
    body: BrepModel,
    surfaces: list[int],
    is_plane: Bools,
    parameter_context: int,
) -> _Edges:
    """All vertices and edges."""
    first = records.add_points(body.vertices) if len(body.vertices) else 0
    vertices = [records.add(f"VERTEX_POINT('',#{first + k})") for k in range(len(body.vertices))]
    curves, ranges = _write_edge_curves(records, body)
    # The coedges with a parameter curve that is written, edge after edge.
    is_written = (body.coedge_pcurves >= 0) & (body.coedge_edges >= 0)
    is_written &= ~is_plane[body.coedge_faces]
    is_written[is_written] = ~body.is_degenerate[body.coedge_edges[is_written]]
    rows = np.flatnonzero(is_written)
    rows = rows[np.argsort(body.coedge_edges[rows], kind="stable")]
    owner = body.coedge_edges[rows]
    table = body.pcurves.select(body.coedge_pcurves[rows])
    lines = write_curves(records, _move_ranges(table, ranges[owner]))
    pcurves: dict[int, list[tuple[int, int]]] = {}
    faces = body.coedge_faces[rows].tolist()
    for edge, face, line in zip(owner.tolist(), faces, lines, strict=True):
        placed = records.add(f"DEFINITIONAL_REPRESENTATION('',(#{line}),#{parameter_context})")
        number = records.add(f"PCURVE('',#{surfaces[face]},#{placed})")
        pcurves.setdefault(edge, []).append((number, face))
    edges = []
    for edge, ((begin, end), curve) in enumerate(
        zip(body.edge_vertices.tolist(), curves, strict=True)
    ):
        if not curve:
            edges.append(0)
            continue
        own = pcurves.get(edge, [])[:2]
        if own:
            is_seam = len(own) == 2 and own[0][1] == own[1][1]
            kind = "SEAM_CURVE" if is_seam else "SURFACE_CURVE"
            numbers = write_references(number for number, _ in own)
            used = records.add(f"{kind}('',#{curve},{numbers},.CURVE_3D.)")
        else:
            used = curve
        ends = f"#{vertices[begin]},#{vertices[end]}"
        edges.append(records.add(f"EDGE_CURVE('',{ends},#{used},.T.)"))
    return _Edges(edges, vertices)


def _write_edge_curves(records: Records, body: BrepModel) -> tuple[list[int], FloatArray]:
    """For each edge the number of its curve, 0 for poles, and its range of parameters (E, 2)."""
    table = body.curves
    is_line = find_lines(table)
    numbers = np.zeros(len(table) + 1, np.intp)
    ranges = np.zeros((len(table) + 1, 2))
    ranges[:-1] = table.domains
    others = np.flatnonzero(~is_line)
    numbers[others] = write_curves(records, table.select(others))
    starts = table.point_starts
    for curve in np.flatnonzero(is_line).tolist():
        begin, end = table.points[starts[curve] : starts[curve] + 2]
        numbers[curve], length = write_line(records, begin, end)
        ranges[curve] = 0.0, length
    curves = body.edge_curves  # −1 for poles
    return numbers[curves].tolist(), ranges[curves]


def _move_ranges(table: CurveTable, ranges: FloatArray) -> CurveTable:
    """The curves with their domains mapped to other ranges (n, 2)."""
    owner = np.repeat(np.arange(len(table)), np.diff(table.knot_starts))
    (low, high), (begin, end) = table.domains.T, ranges.T
    is_same = (low == begin) & (high == end)
    share = (table.knots - low[owner]) / (high - low)[owner]
    moved = begin[owner] + share * (end - begin)[owner]
    moved = np.where(share == 1.0, end[owner], moved)
    knots = np.where(is_same[owner], table.knots, moved)
    return CurveTable(
        table.degrees, table.counts, table.points, table.weights, table.is_rational, knots
    )


def _write_faces(
    records: Records, body: BrepModel, surfaces: list[int], edges: _Edges
) -> list[int]:
    """All faces that are in a shell; the number of each, 0 for skipped faces."""
    loops: dict[int, list[str]] = {}
    starts = body.loop_starts.tolist()
    coedges = list(zip(body.coedge_edges.tolist(), body.coedge_reversed.tolist(), strict=True))
    is_reversed = body.is_reversed.tolist()
    for loop, face in enumerate(body.loop_faces.tolist()):
        own = coedges[starts[loop] : starts[loop + 1]]
        oriented = [
            records.add(f"ORIENTED_EDGE('',*,*,#{edges.edges[edge]},.{'F' if turned else 'T'}.)")
            for edge, turned in own
            if edges.edges[edge]
        ]
        if oriented:
            ring = records.add(f"EDGE_LOOP('',{write_references(oriented)})")
        else:
            vertex = edges.vertices[body.edge_vertices.item(own[0][0], 0)]
            ring = records.add(f"VERTEX_LOOP('',#{vertex})")
        sense = "F" if is_reversed[face] else "T"
        loops.setdefault(face, []).append(
            f"#{records.add(f'FACE_BOUND({_NO_NAME},#{ring},.{sense}.)')}"
        )
    faces = [0] * body.face_count
    for face in sorted(body.shell_faces.tolist()):
        bounds = ",".join(loops.get(face, ()))
        name, sense = write_string(body.face_names[face]), "F" if is_reversed[face] else "T"
        faces[face] = records.add(f"ADVANCED_FACE({name},({bounds}),#{surfaces[face]},.{sense}.)")
    return faces


_NO_NAME = "''"


def _write_shells(records: Records, body: BrepModel, faces: list[int]) -> BodyItem:
    """The shells, and the solid or the model that has them."""
    starts = find_starts(body.shell_counts).tolist()
    shells = []
    is_solid = True
    for shell, is_closed in enumerate(body.is_closed.tolist()):
        own = body.shell_faces[starts[shell] : starts[shell + 1]].tolist()
        if own:
            kind = "CLOSED_SHELL" if is_closed else "OPEN_SHELL"
            listed = write_references(faces[face] for face in own)
            shells.append(records.add(f"{kind}('',{listed})"))
            is_solid = is_solid and is_closed
    name = write_string(body.name)
    if not is_solid:
        model = f"SHELL_BASED_SURFACE_MODEL({name},{write_references(shells)})"
        return BodyItem(records.add(model), is_solid=False)
    if len(shells) == 1:
        return BodyItem(records.add(f"MANIFOLD_SOLID_BREP({name},#{shells[0]})"), is_solid=True)
    voids = [records.add(f"ORIENTED_CLOSED_SHELL('',*,#{shell},.T.)") for shell in shells[1:]]
    solid = f"BREP_WITH_VOIDS({name},#{shells[0]},{write_references(voids)})"
    return BodyItem(records.add(solid), is_solid=True)
