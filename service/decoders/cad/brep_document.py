"""A part of a CAD file as the document of a brep.

Arrays stand in place of lists of numbers. A field that has its default is left out.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Coedge, Curve, Edge, Face, Part, Surface
from service.decoders.cad.names import NameCleaner
from service.decoders.format import Tree


def write_brep(part: Part, name: str, up: str, names: NameCleaner) -> Tree:
    """The document of a brep with the faces of a part.

    The colour of the part is not in it: it is that of a member, or of each face (`write_color`).
    A face that fails a check is left out of meshes and listed, and does not refuse the document.
    """
    tree: Tree = {"type": "brep"}
    if len(part.vertices):
        tree["vertices"] = part.vertices
    if part.edges:
        tree["edges"] = [_write_edge(edge) for edge in part.edges]
    tree["faces"] = [_write_face(face, names) for face in part.faces]
    if shells := _write_shells(part):
        tree["shells"] = shells
    if part.uncertainty is not None:
        tree["uncertainty"] = float(part.uncertainty)
    tree |= {"invalid_faces": "skip", "up": up}
    return tree | {"name": name} if name else tree


def write_color(color: Sequence[float]) -> list[float]:
    """A colour as three or four numbers from 0 to 1; NaN becomes 0."""
    return [min(max(0.0, float(value)), 1.0) for value in color]


def _write_edge(edge: Edge) -> Tree:
    first, last = map(int, edge.vertices)
    tree: Tree = {"vertices": [first] if edge.is_degenerate else [first, last]}
    if edge.is_degenerate:
        tree["degenerate"] = True
    elif edge.curve is not None:
        tree["curve"] = _write_curve(edge.curve)
    if edge.uncertainty is not None:
        tree["uncertainty"] = float(edge.uncertainty)
    return tree


def _write_face(face: Face, names: NameCleaner) -> Tree:
    tree: Tree = {}
    if name := names.clean(face.name):
        tree["name"] = name
    if face.color is not None:
        tree["color"] = write_color(face.color)
    if face.is_reversed:
        tree["reversed"] = True
    tree["surface"] = _write_surface(face.surface)
    if face.loops:
        tree["loops"] = [_write_loop(loop) for loop in face.loops]
    return tree


def _write_loop(loop: Sequence[Coedge]) -> Tree:
    tree: Tree = {"edges": [int(coedge.edge) for coedge in loop]}
    if any(coedge.is_reversed for coedge in loop):
        tree["reversed"] = [bool(coedge.is_reversed) for coedge in loop]
    if any(coedge.pcurve is not None for coedge in loop):
        tree["pcurves"] = [
            None if coedge.pcurve is None else _write_curve(coedge.pcurve) for coedge in loop
        ]
    return tree


def _write_shells(part: Part) -> list[Tree]:
    """The shells; none if all faces, in their order, are one open shell."""
    shells = part.shells
    all_faces = tuple(range(len(part.faces)))
    if len(shells) == 1 and not shells[0].is_closed and tuple(shells[0].faces) == all_faces:
        return []
    return [
        {"faces": np.array(shell.faces, np.int64)} | ({"closed": True} if shell.is_closed else {})
        for shell in shells
    ]


def _write_curve(curve: Curve) -> Tree:
    points, weights = _project(curve.points)
    tree: Tree = {
        "type": "bspline",
        "control_points": points,
        "degree": int(curve.degree),
        "knots": curve.knots,
    }
    return tree if weights is None else tree | {"weights": weights}


def _write_surface(surface: Surface) -> Tree:
    points, weights = _project(surface.points)
    tree: Tree = {
        "type": "bspline",
        "control_net": points,
        "degree": [int(degree) for degree in surface.degrees],
        "knots": list(surface.knots),
    }
    return tree if weights is None else tree | {"weights": weights}


def _project(points: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """Control points (…, D) and weights (…,) of homogeneous ones (…, D + 1).

    Equal weights are None: the spline is then polynomial.
    """
    weights = points[..., -1]
    first = weights.flat[0]
    if (weights == first).all():
        return points[..., :-1] if first == 1 else points[..., :-1] / first, None
    return points[..., :-1] / weights[..., np.newaxis], weights
