"""Records of an IGES file: parameters as text in 64 columns, and the directory of entities.

References
----------
IGES 5.3 (US PRO/IPO-100-1996): 2.2.2 (constants: reals, and strings as `5Htable`, which alone may
continue on the next record), 2.2.4 (sections of records of 80 columns).
"""

from collections.abc import Iterable, Sequence
from unicodedata import normalize

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.encoders.cad.reals import list_reals

WIDTH, GLOBAL_WIDTH = 64, 72
"""The columns of a record that parameters of entities, and those of the file, may have."""

LINES = 1 << 14
"""How many records are kept as single texts before they are joined."""


def write_reals(numbers: FloatArray) -> str:
    """The numbers of an array of any shape, separated by commas."""
    return list_reals(numbers.reshape(-1), "D")  # D marks double precision


def write_string(text: str) -> str:
    """A string: its length, H, and its characters; those beyond ASCII are replaced."""
    plain = normalize("NFKD", text).encode("ascii", "replace").decode()
    return f"{len(plain)}H{plain}" if plain else ""


def cut_records(text: str) -> list[str]:
    """Parameters without strings in pieces of at most `WIDTH` columns, cut after commas."""
    pieces = []
    begin = 0
    while len(text) - begin > WIDTH:
        end = text.rfind(",", begin, begin + WIDTH) + 1
        pieces.append(text[begin:end])
        begin = end
    pieces.append(text[begin:])
    return pieces


def cut_tokens(tokens: Sequence[str], width: int = WIDTH) -> list[str]:
    """Parameters, with strings among them, in pieces of at most `width` columns.

    Numbers are not cut; strings are continued in the first column of the next record.
    """
    pieces = [""]
    for number, token in enumerate(tokens, start=1):
        rest = token + (";" if number == len(tokens) else ",")
        if "H" not in rest and len(pieces[-1]) + len(rest) > width:
            pieces.append("")
        while rest:
            room = width - len(pieces[-1])
            pieces[-1] += rest[:room]
            rest = rest[room:]
            if rest:
                pieces.append("")
    return pieces


class Entities:
    """The entities of a file; each has two records in the directory, and its parameters."""

    def __init__(self) -> None:
        self.count = 0
        self.records = 0
        self._directory: list[str] = []
        self._lines: list[str] = []
        self._directory_chunks: list[bytes] = []
        self._chunks: list[bytes] = []

    def add(
        self,
        kind: int,
        parameters: str | Sequence[str],
        *,
        form: int = 0,
        status: str = "00000000",
        matrix: int = 0,
        color: int = 0,
    ) -> int:
        """Add an entity; returns the number of its first record in the directory.

        Parameters
        ----------
        kind : int
            The number of its type.
        parameters : str, or sequence of str
            The parameters after the number of the type, without strings as one text; or each of
            them.
        form : int
        status : str
            Blank, subordinate, use and hierarchy, two digits each.
        matrix, color : int
            The numbers of a transformation and of a colour, or 0.
        """
        pieces = (
            cut_records(f"{kind},{parameters};")
            if isinstance(parameters, str)
            else cut_tokens([str(kind), *parameters])
        )
        number, first = 2 * self.count + 1, self.records + 1
        self._lines += [
            f"{piece:<64}{number:8d}P{k:7d}\n" for k, piece in enumerate(pieces, start=first)
        ]
        self._directory.append(
            f"{kind:8d}{first:8d}{0:8d}{0:8d}{0:8d}{0:8d}{matrix:8d}{0:8d}{status}D{number:7d}\n"
            f"{kind:8d}{0:8d}{-color:8d}{len(pieces):8d}{form:8d}{'':24}{0:8d}D{number + 1:7d}\n"
        )
        self.count += 1
        self.records += len(pieces)
        if len(self._lines) >= LINES:
            self._join()
        return number

    def finish(self) -> tuple[Sequence[bytes], Sequence[bytes]]:
        """The directory and the parameters in several chunks."""
        self._join()
        return self._directory_chunks, self._chunks

    def _join(self) -> None:
        checkpoint()
        self._chunks.append("".join(self._lines).encode("ascii"))
        self._directory_chunks.append("".join(self._directory).encode("ascii"))
        self._lines.clear()
        self._directory.clear()


def write_section(pieces: Iterable[str], letter: str) -> list[str]:
    """The records of the start or the global section."""
    return [f"{piece:<72}{letter}{k:7d}\n" for k, piece in enumerate(pieces, start=1)]


def list_numbers(numbers: Iterable[int]) -> str:
    """Whole numbers, separated by commas."""
    return ",".join(map(str, numbers))
