"""Products: their names, their representations, and where they occur in each other.

References
----------
ISO 10303-41: product, product_definition, product_definition_shape,
shape_definition_representation;
ISO 10303-44: next_assembly_usage_occurrence;
ISO 10303-47 and AP203, AP214, AP242: context_dependent_shape_representation.
"""

import re
from dataclasses import dataclass, field

from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faults import Fault
from service.decoders.step.records import as_reference, as_text
from service.decoders.step.tally import Tally

OCCURRENCE = "NEXT_ASSEMBLY_USAGE_OCCURRENCE"
_NAMELESS = "=>["
"""The beginning of the name that Open CASCADE writes for an occurrence without one."""

_MADE_NAME = re.compile(r"Open CASCADE STEP translator [\d. ]+")
"""The name that Open CASCADE writes for a product without one."""

_DEFINITION_LENGTH = 4  # id, description, formation, frame of reference


@dataclass(slots=True)
class Product:
    """A product definition.

    Attributes
    ----------
    number : int
    name : str
    representations : list of int
        As the file names them; those that are related to them come later.
    """

    number: int
    name: str
    representations: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A product in another one.

    Attributes
    ----------
    number, parent, child : int
    name : str
    placement : int or None
        The number of the CONTEXT_DEPENDENT_SHAPE_REPRESENTATION.
    relationship : int or None
        The number of the relationship of representations that places the product.
    """

    number: int
    parent: int
    child: int
    name: str
    placement: int | None = None
    relationship: int | None = None


@dataclass(frozen=True, slots=True)
class Products:
    """The products of a file by number, in the order of the file, and their occurrences."""

    products: dict[int, Product]
    occurrences: tuple[Occurrence, ...]


def read_products(entities: Entities, tally: Tally) -> Products:
    """Read all products that have a shape or are part of an assembly."""
    reader = _ProductReader(entities, tally)
    occurrences = reader.read_occurrences()
    reader.read_shapes()
    return Products(reader.products, occurrences)


class _ProductReader:
    def __init__(self, entities: Entities, tally: Tally) -> None:
        self._entities = entities
        self._tally = tally
        self._described: dict[int, int | None] = {}
        self.products: dict[int, Product] = {}

    def read_occurrences(self) -> tuple[Occurrence, ...]:
        """The occurrences, with what places them."""
        found: dict[int, Occurrence] = {}
        for entity in self._entities.read_all(OCCURRENCE):
            try:
                occurrence = self._read_occurrence(entity)
            except Fault:
                self._tally.skip(OCCURRENCE)
                continue
            found[occurrence.number] = occurrence
        for entity in self._entities.read_all("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"):
            if isinstance(entity, Fault):
                continue
            try:
                relationship = as_reference(entity.parameter(0))
                described = self._find_described(as_reference(entity.parameter(1)))
            except Fault:
                continue
            if described in found and found[described].placement is None:
                old = found[described]
                found[described] = Occurrence(
                    old.number, old.parent, old.child, old.name, entity.number, relationship
                )
        return tuple(found.values())

    def read_shapes(self) -> None:
        """Find the representations of each product."""
        keywords = ("SHAPE_DEFINITION_REPRESENTATION", "PROPERTY_DEFINITION_REPRESENTATION")
        for entity in self._entities.read_all(*keywords):
            if isinstance(entity, Fault):
                continue
            try:
                property_ = self._entities.read(as_reference(entity.parameter(0)))
                if not property_.has_parts("PRODUCT_DEFINITION_SHAPE"):
                    continue
                described = self._find_described(property_.number)
                representation = as_reference(entity.parameter(1))
                if described is not None and self._add_product(described):
                    self.products[described].representations.append(representation)
            except Fault:
                continue

    def _read_occurrence(self, entity: Entity | Fault) -> Occurrence:
        if isinstance(entity, Fault):
            raise entity
        parts = entity.parts
        attributes = parts.get("PRODUCT_DEFINITION_RELATIONSHIP") or parts[OCCURRENCE]
        if len(attributes) < 5:
            raise Fault("a parameter is missing")
        parent, child = as_reference(attributes[3]), as_reference(attributes[4])
        if not (self._add_product(parent) and self._add_product(child)):
            raise Fault("an occurrence is not one of a product")
        designator = attributes[5] if len(attributes) > 5 else "$"
        name = as_text(attributes[1]) or as_text(designator)
        if name.startswith(_NAMELESS):
            name = ""
        return Occurrence(entity.number, parent, child, name)

    def _find_described(self, number: int) -> int | None:
        """The entity whose shape a PRODUCT_DEFINITION_SHAPE is; None if it is malformed."""
        if number not in self._described:
            try:
                entity = self._entities.read(number)
                parameters = entity.parts.get("PROPERTY_DEFINITION") or entity.parameters
                self._described[number] = as_reference(parameters[2])
            except (Fault, IndexError):
                self._described[number] = None
        return self._described[number]

    def _add_product(self, number: int) -> bool:
        """Read a product definition, if the entity with this number is one."""
        if number in self.products:
            return True
        try:
            entity = self._entities.read(number)
        except Fault:
            return False
        keywords = [keyword for keyword in entity.parts if keyword.startswith("PRODUCT_DEFINITION")]
        if not keywords or "PRODUCT_DEFINITION_SHAPE" in keywords:
            return False
        self.products[number] = Product(number, self._read_name(entity))
        return True

    def _read_name(self, definition: Entity) -> str:
        """The name of the product that is defined, or else its id.

        A name that Open CASCADE has made, since the product had none, is none.
        """
        try:
            parameters = next(
                each for each in definition.parts.values() if len(each) >= _DEFINITION_LENGTH
            )
            formation = self._entities.read(as_reference(parameters[2]))
            parameters = next(each for each in formation.parts.values() if len(each) >= 3)
            product = self._entities.read(as_reference(parameters[2]))
            parameters = product.parts["PRODUCT"]
            name, identifier = as_text(parameters[1]), as_text(parameters[0])
            is_made = not name or _MADE_NAME.fullmatch(name)
            return (identifier or name) if is_made else name
        except (Fault, IndexError, KeyError, StopIteration):
            return ""
