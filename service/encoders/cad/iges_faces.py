"""Faces as IGES entities: trimmed surfaces (144) of B-splines, with colours and names.

A loop is a curve on the surface (142): a curve of space, which is the edges of the loop, and the
same in parameters if these are lines along the border of the surface. Other parameter curves are
left out: readers prefer them to edges, whatever the file says, and they may be less exact. A face
that is its whole surface, with a pole or a seam, has no loop: its outer border is the natural one.
Surfaces of reversed faces are written with u running backwards, so that du × dv is the normal.

References
----------
IGES 5.3 (US PRO/IPO-100-1996): the entities of types 110, 126, 128, 102, 142, 144, 314, and 406
form 15.
"""

from collections.abc import Sequence

import numpy as np

from service.encoders.cad.assembly import Definition
from service.encoders.cad.iges_borders import find_borders, sort_loops
from service.encoders.cad.iges_records import Entities, list_numbers, write_reals, write_string
from service.surface.brep_columns import list_colors
from service.surface.brep_model import BrepModel
from service.surface.lowered import Color
from service.surface.spline_tables import CurveTable

DEPENDENT = "00010000"
"""The status of entities that are only a part of another one."""

IN_PARAMETERS = "00010500"
"""The status of curves in the parameters of a surface."""

DEFINITION = "00020200"
"""The status of definitions: of colours, and of names."""

SPACE = 2
"""The preference of a curve of space over that in parameters."""


class FaceWriter:
    """Adds the faces of definitions, and their names and colours, to the entities of a file.

    `scale` is the factor by which coordinates are multiplied.
    """

    def __init__(self, entities: Entities, scale: float) -> None:
        self.entities = entities
        self.scale = scale
        self._colors: dict[Color, int] = {}

    def write_name(self, name: str) -> int:
        """The property with a name; 0 without one."""
        if not name:
            return 0
        return self.entities.add(406, ["1", write_string(name)], form=15, status=DEFINITION)

    def _find_color(self, color: Color | None) -> int:
        """The number of a colour; 0 without one. IGES has no opacity."""
        if color is None:
            return 0
        if color not in self._colors:
            shares = write_reals(100 * np.array(color[:3]))
            self._colors[color] = self.entities.add(314, shares, status=DEFINITION)
        return self._colors[color]

    def write_faces(self, definition: Definition) -> list[int]:
        """The trimmed surfaces of all bodies of a definition."""
        faces = []
        for body in definition.transformed_bodies(self.scale):
            faces += self._write_body(body, definition.color)
        return faces

    def _write_body(self, body: BrepModel, color: Color | None) -> list[int]:
        """The trimmed surfaces of a brep."""
        loops: dict[int, list[int]] = {}
        for loop, face in enumerate(body.loop_faces.tolist()):
            loops.setdefault(face, []).append(loop)
        face_colors = list_colors(body.palette, body.face_colors)
        borders = find_borders(body)
        numbers = []
        for face in sorted(body.shell_faces.tolist()):
            surface = self._write_surface(body, face)
            bounds = []
            if not borders.is_whole[face]:
                own = sort_loops(body, loops.get(face, []))
                bounds = [
                    self._write_loop(body, loop, surface, has_lines=bool(borders.has_lines[loop]))
                    for loop in own
                ]
            outer = f"1,{max(len(bounds) - 1, 0)},{list_numbers(bounds)}" if bounds else "0,0,0"
            name = self.write_name(body.face_names[face])
            tail = f",0,1,{name}" if name else ""
            own_color = face_colors[face]
            numbers.append(
                self.entities.add(
                    144,
                    f"{surface},{outer}{tail}",
                    color=self._find_color(color if own_color is None else own_color),
                    status=DEPENDENT,
                )
            )
        return numbers

    def _write_surface(self, body: BrepModel, face: int) -> int:
        """The surface of a face, a B-spline (128); u runs backwards if the face is reversed."""
        table = body.surfaces
        (p, q), (rows, columns) = table.degrees[face].tolist(), table.counts[face].tolist()
        begin, end = table.point_starts[face : face + 2].tolist()
        points = table.points[begin:end].reshape(rows, columns, 3)
        weights = table.weights[begin:end].reshape(rows, columns)
        first, middle, last = table.knot_starts[2 * face : 2 * face + 3].tolist()
        u, v, domain = table.knots[first:middle], table.knots[middle:last], table.domains[face]
        if body.is_reversed[face]:
            points, weights, u = points[::-1], weights[::-1], domain[0].sum() - u[::-1]
        # In the file u varies fastest.
        numbers = (u, v, weights.T.ravel(), points.swapaxes(0, 1).ravel(), domain.ravel())
        text = write_reals(np.concatenate(numbers))
        is_polynomial = int(not table.is_rational[face])
        head = f"{rows - 1},{columns - 1},{p},{q},0,0,{is_polynomial},0,0"
        return self.entities.add(128, f"{head},{text}", status=DEPENDENT)

    def _write_loop(self, body: BrepModel, loop: int, surface: int, *, has_lines: bool) -> int:
        """A loop of a face (142): curves of space, and in parameters if these are lines.

        The face is on the left against du × dv of its surface in the file.
        """
        face = body.loop_faces.item(loop)
        is_flipped = bool(body.is_reversed[face])
        coedges = list(range(body.loop_starts.item(loop), body.loop_starts.item(loop + 1)))
        coedges = coedges[::-1] if is_flipped else coedges
        edges = body.coedge_edges[coedges].tolist()
        is_turned = (body.coedge_reversed[coedges] ^ is_flipped).tolist()
        curves = [
            self._write_curve(body.curves, body.edge_curves.item(edge), turned, DEPENDENT)
            for edge, turned in zip(edges, is_turned, strict=True)
            if body.edge_curves.item(edge) >= 0
        ]
        in_parameters = 0
        if has_lines:
            # The sum of both ends of u, from which u is subtracted if it runs backwards.
            mirror = float(body.surfaces.domains[face, 0].sum()) if is_flipped else None
            lines = [
                self._write_curve(body.pcurves, pcurve, turned, IN_PARAMETERS, mirror)
                for pcurve, turned in zip(
                    body.coedge_pcurves[coedges].tolist(), is_turned, strict=True
                )
            ]
            in_parameters = self._join(lines, IN_PARAMETERS)
        in_space = self._join(curves, DEPENDENT)
        return self.entities.add(
            142, f"0,{surface},{in_parameters},{in_space},{SPACE}", status=DEPENDENT
        )

    def _join(self, curves: Sequence[int], status: str) -> int:
        """The curves as one, a composite curve if they are several; 0 without any."""
        if len(curves) > 1:
            return self.entities.add(102, f"{len(curves)},{list_numbers(curves)}", status=status)
        return curves[0] if curves else 0

    def _write_curve(
        self,
        table: CurveTable,
        curve: int,
        is_turned: bool,
        status: str,
        mirror: float | None = None,
    ) -> int:
        """A curve in the direction of its loop: a line (110) or a B-spline (126).

        Parameters (u, v) become (`mirror` − u, v) if `mirror` is given.
        """
        begin, end = table.point_starts[curve : curve + 2].tolist()
        points, weights = table.points[begin:end], table.weights[begin:end]
        if points.shape[1] == 2:
            points = np.pad(points, ((0, 0), (0, 1)))
            if mirror is not None:
                points[:, 0] = mirror - points[:, 0]
        first, last = table.knot_starts[curve : curve + 2]
        degree, knots = table.degrees.item(curve), table.knots[first:last]
        is_rational = bool(table.is_rational[curve])
        if is_turned:
            points, weights = points[::-1], weights[::-1]
            knots = table.domains[curve].sum() - knots[::-1]
        if degree == 1 and len(points) == 2 and not is_rational:
            return self.entities.add(110, write_reals(points), status=status)
        domain = knots[[degree, len(knots) - 1 - degree]]
        numbers = np.concatenate([knots, weights, points.ravel(), domain, np.zeros(3)])
        head = f"{len(points) - 1},{degree},0,0,{int(not is_rational)},0"
        return self.entities.add(126, f"{head},{write_reals(numbers)}", status=status)
