r"""Records of a STEP file: numbers, strings and lists as text, and numbered instances.

References
----------
ISO 10303-21:2016, Clear text encoding of the exchange structure: 6.3 tokens (reals have a decimal
point, and an E before the exponent), 6.4.3 strings (`\X2\` for four hexadecimal digits of a
character, `\X4\` for eight).
"""

import re
from collections.abc import Iterable, Sequence

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.encoders.cad.reals import list_reals, mark_exponents
from service.encoders.text import json_array, row_chunks

LINES = 1 << 14
"""How many records are kept as single texts before they are joined."""

SHORT_NET = 16
"""A net with up to this many control points is written on one line."""

_PLAIN = re.compile(r"[ -&(-\[\]-~]*", re.ASCII)
"""Texts that a string contains as they are: printable ASCII without quotes and backslashes."""


def write_real(number: float) -> str:
    """A real: with the fewest digits that read back as the same number."""
    return mark_exponents(repr(number), "E")


def write_reals(numbers: FloatArray) -> str:
    """A list of reals in brackets, from an array (n,)."""
    return f"({list_reals(numbers, 'E')})"


def write_string(text: str) -> str:
    """A string in quotes."""
    if _PLAIN.fullmatch(text):
        return f"'{text}'"
    return f"'{''.join(map(_write_character, text))}'"


def _write_character(character: str) -> str:
    code = ord(character)
    if character in "'\\":
        return 2 * character
    if 32 <= code < 127:
        return character
    return f"\\X2\\{code:04X}\\X0\\" if code < 1 << 16 else f"\\X4\\{code:08X}\\X0\\"


def write_references(numbers: Iterable[int]) -> str:
    """A list of references to instances in brackets."""
    return f"({','.join([f'#{number}' for number in numbers])})"


def write_net(first: int, rows: int, columns: int) -> str:
    """A list of lists of references to consecutive instances, one line for each row."""
    lines = [
        write_references(range(first + row * columns, first + (row + 1) * columns))
        for row in range(rows)
    ]
    separator = ",\n" if rows * columns > SHORT_NET else ","
    return f"({separator.join(lines)})"


class Records:
    """The instances of a data section, numbered from 1 in the order in which they are added."""

    def __init__(self) -> None:
        self.count = 0
        self._lines: list[str] = []
        self._chunks: list[bytes] = []

    def add(self, record: str) -> int:
        """Add an instance; returns its number."""
        self.count += 1
        self._lines.append(f"#{self.count}={record};\n")
        if len(self._lines) >= LINES:
            self._join()
        return self.count

    def add_points(self, points: FloatArray) -> int:
        """Add a cartesian point for each row of points (n, d); returns the number of the first."""
        first = self.count + 1
        for chunk in row_chunks(points):
            text = mark_exponents(json_array(points[chunk])[2:-2].decode(), "E")
            texts = text.split("],[")
            number = self.count
            self.count += len(texts)
            lines = [
                f"#{k}=CARTESIAN_POINT('',({text}));\n"
                for k, text in enumerate(texts, start=number + 1)
            ]
            self._lines += lines
            if len(self._lines) >= LINES:
                self._join()
        return first

    def finish(self) -> Sequence[bytes]:
        """The text of all instances in several chunks."""
        self._join()
        return self._chunks

    def _join(self) -> None:
        checkpoint()
        self._chunks.append("".join(self._lines).encode("ascii"))
        self._lines.clear()
