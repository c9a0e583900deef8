"""Solids and shells, whose faces share edges and vertices.

A solid has one outer shell and voids; a shell has faces with a flag each that turns the face; the
loops of a face run relative to the normal of its surface, whatever the flag says.

References
----------
IGES 5.3, sections 4.43 (186), 4.50 (502), 4.51 (504), 4.52 (508), 4.53 (510), 4.54 (514).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Coedge, Curve, Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.pieces import cut_between
from service.decoders.cad.splines import drop_z, join, transform
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.readers import Readers
from service.decoders.iges.shapes import measure_size
from service.decoders.iges.sides import pair_curves
from service.decoders.iges.surfaces import BaseSurface
from service.decoders.iges.transformations import combine

SOLID, SHELL, FACE, LOOP, EDGES, VERTICES = 186, 514, 510, 508, 504, 502
"""Types of entities."""

CLOSED_SHELL = 1
"""The form of a closed shell."""

JOINT = 1e-3
"""The curves of a composite edge may be this far apart, as a share of the edge's size."""

_EDGE, _VERTEX = 0, 1


@dataclass(frozen=True, eq=False, slots=True)
class _Use:
    """The use of an edge by a loop: number, curve, direction, and the entry of its pcurve."""

    edge: int
    curve: Curve
    is_reversed: bool
    pcurve: int


@dataclass(frozen=True, eq=False, slots=True)
class _Context:
    """The matrix of all faces of one shell, and the entry of the entity that has it."""

    matrix: FloatArray | None
    owner: int


class SolidReader:
    """Reads solids and shells as parts."""

    def __init__(self, readers: Readers, skip_face: Callable[[int, str], None]) -> None:
        """`skip_face` gets the number of each face that is left out, and the reason."""
        self._file = readers.file
        self._budget = readers.budget
        self._transformations = readers.transformations
        self._curves = readers.curves
        self._surfaces = readers.surfaces
        self._attributes = readers.attributes
        self._skip_face = skip_face
        self._edges: dict[tuple[int, int, int], tuple[int, Curve] | None] = {}

    def read(self, number: int, builder: PartBuilder) -> None:
        """Add the faces of a solid, a shell or a single face to a new part.

        Raises
        ------
        Fault, InvalidGeometry
            The entity itself is damaged; faces that are damaged are left out.
        """
        self._edges = {}
        match self._file.type(number):
            case 186:
                self._read_solid(number, builder)
            case 514:
                is_closed = self._file.read(number, SHELL).form == CLOSED_SHELL
                self._read_shell(builder, number, None, False, is_closed)
            case _:
                faces = self._read_faces(builder, [(number, False)], _Context(None, 0))
                builder.add_shell(faces, False)

    def _read_solid(self, number: int, builder: PartBuilder) -> None:
        """The outer shell and the voids of a solid (186)."""
        entity = self._file.read(number, SOLID)
        parameters = entity.parameters
        matrix = self._transformations.find(entity.matrix)
        count = parameters.count(2, 2)
        for position in (0, *range(3, 3 + 2 * count, 2)):
            is_agreeing = parameters.integer(position + 1, 1)
            self._read_shell(builder, parameters.pointer(position), matrix, not is_agreeing, True)

    def _read_shell(
        self,
        builder: PartBuilder,
        number: int,
        matrix: FloatArray | None,
        is_turned: bool,
        is_closed: bool,
    ) -> None:
        entity = self._file.read(number, SHELL)
        parameters = entity.parameters
        count = parameters.count(0, 2)
        flags = {
            parameters.pointer(1 + 2 * item): bool(parameters.integer(2 + 2 * item, 1)) == is_turned
            for item in range(count)
        }
        own = self._transformations.find(entity.matrix)
        context = _Context(combine(matrix, own), number if own is not None else 0)
        faces = self._read_faces(builder, list(flags.items()), context)
        builder.add_shell(faces, is_closed and len(faces) == len(flags))

    def _read_faces(
        self, builder: PartBuilder, faces: list[tuple[int, bool]], context: _Context
    ) -> list[int]:
        """Add faces and whether they are turned; returns the numbers of those that are read."""
        numbers = []
        for number, is_turned in faces:
            try:
                numbers.append(self._add_face(builder, number, is_turned, context))
            except (Fault, InvalidGeometry) as fault:
                self._skip_face(number, str(fault))
        return numbers

    def _add_face(
        self, builder: PartBuilder, number: int, is_turned: bool, context: _Context
    ) -> int:
        self._budget.add_face()
        entity = self._file.read(number, FACE)
        if entity.matrix:
            raise Unsupported("a face of a shell with a matrix of its own is not read")
        parameters = entity.parameters
        base = self._surfaces.read(parameters.pointer(0))
        base = BaseSurface(base.shape, combine(context.matrix, base.matrix), base.parameters)
        vertices: list[int] = []
        loops = [
            self._read_loop(builder, pointer, context, vertices)
            for pointer in parameters.pointers(3, parameters.count(1))
        ]
        coedges = [[Coedge(use.edge, use.is_reversed) for use in loop] for loop in loops]
        outline = builder.find_outline(coedges, vertices)
        surface = base.cut(outline)
        builder.note_gap(base.find_gap(outline))
        for loop, uses in enumerate(loops):
            for position, use in enumerate(uses):
                pcurve = self._read_pcurve(base, surface, use)
                if pcurve is not None:
                    coedges[loop][position] = Coedge(use.edge, use.is_reversed, pcurve)
        return builder.add_face(
            surface,
            coedges,
            is_reversed=is_turned,
            turns_with_face=False,
            name=self._attributes.find_name(number),
            color=self._attributes.find_color(number),
        )

    def _read_pcurve(self, base: BaseSurface, surface: Surface, use: _Use) -> Curve | None:
        """The curve of parameters of an edge, along the edge; None if it is not known."""
        if not use.pcurve or base.parameters is None:
            return None
        try:
            own = drop_z(self._curves.read_one(use.pcurve))
            pcurve = base.parameters.map_curve(surface, own)
        except (Fault, InvalidGeometry):
            return None
        if pcurve is None:
            return None
        return pair_curves(surface, [use.curve], [pcurve])[0].pcurve

    def _read_loop(
        self, builder: PartBuilder, number: int, context: _Context, vertices: list[int]
    ) -> list[_Use]:
        """The uses of edges of a loop (508); its single vertices are added to `vertices`."""
        entity = self._file.read(number, LOOP)
        if entity.matrix:
            raise Unsupported("a loop with a matrix of its own is not read")
        parameters = entity.parameters
        uses = []
        position = 1
        for _ in range(parameters.count(0, 5)):
            kind, pointer, index = (parameters.integer(position + item) for item in range(3))
            is_agreeing = parameters.integer(position + 3, 1)
            pcurves = parameters.count(position + 4)
            if kind == _VERTEX:
                vertices.append(self._add_vertex(builder, pointer, index, context))
            else:
                edge = self._add_edge(builder, pointer, index, context)
                pcurve = parameters.pointer(position + 6) if pcurves == 1 else 0
                if edge is not None:
                    uses.append(_Use(*edge, not is_agreeing, pcurve))
            position += 5 + 2 * pcurves
        return uses

    def _add_vertex(self, builder: PartBuilder, number: int, index: int, context: _Context) -> int:
        """The number of a vertex of a list (502)."""
        key = ("vertex", context.owner, number, index)
        entity = self._file.read(number, VERTICES)
        if not 1 <= index <= entity.parameters.count(0, 3):
            raise Fault("a vertex is not in its list")
        point = np.append(entity.parameters.numbers(3 * index - 2, 3), 1.0)
        matrix = combine(context.matrix, self._transformations.find(entity.matrix))
        x, y, z = (point if matrix is None else matrix @ point)[:3].tolist()
        return builder.add_vertex(key, (x, y, z))

    def _add_edge(
        self, builder: PartBuilder, number: int, index: int, context: _Context
    ) -> tuple[int, Curve] | None:
        """The number and the curve of an edge of a list (504); None if the edge is a point."""
        key = context.owner, number, index
        if key in self._edges:
            return self._edges[key]
        entity = self._file.read(number, EDGES)
        parameters = entity.parameters
        if not 1 <= index <= parameters.count(0, 5):
            raise Fault("an edge is not in its list")
        start = 5 * index - 4
        first, last = (
            self._add_vertex(
                builder,
                parameters.pointer(start + item),
                parameters.integer(start + item + 1),
                context,
            )
            for item in (1, 3)
        )
        curves = self._curves.read(parameters.pointer(start))
        matrix = combine(context.matrix, self._transformations.find(entity.matrix))
        if matrix is not None:
            curves = [transform(curve, matrix) for curve in curves]
        size = max(measure_size(curve) for curve in curves)
        curve = join(curves, JOINT * size)
        ends = builder.find_point(first), builder.find_point(last)
        tolerance = builder.uncertainty or 0.0
        if first == last and size <= tolerance:
            self._edges[key] = None
            return None
        piece = cut_between(curve, *ends, is_loop=first == last, tolerance=tolerance)
        curve = piece.curve or curve
        is_line = len(curve.points) == 2 and piece.gap <= tolerance
        edge = builder.add_edge(
            ("edge", *key), (first, last), None if is_line else curve, gap=piece.gap
        )
        self._edges[key] = edge, curve
        return edge, curve
