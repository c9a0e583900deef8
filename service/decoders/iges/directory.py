"""The directory of a file: one entry of twenty fields for each entity.

References
----------
IGES 5.3, section 2.2.4.4: the fields of a directory entry, and the digits of its status number.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import AnyArray, Bools, Ints
from service.decoders.iges.sections import LETTER

FIELD = 8
"""Columns of a field."""

_TYPE, _FIRST_LINE, _MATRIX, _STATUS, _COLOR, _LINE_COUNT, _FORM, _SUBSCRIPT = range(8)
_POSITIONS = (0, 1, 6, 8, 11, 12, 13, 17)
"""Where these fields are, counted from 0 over both lines of an entry, the sequence numbers left
out."""

_LABEL = slice(56, 64)
"""Columns of the label in the second line of an entry."""

_ZERO, _NINE, _MINUS, _PLUS, _BLANK = b"09-+ "


@dataclass(frozen=True, eq=False, slots=True)
class Directory:
    """The fields of n entries; the entry with the number 2 i + 1 is in row i.

    Attributes
    ----------
    types, forms : ndarray of int, shape (n,)
        The number of the type, 0 if the entry is damaged, and of the form.
    first_lines, line_counts : ndarray of int, shape (n,)
        The first line of the parameters, from 1, and the number of lines.
    matrices : ndarray of int, shape (n,)
        The numbers of entries of transformation matrices; 0 for none.
    colors : ndarray of int, shape (n,)
        The number of a colour, or the negative number of the entry of a colour.
    is_blanked : ndarray of bool, shape (n,)
        Whether an entity is not to be shown.
    subordinate, uses : ndarray of int, shape (n,)
        The switch of subordinate entities (1: physically, 2: logically dependent, 3: both), and
        the use of the entity.
    """

    types: Ints
    forms: Ints
    first_lines: Ints
    line_counts: Ints
    matrices: Ints
    colors: Ints
    is_blanked: Bools
    subordinate: Ints
    uses: Ints
    _subscripts: Ints
    _lines: list[str]

    def __len__(self) -> int:
        return len(self.types)

    def label(self, row: int) -> str:
        """The label of an entry, with its subscript in parentheses if that is not zero."""
        label = self._lines[2 * row + 1][_LABEL].strip()
        subscript = self._subscripts[row]
        return f"{label}({subscript})" if label and subscript > 0 else label


def read_directory(lines: list[str]) -> Directory:
    """Read the entries from pairs of lines, all at once; a last line without a pair is left out."""
    count = len(lines) // 2
    text = "".join([line.ljust(LETTER)[:LETTER] for line in lines[: 2 * count]])
    columns = np.frombuffer(text.encode("latin-1"), np.uint8)
    fields = columns.reshape(count, 2 * LETTER // FIELD, FIELD)[:, _POSITIONS]
    numbers, is_number = _read_numbers(fields)
    needed = [_TYPE, _FIRST_LINE, _MATRIX, _LINE_COUNT, _FORM]
    status = numbers[:, _STATUS]
    blank, subordinate, uses = (status // 10**power % 100 for power in (6, 4, 2))
    return Directory(
        types=np.where(is_number[:, needed].all(axis=1), numbers[:, _TYPE], 0),
        forms=numbers[:, _FORM],
        first_lines=numbers[:, _FIRST_LINE],
        line_counts=numbers[:, _LINE_COUNT],
        matrices=numbers[:, _MATRIX],
        colors=np.where(is_number[:, _COLOR], numbers[:, _COLOR], 0),
        is_blanked=(blank == 1) & is_number[:, _STATUS],
        subordinate=subordinate,
        uses=uses,
        _subscripts=numbers[:, _SUBSCRIPT],
        _lines=lines,
    )


def _read_numbers(fields: AnyArray) -> tuple[Ints, Bools]:
    """Whole numbers of fields (n, k, 8) of characters, blank ones as 0, and which are numbers."""
    numbers = np.zeros(fields.shape[:2], np.int64)
    is_number = np.ones(fields.shape[:2], bool)
    for column in range(FIELD):
        character = fields[:, :, column]
        is_digit = (character >= _ZERO) & (character <= _NINE)
        numbers = np.where(is_digit, 10 * numbers + (character.astype(np.int64) - _ZERO), numbers)
        is_sign = (character == _MINUS) | (character == _PLUS)
        is_number &= is_digit | is_sign | (character == _BLANK)
    is_negative = (fields == _MINUS).any(axis=2)
    return np.where(is_negative, -numbers, numbers), is_number
