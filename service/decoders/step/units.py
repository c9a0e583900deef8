"""Units: each representation has a context, with units of its own for lengths and angles.

References
----------
ISO 10303-41, clause 21 (measure_schema): SI units, conversion-based units;
ISO 10303-43, clause 4.4.1: contexts.
"""

from dataclasses import dataclass
from math import isclose, isfinite, pi

from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faults import Fault
from service.decoders.step.records import (
    MAX_NESTING,
    Parameter,
    Typed,
    as_enumeration,
    as_list,
    as_number,
    as_reference,
    as_text,
)

MAX_METRES = 1e6
"""The longest unit of length."""

PREFIXES = {
    "EXA": 1e18,
    "PETA": 1e15,
    "TERA": 1e12,
    "GIGA": 1e9,
    "MEGA": 1e6,
    "KILO": 1e3,
    "HECTO": 1e2,
    "DECA": 1e1,
    "DECI": 1e-1,
    "CENTI": 1e-2,
    "MILLI": 1e-3,
    "MICRO": 1e-6,
    "NANO": 1e-9,
    "PICO": 1e-12,
    "FEMTO": 1e-15,
    "ATTO": 1e-18,
}

_KNOWN_LENGTHS = {"inch": 0.0254, "foot": 0.3048, "yard": 0.9144, "mile": 1609.344, "mil": 2.54e-5}
_MAX_UNITS = 32  # of one context


@dataclass(frozen=True, slots=True)
class Units:
    """The units of a representation.

    Attributes
    ----------
    metres : float or None
        Metres in one unit of length; None if the file does not say.
    radians : float
        Radians in one unit of plane angle.
    uncertainty : float or None
        In metres, or in the unknown unit of length.
    name : str
        The unit of length, such as `inch`; empty if the file does not say.
    """

    metres: float | None = None
    radians: float = 1.0
    uncertainty: float | None = None
    name: str = ""

    def factor(self, metres: float | None) -> float:
        """By what lengths are multiplied that are in these units and are wanted in others."""
        return self.metres / metres if self.metres is not None and metres is not None else 1.0


@dataclass(frozen=True, slots=True)
class _Unit:
    quantity: str
    factor: float
    name: str


class UnitReader:
    """Reads contexts, each once."""

    def __init__(self, entities: Entities) -> None:
        self._entities = entities
        self._contexts: dict[int, Units] = {}

    def read_context(self, number: int | None) -> Units:
        """The units of a context; what is malformed counts as missing."""
        if number is None:
            return Units()
        if number not in self._contexts:
            self._contexts[number] = self._read_context(number)
        return self._contexts[number]

    def _read_context(self, number: int) -> Units:
        try:
            entity = self._entities.read(number)
        except Fault:
            return Units()
        metres, radians, name = None, 1.0, ""
        for unit in map(self._read_unit, _items_of(entity, "GLOBAL_UNIT_ASSIGNED_CONTEXT")):
            if unit is None:
                continue
            if unit.quantity == "METRE" and 0.0 < unit.factor <= MAX_METRES:
                metres, name = unit.factor, unit.name
            elif unit.quantity == "RADIAN":
                radians = unit.factor
        measures = _items_of(entity, "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT")
        values = [value for value in map(self._read_uncertainty, measures) if value is not None]
        return Units(metres, radians, max(values, default=None), name)

    def _read_unit(self, parameter: Parameter) -> _Unit | None:
        try:
            return self._resolve(as_reference(parameter))
        except Fault:
            return None

    def _resolve(self, number: int) -> _Unit:
        """Follow a unit to the SI unit on which it is based."""
        factor, name = 1.0, ""
        for _ in range(MAX_NESTING):
            entity = self._entities.read(number)
            if "SI_UNIT" in entity.parts:
                unit = _read_si_unit(entity.parts["SI_UNIT"])
                if name:
                    unit = _Unit(
                        unit.quantity, unit.factor, _name_length(name, factor * unit.factor)
                    )
                return _check(_Unit(unit.quantity, factor * unit.factor, unit.name))
            if "CONVERSION_BASED_UNIT" not in entity.parts:
                break
            conversion = entity.parts["CONVERSION_BASED_UNIT"]
            if len(conversion) < 2:
                break
            name = name or as_text(conversion[-2]).strip().lower() or "unit"
            value, number = self._read_measure(as_reference(conversion[-1]))
            factor *= value
        raise Fault("a unit is not based on an SI unit")

    def _read_measure(self, number: int) -> tuple[float, int]:
        """A value and its unit."""
        entity = self._entities.read(number)
        for keyword, parameters in entity.parts.items():
            if keyword.endswith("MEASURE_WITH_UNIT") and len(parameters) >= 2:
                return as_number(parameters[0]), as_reference(parameters[1])
        raise Fault("a measure has no unit")

    def _read_uncertainty(self, parameter: Parameter) -> float | None:
        """An uncertainty of lengths, in metres if its unit is known."""
        try:
            entity = self._entities.read(as_reference(parameter))
            for parameters in entity.parts.values():
                if len(parameters) >= 2 and _is_length(parameters[0]):
                    unit = self._read_unit(parameters[1])
                    factor = unit.factor if unit is not None else 1.0
                    value = abs(as_number(parameters[0])) * factor
                    return value if 0.0 < value < MAX_METRES else None
        except Fault:
            pass
        return None


def _items_of(entity: Entity, keyword: str) -> list[Parameter]:
    """The list at the end of a record: units or uncertainties."""
    try:
        return as_list(entity.parts[keyword][-1])[:_MAX_UNITS]
    except (KeyError, IndexError, Fault):
        return []


def _is_length(parameter: Parameter) -> bool:
    return isinstance(parameter, Typed) and "LENGTH" in parameter.keyword


def _read_si_unit(parameters: list[Parameter]) -> _Unit:
    """A unit with its prefix: the last two attributes, because a simple record has a third."""
    if not parameters:
        raise Fault("an SI unit has no name")
    prefix = as_enumeration(parameters[-2]) if len(parameters) > 1 else ""
    quantity = as_enumeration(parameters[-1])
    return _Unit(quantity, PREFIXES.get(prefix, 1.0), (prefix + quantity).lower())


def _name_length(name: str, metres: float) -> str:
    """The usual name of a length, or else the one in the file."""
    for known, length in _KNOWN_LENGTHS.items():
        if isclose(metres, length, rel_tol=1e-6):
            return known
    return name[:40]


def _check(unit: _Unit) -> _Unit:
    if not (isfinite(unit.factor) and unit.factor > 0.0):
        raise Fault("a unit is not positive")
    if unit.quantity == "RADIAN" and not unit.factor <= 2 * pi * (1 + 1e-9):
        raise Fault("a unit of angle is more than a turn")
    return unit
