"""Representations: sets of items with units, and how they are related.

References
----------
ISO 10303-43, clause 4: representation, representation_relationship,
representation_relationship_with_transformation, mapped_item.
"""

from dataclasses import dataclass

from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faults import Fault
from service.decoders.step.records import (
    Parameter,
    as_list,
    as_reference,
    as_text,
    is_omitted,
)
from service.decoders.step.units import UnitReader, Units

_RELATIONSHIPS = (
    "SHAPE_REPRESENTATION_RELATIONSHIP",
    "REPRESENTATION_RELATIONSHIP",
    "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION",
)
_OTHER_REPRESENTATIONS = (
    "PRESENTATION_REPRESENTATION",
    "DEFINITION_REPRESENTATION",
    "DEFINITIONAL_REPRESENTATION",
    "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
)


@dataclass(frozen=True, slots=True)
class Representation:
    """A set of items.

    Attributes
    ----------
    number : int
    name : str
    items : tuple of int
        Numbers of entities, each once.
    units : Units
    """

    number: int
    name: str
    items: tuple[int, ...]
    units: Units


@dataclass(frozen=True, slots=True)
class Relationship:
    """Two representations, the first placed in the second by a transformation."""

    number: int
    first: int
    second: int
    transformation: int


class Representations:
    """The representations of a file, each read once."""

    def __init__(self, entities: Entities) -> None:
        self._entities = entities
        self._units = UnitReader(entities)
        self._read: dict[int, Representation] = {}
        self.equal: dict[int, list[int]] = {}
        """For each representation those of the same thing: relationships without transformation."""
        self.placed: dict[int, Relationship] = {}
        """Relationships with a transformation, by number."""
        for entity in entities.read_all(*_RELATIONSHIPS):
            if isinstance(entity, Entity):
                self._read_relationship(entity)

    @property
    def units(self) -> list[Units]:
        """The units of the representations that have been read."""
        return [each.units for each in self._read.values()]

    def read(self, number: int) -> Representation:
        """The representation with a number.

        Raises
        ------
        Fault
        """
        if number not in self._read:
            entity = self._entities.read(number)
            name, items, context = _attributes(entity)
            found = dict.fromkeys(
                as_reference(item)
                for item in as_list(items)
                if isinstance(item, str) and item[:1] == "#"
            )
            units = self._units.read_context(None if is_omitted(context) else as_reference(context))
            self._read[number] = Representation(number, as_text(name), tuple(found), units)
        return self._read[number]

    def claim(self, number: int, owner: int, owners: dict[int, int]) -> list[int]:
        """Give a representation, and all those of the same thing, to an owner.

        Parameters
        ----------
        owners : dict
            The owner of each representation that has one; each has one at most.

        Returns
        -------
        list of int
            The representations that had no owner.
        """
        found, pending = [], [number]
        while pending:
            current = pending.pop()
            if current not in owners:
                owners[current] = owner
                found.append(current)
                pending.extend(reversed(self.equal.get(current, ())))
        return found

    def _read_relationship(self, entity: Entity) -> None:
        parts = entity.parts
        attributes = parts.get("REPRESENTATION_RELATIONSHIP") or parts.get(
            "SHAPE_REPRESENTATION_RELATIONSHIP"
        )
        moving = parts.get("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")
        if attributes is None and moving is not None and len(moving) >= 5:
            attributes = moving  # a simple instance has all attributes in one record
        try:
            if attributes is None or len(attributes) < 4:
                raise Fault("a parameter is missing")
            first, second = as_reference(attributes[2]), as_reference(attributes[3])
            if moving:
                self.placed[entity.number] = Relationship(
                    entity.number, first, second, as_reference(moving[-1])
                )
                return
        except Fault:
            return
        self.equal.setdefault(first, []).append(second)
        self.equal.setdefault(second, []).append(first)


def is_representation(keyword: str) -> bool:
    """Whether a keyword names a representation of shape, not of a picture or of a pcurve."""
    return keyword.endswith("REPRESENTATION") and not keyword.endswith(_OTHER_REPRESENTATIONS)


def _attributes(entity: Entity) -> tuple[Parameter, Parameter, Parameter]:
    """Name, items and context."""
    parameters = entity.parts.get("REPRESENTATION")
    if parameters is None:
        # A simple instance, or a subtype that has the attributes in its own record.
        candidates = [
            each for keyword, each in entity.parts.items() if keyword.endswith("REPRESENTATION")
        ]
        parameters = next((each for each in candidates if len(each) >= 2), None)
    if parameters is None or len(parameters) < 2:
        raise Fault(f"#{entity.number} is not a representation")
    context = parameters[2] if len(parameters) > 2 else "$"
    return parameters[0], parameters[1], context
