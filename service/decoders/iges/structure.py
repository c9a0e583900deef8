"""The products of a file: its faces, solids, groups, and subfigures that are placed many times.

Trimmed faces of one level (the file's root, or one subfigure) are joined with each other, whatever
groups they are in. A named group of several parts becomes a product; other groups only give their
name to a part.

References
----------
IGES 5.3, sections 4.41 (184), 4.69 (308), 4.90 (402), 4.127 (408) and 4.132 (430).
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Definition, Placement
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.parts import PartBuilder
from service.decoders.iges.entities import MAX_NESTING, Entity
from service.decoders.iges.faults import Fault
from service.decoders.iges.feet import find_periods
from service.decoders.iges.groups import Groups
from service.decoders.iges.joining import join_sides
from service.decoders.iges.readers import Readers
from service.decoders.iges.references import GROUP, find_reached, list_children
from service.decoders.iges.report import Report
from service.decoders.iges.shells import add_component, find_components
from service.decoders.iges.solids import FACE, SHELL, SOLID, VERTICES, SolidReader
from service.decoders.iges.surfaces import TYPES as SURFACES
from service.decoders.iges.tolerances import choose_tolerances, limit_tolerance
from service.decoders.iges.transformations import combine
from service.decoders.iges.trimmed import FACES, TrimmedFace, TrimmedReader

SOLIDS = frozenset({SOLID, SHELL, FACE})
INSTANCES = frozenset({408, 430})
ASSEMBLY, SUBFIGURE = 184, 308
ROOT_TYPES = FACES | SOLIDS | INSTANCES | SURFACES | {ASSEMBLY, GROUP}
"""Types of entities that are read if no other entity consists of them."""


class Structure:
    """Reads the products of a file.

    Attributes
    ----------
    definitions : list of Definition
    used : set of int
        The entities that are in the surface, or in the report as faces that are not.
    """

    def __init__(self, readers: Readers, report: Report) -> None:
        self.definitions: list[Definition] = []
        self.used: set[int] = set()
        self._readers = readers
        self._file = readers.file
        self._trimmed = TrimmedReader(readers)
        self._solids = SolidReader(readers, report.skip_face)
        self._report = report
        self._products: dict[int, int | None] = {}

    def read_level(self, name: str, members: Sequence[int], depth: int = 0) -> int:
        """The number of a definition with all that is in these entities."""
        groups = Groups(name, self._readers, ROOT_TYPES, members)
        self.used.update(groups.owners)
        self._skip_hidden(groups.hidden)
        self._join_faces(groups)
        for number in groups.owners:
            kind = self._file.type(number)
            if kind in SOLIDS:
                self._read_solid(number, groups)
            elif kind in INSTANCES or kind == ASSEMBLY:
                for placement in self._read_placements(number, depth):
                    groups.add_placement(number, placement)
        return groups.compose(self.definitions)

    def _skip_hidden(self, numbers: Sequence[int]) -> None:
        """Report entities that are not to be shown, and the faces of which they consist."""
        for number in numbers:
            self._report.skipped_entities[f"type {self._file.type(number)} (blanked)"] += 1
        self._skip_faces(numbers, "it is blanked: not to be shown")

    def _skip_faces(self, numbers: Sequence[int], reason: str) -> bool:
        """Report all faces of which entities consist; returns whether there are any."""
        self.used.update(numbers)
        faces = [number for number in numbers if self._file.type(number) in SURFACES]
        with suppress(Fault):
            reached = {each: self._file.type(each) for each in self._find_reached(numbers)}
            faces += [each for each, kind in reached.items() if kind in FACES or kind == FACE]
        for number in faces:
            self._report.skip_face(number, reason)
        return bool(faces)

    def _find_reached(self, numbers: Sequence[int]) -> set[int]:
        """The entities of which some entities consist, these included.

        Raises
        ------
        Fault
            Too many entities consist of the same ones.
        """
        budget = self._readers.budget
        budget.visit()
        reached = find_reached(self._file, numbers)
        budget.visit(len(reached))
        return reached

    def _join_faces(self, groups: Groups) -> None:
        """Read trimmed faces, join them, and add a part for each set of connected faces."""
        faces: list[TrimmedFace] = []
        for number in groups.owners:
            kind = self._file.type(number)
            if kind not in FACES and kind not in SURFACES:
                continue
            try:
                faces.append(self._trimmed.read(number))
            except (Fault, InvalidGeometry) as fault:
                self._report.skip_face(number, str(fault))
        if not faces:
            return
        tolerance, most = choose_tolerances(self._file.header.resolution, faces)
        joined, faults = join_sides(
            [face.loops for face in faces],
            [any(find_periods(face.surface)) for face in faces],
            tolerance,
            most,
        )
        for position, reason in faults.items():
            self._report.skip_face(faces[position].number, reason)
        for component in find_components(joined, faces, faults):
            members = [faces[position].number for position in component.faces]
            name = self._readers.attributes.find_name(members[0]) if len(members) == 1 else ""
            builder = PartBuilder(name, tolerance)
            try:
                add_component(component, joined, faces, self._readers.attributes, builder)
            except InvalidGeometry as fault:
                for number in members:
                    self._report.skip_face(number, str(fault))
                continue
            self._report.open_edges += component.open_edges
            self._add_part(builder, groups, members)

    def _read_solid(self, number: int, groups: Groups) -> None:
        try:
            vertices = self._list_vertices(number)
        except Fault as fault:
            self._report.skip_face(number, str(fault))
            return
        tolerance = limit_tolerance(self._file.header.resolution, vertices)
        attributes = self._readers.attributes
        builder = PartBuilder(
            attributes.find_name(number), tolerance, attributes.find_color(number)
        )
        try:
            self._solids.read(number, builder)
        except (Fault, InvalidGeometry) as fault:
            if not self._skip_faces([number], str(fault)):
                self._report.skip_face(number, str(fault))
        self._report.solids += self._file.type(number) == SOLID
        self._add_part(builder, groups, [number])

    def _list_vertices(self, number: int) -> FloatArray:
        """The vertices of a solid, (k, 3)."""
        lists = []
        for each in sorted(self._find_reached([number])):
            if self._file.type(each) == VERTICES:
                with suppress(Fault):
                    parameters = self._file.read(each).parameters
                    lists.append(parameters.numbers(1, 3 * parameters.count(0, 3)).reshape(-1, 3))
        return np.concatenate(lists) if lists else np.zeros((1, 3))

    def _add_part(self, builder: PartBuilder, groups: Groups, members: Sequence[int]) -> None:
        part = builder.build()
        self._report.note_part(builder)
        if part is None:
            return
        closed = sum(shell.is_closed for shell in part.shells)
        self._report.closed_shells += closed
        self._report.open_shells += len(part.shells) - closed
        groups.add_part(members, part)

    def _read_placements(self, number: int, depth: int) -> list[Placement]:
        """The instances of an entity: one, or those of all items of an assembly."""
        try:
            entity = self._file.read(number)
            matrix = self._readers.transformations.find(entity.matrix)
            if entity.type != ASSEMBLY:
                pointer = entity.parameters.pointer(0)
                if entity.type == 408:
                    matrix = combine(matrix, _read_position(entity))
                return [self._place(number, pointer, matrix, depth)]
            count = entity.parameters.count(0, 2)
        except Fault:
            self._report.skipped_entities[f"type {self._file.type(number)}"] += 1
            return []
        placements = []
        for item in range(count):
            try:
                pointer, own = (entity.parameters.pointer(1 + item + shift) for shift in (0, count))
                item_matrix = combine(matrix, self._readers.transformations.find(own))
                placements.append(self._place(pointer, pointer, item_matrix, depth))
            except Fault:
                self._report.skipped_entities["type 184, an item"] += 1
        return placements

    def _place(self, number: int, pointer: int, matrix: FloatArray | None, depth: int) -> Placement:
        """An instance of what a pointer leads to, with the name and the colour of an entity.

        Raises
        ------
        Fault
        """
        if pointer not in self._products:
            self._products[pointer] = None  # until it is read: nothing is inside itself
            self._products[pointer] = self._read_product(pointer, depth + 1)
        definition = self._products[pointer]
        if definition is None:
            raise Fault("an instance is not read")
        return Placement(
            definition,
            self._readers.attributes.find_name(number),
            matrix,
            self._readers.attributes.find_color(number),
        )

    def _read_product(self, number: int, depth: int) -> int | None:
        """The number of the definition of a subfigure, a solid or an assembly; None for others."""
        kind = self._file.type(number)
        if depth == MAX_NESTING:
            return None
        self.used.add(number)
        if kind == SUBFIGURE:
            entity = self._file.read(number)
            children = list_children(self._file, number)
            matrix = self._readers.transformations.find(entity.matrix)
            level = self.read_level(entity.parameters.text(1), children, depth)
            if matrix is None:
                return level
            self.definitions.append(
                Definition(entity.parameters.text(1), (), (Placement(level, matrix=matrix),))
            )
            return len(self.definitions) - 1
        if kind in SOLIDS or kind in INSTANCES or kind == ASSEMBLY:
            return self.read_level(self._readers.attributes.find_name(number), [number], depth)
        return None


def _read_position(entity: Entity) -> FloatArray | None:
    """The matrix of a subfigure instance (408): it is scaled, and then moved."""
    x, y, z = entity.parameters.numbers(1, 3).tolist() if len(entity.parameters) > 3 else (0, 0, 0)
    factor = entity.parameters.number(4, 1.0)
    if not factor > 0:
        raise Fault("an instance has no size")
    if (x, y, z, factor) == (0, 0, 0, 1):
        return None
    matrix = np.diag([factor, factor, factor, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix
