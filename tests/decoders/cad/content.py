"""Small contents of CAD files for tests: plates, and products that hold them."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import (
    CadContent,
    Coedge,
    Curve,
    Definition,
    Edge,
    Face,
    Part,
    Placement,
    Reading,
    Shell,
    Surface,
)

READING = Reading("step", schema="AUTOMOTIVE_DESIGN", units=("millimetre",), metres_per_unit=0.001)


def build_plate(name: str = "plate", width: float = 2, **changes: object) -> Part:
    """One square face with its border as four lines."""
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, width, 0], [0, width, 0]], float)
    net = np.ones((2, 2, 4))
    net[..., :3] = [[corners[0], corners[3]], [corners[1], corners[2]]]
    unit = np.array([0, 0, 1, 1], float)
    face = Face(Surface((1, 1), (unit, unit), net), (tuple(map(Coedge, range(4))),))
    edges = tuple(Edge((k, (k + 1) % 4)) for k in range(4))
    plate = Part(name, corners, edges, (face,), (Shell((0,), False),))
    return replace(plate, **changes)  # type: ignore[arg-type]  # fields of a part


def build_disc() -> Part:
    """A square face with a round hole: a rational edge, with and without a pcurve."""
    plate = build_plate("disc")
    corner = np.sqrt(0.5)
    # Two half circles about (1, 1) with radius 1/2, of degree 2 with one double knot each.
    rows = [[1.5, 1, 1], [1.5, 1.5, corner], [1, 1.5, 1], [0.5, 1.5, corner], [0.5, 1, 1]]
    upper = np.array([[x * w, y * w, 0, w] for x, y, w in rows])
    lower = np.array([[x * w, (2 - y) * w, 0, w] for x, y, w in reversed(rows)])
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 2], float)
    vertices = np.concatenate([plate.vertices, [[1.5, 1, 0], [0.5, 1, 0]]])
    edges = (
        *plate.edges,
        Edge((4, 5), Curve(2, knots, upper), uncertainty=1e-5),
        Edge((5, 4), Curve(2, knots, lower)),
    )
    pcurve = Curve(2, knots, np.stack([upper[:, 0] / 2, upper[:, 1] / 2, upper[:, 3]], axis=1))
    hole = (Coedge(5, is_reversed=True), Coedge(4, is_reversed=True, pcurve=pcurve))
    face = replace(plate.faces[0], loops=(*plate.faces[0].loops, hole), name="top")
    return replace(plate, vertices=vertices, edges=edges, faces=(face,), uncertainty=1e-6)


def move(x: float, y: float = 0, z: float = 0) -> FloatArray:
    """The matrix of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def build_content(
    definitions: tuple[Definition, ...], *roots: Placement, up: str = "z"
) -> CadContent:
    """The content of a file in millimetres."""
    return CadContent(definitions, roots or (Placement(0),), READING, 0.001, up)
