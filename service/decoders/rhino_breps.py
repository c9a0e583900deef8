"""Parts of the breps and surfaces of openNURBS, as `rhino3dm` gives them.

Loops run around their face's material seen against du × dv of the surface, whether or not the face
is reversed. A trim without an edge is a pole. The curves of trims in the parameters of the surface
cannot be read with this library; the engine makes them of the edges.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Coedge, Curve, SkippedFace, Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.splines import build_curve, build_surface

_NO_BOUNDARY = {"CurveOnSurface", "PointOnSurface"}
"""Kinds of loops that bound nothing."""


def read_surface(surface: Any, entity: str, builder: PartBuilder) -> list[SkippedFace]:
    """Adds a whole surface to a part; returns what cannot be read, as `read_brep` does."""
    try:
        builder.add_face(_convert_surface(surface), ())
    except InvalidGeometry as error:
        return [SkippedFace(entity, error.reason)]
    return []


def read_brep(brep: Any, entity: str, builder: PartBuilder) -> list[SkippedFace]:
    """Adds the faces and shells of a brep to a part; returns the faces that cannot be read.

    Parameters
    ----------
    entity : str
        The id of the object, for the report.
    """
    ends = _find_ends(brep)
    uses: dict[int, list[Coedge]] = {}
    skipped = []
    for number in range(len(brep.Faces)):
        face = brep.Faces[number]
        try:
            surface = _convert_surface(face.UnderlyingSurface())
            loops = [
                [
                    Coedge(_find_edge(builder, brep, trim.EdgeIndex, ends), trim.IsReversed)
                    for trim in trims
                    if trim.EdgeIndex >= 0
                ]
                for trims in _list_loops(face)
            ]
            turned = bool(face.OrientationIsReversed)
            added = builder.add_face(surface, loops, is_reversed=turned, turns_with_face=False)
        except InvalidGeometry as error:
            skipped.append(SkippedFace(f"{entity} face {number}", error.reason))
            continue
        uses[added] = [
            Coedge(each.edge, each.is_reversed != turned) for loop in loops for each in loop
        ]
    for faces in _find_components(uses):
        builder.add_shell(faces, _is_closed(uses[face] for face in faces))
    return skipped


def _list_loops(face: Any) -> list[list[Any]]:
    """The trims of each loop that bounds a face."""
    loops = [face.Loops[number] for number in range(len(face.Loops))]
    return [
        [loop.Trims[number] for number in range(loop.TrimCount)]
        for loop in loops
        if loop.LoopType.name not in _NO_BOUNDARY
    ]


def _find_ends(brep: Any) -> dict[int, tuple[int, int]]:
    """The vertices of each edge, as the trims along it say."""
    ends: dict[int, tuple[int, int]] = {}
    for number in range(len(brep.Faces)):
        for trims in _list_loops(brep.Faces[number]):
            for trim in trims:
                pair = (trim.StartVertexIndex, trim.EndVertexIndex)
                ends.setdefault(trim.EdgeIndex, pair[::-1] if trim.IsReversed else pair)
    return ends


def _find_edge(
    builder: PartBuilder, brep: Any, index: int, ends: dict[int, tuple[int, int]]
) -> int:
    """The number of an edge, which is made if it is new.

    Raises
    ------
    InvalidGeometry
        It cannot be made, or refers to what the brep does not have.
    """
    known = builder.find_edge(index)
    if known is not None:
        return known
    if index >= len(brep.Edges) or not all(0 <= end < len(brep.Vertices) for end in ends[index]):
        raise InvalidGeometry("it refers to an edge or a vertex that is not in the brep")
    points = (brep.Vertices[end].Location for end in ends[index])
    first, last = (
        builder.add_vertex(end, (point.X, point.Y, point.Z))
        for end, point in zip(ends[index], points, strict=True)
    )
    return builder.add_edge(index, (first, last), _convert_curve(brep.Edges[index]))


def _convert_curve(curve: Any) -> Curve | None:
    """A curve of openNURBS as a spline; None for a line."""
    spline = curve.ToNurbsCurve()
    if spline is None:
        raise InvalidGeometry("an edge has a curve that is no spline")
    points = spline.Points
    net = _project([points[number] for number in range(len(points))])
    if spline.Degree == 1 and len(net) == 2:
        return None
    return build_curve(spline.Degree, _complete_knots(spline.Knots), net[:, :3], net[:, 3])


def _convert_surface(surface: Any) -> Surface:
    """A surface of openNURBS as a spline."""
    spline = None if surface is None else surface.ToNurbsSurface()
    if spline is None:
        raise InvalidGeometry("the surface is no spline")
    points = spline.Points
    count_u, count_v = points.CountU, points.CountV
    net = _project([points[u, v] for u in range(count_u) for v in range(count_v)])
    net = net.reshape(count_u, count_v, 4)
    degrees = spline.OrderU - 1, spline.OrderV - 1
    knots = _complete_knots(spline.KnotsU), _complete_knots(spline.KnotsV)
    return build_surface(degrees, knots, net[..., :3], net[..., 3])


def _project(points: Sequence[Any]) -> FloatArray:
    """Rows (x, y, z, w) of control points, whose coordinates have the weight multiplied in."""
    net = np.array([(point.X, point.Y, point.Z, point.W) for point in points]).reshape(-1, 4)
    if not (net[:, 3] > 0).all():
        raise InvalidGeometry("a weight is not positive")
    net[:, :3] /= net[:, 3:]
    return net


def _complete_knots(knots: Any) -> list[float]:
    """A full knot vector: openNURBS leaves out its first and last knot, which have no effect."""
    try:
        values = [knots[number] for number in range(len(knots))]
    except ValueError:  # the library says that their number is negative
        raise InvalidGeometry("a spline has no knots") from None
    return [*values[:1], *values, *values[-1:]]


def _find_components(uses: dict[int, list[Coedge]]) -> list[list[int]]:
    """Groups of faces that are connected by edges, in the order of their first faces."""
    faces_of_edges: dict[int, list[int]] = defaultdict(list)
    for face, coedges in uses.items():
        for coedge in coedges:
            faces_of_edges[coedge.edge].append(face)
    components, seen = [], set[int]()
    for first in uses:
        if first in seen:
            continue
        seen.add(first)
        component, stack = [], [first]
        while stack:
            face = stack.pop()
            component.append(face)
            for coedge in uses[face]:
                for other in faces_of_edges.pop(coedge.edge, ()):
                    if other not in seen:
                        seen.add(other)
                        stack.append(other)
        components.append(sorted(component))
    return components


def _is_closed(uses: Iterable[list[Coedge]]) -> bool:
    """Whether every edge is used once in each direction."""
    directions: dict[int, list[bool]] = defaultdict(list)
    for coedges in uses:
        for coedge in coedges:
            directions[coedge.edge].append(coedge.is_reversed)
    return bool(directions) and all(sorted(each) == [False, True] for each in directions.values())
