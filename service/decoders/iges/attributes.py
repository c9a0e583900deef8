"""Names and colours of entities.

References
----------
IGES 5.3, sections 2.2.4.4.13 and 4.78 (314), 4.102 (property 406, form 15), 2.2.4.5.2 (pointers to
properties behind the parameters of an entity).
"""

from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.parts import Color
from service.decoders.iges.entities import Entity, IgesFile
from service.decoders.iges.faults import Fault

COLORS: dict[int, Color] = {
    1: (0.0, 0.0, 0.0),
    2: (1.0, 0.0, 0.0),
    3: (0.0, 1.0, 0.0),
    4: (0.0, 0.0, 1.0),
    5: (1.0, 1.0, 0.0),
    6: (1.0, 0.0, 1.0),
    7: (0.0, 1.0, 1.0),
    8: (1.0, 1.0, 1.0),
}
"""The colours with numbers: black, red, green, blue, yellow, magenta, cyan, white."""

_NAME = 15
"""The form of a property that is a name."""

_OWN_COUNTS = {
    143: (3, 2, 1),
    144: (4, 2, 1),
    186: (3, 2, 2),
    308: (3, 2, 1),
    402: (1, 0, 1),
    408: (5, -1, 0),
    510: (3, 1, 1),
    514: (1, 0, 2),
}
"""How many parameters a type has: a fixed number, and the position of a count with the number of
parameters for each item."""


class Attributes:
    """Finds names and colours; a damaged attribute counts as none."""

    __slots__ = ("_colors", "_file")

    def __init__(self, file: IgesFile) -> None:
        self._file = file
        self._colors: dict[int, Color | None] = {}

    def find_color(self, *numbers: int) -> Color | None:
        """The colour of the first of some entities that has one."""
        for number in numbers:
            value = int(self._file.directory.colors[self._file.row(number)])
            if value and (color := self._read_color(value)) is not None:
                return color
        return None

    def find_name(self, number: int) -> str:
        """The name of an entity: that of a property, or its label."""
        try:
            entity = self._file.read(number)
            for pointer in self._list_properties(entity):
                if self._file.type(pointer) == 406:
                    found = self._file.read(pointer)
                    if found.form == _NAME and (name := found.parameters.text(1)):
                        return name
            return self._file.directory.label(self._file.row(number))
        except (Fault, InvalidGeometry):
            return ""

    def _read_color(self, value: int) -> Color | None:
        if value > 0:
            return COLORS.get(value)
        if value not in self._colors:
            try:
                parameters = self._file.read(-value, 314).parameters
                shares = parameters.numbers(0, 3).clip(0.0, 100.0) / 100.0
                self._colors[value] = tuple(shares.tolist())
            except Fault:
                self._colors[value] = None
        return self._colors[value]

    def _list_properties(self, entity: Entity) -> list[int]:
        """The pointers to properties behind the parameters of an entity."""
        if entity.type not in _OWN_COUNTS:
            return []
        fixed, position, size = _OWN_COUNTS[entity.type]
        parameters = entity.parameters
        start = fixed + (size * parameters.count(position) if size else 0)
        # First there are pointers to associativities, then those to properties.
        start += 1 + parameters.count(start)
        return parameters.pointers(start + 1, parameters.count(start))
