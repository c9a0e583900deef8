"""Where the instances of a file are: one pass finds them, and none is parsed.

An instance begins at `#12 =` and ends where the next one begins (`service.decoders.step.scanning`),
whatever is lost between: a missing semicolon costs nothing, and several DATA sections are read as
one.

References
----------
ISO 10303-21, clauses 5 to 8: the exchange structure, comments, sections.
"""

import re
from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

from service.bases.arrays import AnyArray, Ints
from service.decoders.format import (
    FileLimits,
    build_file_error,
    build_malformed_error,
)
from service.decoders.step.scanning import BEGIN_WITHIN, blank_comments, find_instances

BEGIN = "ISO-10303-21"
"""The word with which a file begins."""

MAX_HEADER = 1_000_000
"""The most bytes of a header that are read."""

MAX_KEYWORDS = 65_000
"""The most different keywords; the rest have one number."""

COMPLEX = "("
"""Stands for the keyword of a complex instance."""

_KEYWORD = re.compile(r"\s*+(\(?)\s*+([A-Za-z_!][A-Za-z0-9_]*+)?")
_PART = re.compile(r"'[^']*+'|([A-Za-z_][A-Za-z0-9_]*+)\s*+\(")
_EXTERNAL = re.compile(r"\s*+<")
_OTHER = "?"


class Instances:
    """The instances of a file, in the order of the file.

    Attributes
    ----------
    text : str
        The file without comments; each character is one byte (Latin-1).
    numbers : ndarray of int64, shape (n,)
        The number of each instance.
    header : str
        What stands before the first instance.
    starts, ends : ndarray of int, shape (n,)
        Where the record of each instance begins and ends in the text.
    """

    def __init__(self, content: bytes, limits: FileLimits) -> None:
        """Find the instances.

        Raises
        ------
        MalformedBody
            `malformed_body`: this is no STEP file.
        InvalidRequest
            `malformed_file`: it has no instance.
        TooLarge
            `too_many_entities`.
        """
        if BEGIN.encode() not in content[:BEGIN_WITHIN]:
            raise build_malformed_error(
                "The file is not a STEP file.", "another first line", f"the word {BEGIN}"
            )
        if b"/*" in content:
            content = blank_comments(content)
        signs, hashes, self.numbers = find_instances(content, limits)
        if not len(signs):
            raise build_file_error(
                "The file has no data.", "no entity", "a section DATA with entities"
            )
        self.text = content.decode("latin-1")
        self.header = self.text[: min(int(hashes[0]), MAX_HEADER)]
        self.starts = signs + 1
        self.ends = np.append(hashes[1:], len(self.text))
        # Single values of views are found in half the time of those of arrays.
        self._starts, self._ends = self.starts.data, self.ends.data
        self._keywords, self._codes = self._read_keywords()
        self._order: Ints | None = None
        self._table = self._number_table()
        self._rows = self._table.data
        self._complex_rows: dict[str, list[int]] | None = None

    def __len__(self) -> int:
        return len(self.numbers)

    def find(self, number: int) -> int:
        """The row of an instance; −1 if there is none. Of equal numbers the first counts."""
        rows = self._rows
        if self._order is None:
            return rows[number] if 0 <= number < len(rows) else -1
        position = bisect_left(rows, number)
        if position < len(rows) and rows[position] == number:
            return self._order.item(position)
        return -1

    def find_all(self, numbers: Sequence[int]) -> Ints:
        """The rows of several instances; −1 for those that there are not."""
        wanted = np.array(numbers, np.int64)
        table, order = self._table, self._order
        if order is None:
            is_known = (wanted >= 0) & (wanted < len(table))
            return np.where(is_known, table[np.where(is_known, wanted, 0)], -1)
        positions = np.minimum(np.searchsorted(table, wanted), len(table) - 1)
        return np.where(table[positions] == wanted, order[positions], -1)

    def span(self, row: int) -> tuple[int, int]:
        """Where the record of an instance begins and ends in the text."""
        return self._starts[row], self._ends[row]

    def keyword(self, row: int) -> str:
        """The keyword of an instance, in capital letters; `(` of a complex one."""
        return self._keywords[int(self._codes[row])]

    @property
    def keywords(self) -> set[str]:
        """All keywords in the file, those of the parts of complex instances included."""
        return {*self._keywords, *self._rows_of_parts()}

    def rows_of(self, *keywords: str) -> list[int]:
        """The rows with one of the keywords, also as a part of a complex instance, ascending."""
        codes = [code for code, word in enumerate(self._keywords) if word in keywords]
        rows = set(np.flatnonzero(np.isin(self._codes, codes)).tolist()) if codes else set()
        complex_rows = self._rows_of_parts()
        for keyword in keywords:
            rows.update(complex_rows.get(keyword, ()))
        return sorted(rows)

    def count_external(self) -> int:
        """How many entities stand for something in another file: those of a section REFERENCE."""
        code = self._keywords.index(_OTHER) if _OTHER in self._keywords else -1
        rows = np.flatnonzero(self._codes == code)
        return sum(_EXTERNAL.match(self.text, start) is not None for start in self.starts[rows])

    def _read_keywords(self) -> tuple[list[str], AnyArray]:
        numbers: dict[str, int] = {}
        codes = np.empty(len(self), np.uint16)
        match, text = _KEYWORD.match, self.text
        words: dict[str, int] = {}  # as they are written
        for row, position in enumerate(self.starts.tolist()):
            found = match(text, position)
            parenthesis, word = found.groups() if found else ("", None)
            word = COMPLEX if parenthesis else word or _OTHER
            code = words.get(word)
            if code is None:
                key = word.upper() if len(numbers) < MAX_KEYWORDS else _OTHER
                code = numbers.setdefault(key, len(numbers))
                if len(words) < MAX_KEYWORDS:
                    words[word] = code
            codes[row] = code
        return list(numbers), codes

    def _number_table(self) -> AnyArray:
        """Rows by number if numbers are dense, else the sorted numbers, with `_order`."""
        numbers = self.numbers
        largest = int(numbers.max())
        if largest <= 4 * len(numbers) + 1000:
            table = np.full(largest + 1, -1, np.int32)
            table[numbers[::-1]] = np.arange(len(numbers) - 1, -1, -1)
            return table
        self._order = np.argsort(numbers, kind="stable")
        return numbers[self._order]

    def _rows_of_parts(self) -> dict[str, list[int]]:
        """The rows of complex instances by the keywords of their parts."""
        if self._complex_rows is None:
            self._complex_rows = {}
            code = self._keywords.index(COMPLEX) if COMPLEX in self._keywords else -1
            for row in np.flatnonzero(self._codes == code).tolist():
                start, end = self.span(row)
                parts = {part.upper() for part in _PART.findall(self.text, start, end) if part}
                for part in parts:
                    if part in self._complex_rows or len(self._complex_rows) < MAX_KEYWORDS:
                        self._complex_rows.setdefault(part, []).append(row)
        return self._complex_rows
