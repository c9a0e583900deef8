"""The entities of a file: each is parsed when it is asked for.

References
----------
IGES 5.3, section 2.2.4.5: the parameter data section.
"""

from dataclasses import dataclass

from service.decoders.iges.directory import Directory
from service.decoders.iges.faults import Fault
from service.decoders.iges.header import Header
from service.decoders.iges.records import Parameters, split_words

MAX_NESTING = 32
"""The most entities inside each other."""

READS = 8
"""How often a line is read on average, at most: in a sound file once, or twice if it is shared."""

LARGE_TYPES = frozenset({106, 112, 114, 126, 128})
"""Types whose parameters are not kept: splines and lists of points."""


@dataclass(frozen=True, slots=True)
class Entity:
    """One entity.

    Attributes
    ----------
    number : int
        The number of its directory entry, odd.
    type, form : int
    matrix : int
        The entry of its transformation matrix; 0 for none.
    parameters : Parameters
    """

    number: int
    type: int
    form: int
    matrix: int
    parameters: Parameters


class IgesFile:
    """The entities of a file.

    Attributes
    ----------
    header : Header
    directory : Directory
    """

    __slots__ = ("_cache", "_lines", "_lines_left", "directory", "header")

    def __init__(self, header: Header, directory: Directory, lines: list[str]) -> None:
        """Entities whose parameters are in `lines`, 64 columns each."""
        self.header = header
        self.directory = directory
        self._lines = lines
        self._lines_left = READS * (len(lines) + len(directory))
        self._cache: dict[int, Entity] = {}

    def row(self, number: int) -> int:
        """The row of an entry in the directory.

        Raises
        ------
        Fault
            No entry has this number.
        """
        row, is_even = divmod(number - 1, 2)
        if is_even or not 0 <= row < len(self.directory):
            raise Fault("a pointer leads to no entity")
        return row

    def type(self, number: int) -> int:
        """The type of an entity; 0 if there is none."""
        row, is_even = divmod(number - 1, 2)
        is_known = not is_even and 0 <= row < len(self.directory)
        return int(self.directory.types[row]) if is_known else 0

    def read(self, number: int, *types: int) -> Entity:
        """An entity with its parameters.

        Parameters
        ----------
        number : int
        *types : int
            The types that are allowed; none allows all.

        Raises
        ------
        Fault
            There is no such entity, it has another type, or its record is not that of its type.
        """
        if number not in self._cache:
            entity = self._read(number)
            if entity.type not in LARGE_TYPES:
                self._cache[number] = entity
        else:
            entity = self._cache[number]
        if types and entity.type not in types:
            raise Fault(f"a pointer leads to an entity of type {entity.type}")
        return entity

    def _read(self, number: int) -> Entity:
        row = self.row(number)
        directory = self.directory
        kind = int(directory.types[row])
        first = int(directory.first_lines[row]) - 1
        lines = self._lines[first : first + max(1, int(directory.line_counts[row]))]
        self._lines_left -= len(lines)
        if first < 0 or not lines:
            raise Fault("its parameters are missing")
        if self._lines_left < 0:
            raise Fault("its parameters are those of many entities")
        words = split_words("".join(lines), self.header.delimiters)
        if words[0] != str(kind):
            raise Fault("its parameters are those of another entity")
        form = int(directory.forms[row])
        return Entity(number, kind, form, int(directory.matrices[row]), Parameters(words[1:]))
