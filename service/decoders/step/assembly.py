"""Definitions and placements of what the tree of a file holds.

All lengths are converted to the unit of the first root: the first one that its representations
state, or else those below it.
"""

from collections.abc import Iterable

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Definition, Part, Placement
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faces import FACES
from service.decoders.step.faults import Fault
from service.decoders.step.placements import map_between, read_matrix
from service.decoders.step.records import as_reference
from service.decoders.step.representations import Representation, Representations
from service.decoders.step.solids import MODELS, PARTS, SOLIDS, PartReader
from service.decoders.step.structure import MAPPED, Link, Node, Structure
from service.decoders.step.styles import Styles
from service.decoders.step.tally import Tally
from service.decoders.step.units import Units

_NO_GEOMETRY = (
    "AXIS2_PLACEMENT_3D",
    "AXIS1_PLACEMENT",
    "CARTESIAN_TRANSFORMATION_OPERATOR_3D",
    "CARTESIAN_POINT",
    "DIRECTION",
    MAPPED,
)
"""Items that are no geometry of their own."""


class Assembler:
    """Makes the definitions of a structure.

    Attributes
    ----------
    metres : float or None
        The unit of the root.
    seen : set of int
        Numbers of items of representations: read, or counted as skipped.
    """

    def __init__(
        self,
        entities: Entities,
        representations: Representations,
        structure: Structure,
        styles: Styles,
        tally: Tally,
    ) -> None:
        self._entities = entities
        self._representations = representations
        self._structure = structure
        self._styles = styles
        self._tally = tally
        self.seen: set[int] = set()
        self.parts = PartReader(entities, styles, tally)
        self.metres = self._find_metres()

    def build(self) -> tuple[list[Definition], list[Placement]]:
        """All definitions, and the placements of the roots."""
        nodes, roots = self._structure.nodes, self._structure.roots
        numbers = {number: index for index, number in enumerate(nodes)}
        definitions = [
            Definition(node.name, tuple(self._read_parts(node)), self._place(node, numbers))
            for node in nodes.values()
        ]
        placements = [Placement(numbers[root]) for root in roots]
        return definitions, placements

    def build_loose(self) -> Definition:
        """The solids and surface models that are in no representation which is reached."""
        parts: list[Part] = []
        for entity in self._entities.read_all(*SOLIDS, *MODELS):
            if isinstance(entity, Entity) and entity.number not in self.seen:
                self.seen.add(entity.number)
                parts += self._read_part(entity.number, Units())
        return Definition("", tuple(parts))

    def _find_metres(self) -> float | None:
        nodes = self._structure.nodes
        for number in (*self._structure.roots, *nodes):
            for representation in self._read_representations(nodes[number]):
                if representation.units.metres is not None:
                    return representation.units.metres
        return None

    def _read_representations(self, node: Node) -> Iterable[Representation]:
        for number in node.representations:
            try:
                yield self._representations.read(number)
            except Fault:
                continue

    def _read_parts(self, node: Node) -> Iterable[Part]:
        for representation in self._read_representations(node):
            faces: list[int] = []
            for item in representation.items:
                keyword = self._keyword(item)
                if keyword in FACES:
                    faces.append(item)
                elif keyword in PARTS:
                    yield from self._read_part(item, representation.units)
                elif keyword not in _NO_GEOMETRY and item not in self.seen:
                    self._tally.skip(keyword or "missing entities")
                self.seen.add(item)
            if faces:
                part = self.parts.read_faces(faces, representation.units, self.metres)
                if part is not None:
                    yield part

    def _read_part(self, number: int, units: Units) -> Iterable[Part]:
        try:
            part = self.parts.read(number, units, self.metres)
        except Fault:
            self._tally.skip(self._keyword(number))
            return
        if part is not None:
            yield part

    def _keyword(self, number: int) -> str:
        """The type of an entity; empty if there is none, or it is malformed."""
        keyword = self._entities.find_keyword(number)
        if keyword.isidentifier():
            return keyword
        try:
            return self._entities.read(number).keyword
        except Fault:
            return ""

    def _place(self, node: Node, numbers: dict[int, int]) -> tuple[Placement, ...]:
        placements = []
        for link in node.links:
            try:
                matrix = self._read_transformation(node, link)
            except (InvalidGeometry, ArithmeticError):
                # An instance in the wrong place is worse than one that is missing.
                self._tally.skip("placements of products")
                continue
            color = self._styles.find(link.styled)
            placements.append(Placement(numbers[link.child], link.name, matrix, color))
        return tuple(placements)

    def _read_transformation(self, node: Node, link: Link) -> FloatArray | None:
        """The matrix of a link, in the root's unit; None for the identity."""
        if link.kind == "plain":
            return None
        if link.kind == "mapped":
            item = self._entities.read_as(link.source, MAPPED)
            source = self._entities.read_as(as_reference(item.parameter(1)), "REPRESENTATION_MAP")
            return map_between(
                self._read_placed(
                    as_reference(source.parameter(0)), as_reference(source.parameter(1))
                ),
                self._read_placed(as_reference(item.parameter(2)), link.within),
            )
        relationship = self._representations.placed[link.source]
        first, second = relationship.first, relationship.second
        entity = self._entities.read(relationship.transformation)
        if entity.keyword != "ITEM_DEFINED_TRANSFORMATION":
            return read_matrix(self._entities, entity.number, self._factor(second))
        items = [as_reference(entity.parameter(2)), as_reference(entity.parameter(3))]
        owners = self._structure.owners
        if owners.get(first) == node.number and owners.get(second) != node.number:
            # The first representation is that of the assembly, against the rule.
            first, second = second, first
            items.reverse()
        return map_between(self._read_placed(items[0], first), self._read_placed(items[1], second))

    def _read_placed(self, placement: int, representation: int) -> FloatArray:
        return read_matrix(self._entities, placement, self._factor(representation))

    def _factor(self, representation: int) -> float:
        return self._representations.read(representation).units.factor(self.metres)
