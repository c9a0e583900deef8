"""Small IGES files, written entity by entity."""

import itertools
from collections.abc import Sequence

from service.decoders.iges.directory import read_directory
from service.decoders.iges.entities import IgesFile
from service.decoders.iges.header import read_header
from service.decoders.iges.sections import find_sections

Word = int | float | str

GLOBAL = (
    "1H,,1H;,4Htest,8Htest.igs,4Hmade,4Hmade,32,38,6,308,15,4Htest,1.,{unit},{name},1,0.01,"
    "15H20260101.000000,{resolution},100.,0H,0H,11,0,15H20260101.000000,0H;"
)


def string(text: str) -> str:
    """A string with the number of its characters."""
    return f"{len(text.encode())}H{text}"


class Writer:
    """A file; `add` returns the number of an entity's directory entry."""

    def __init__(self, unit: int = 2, name: str = "2HMM", resolution: str = "1.D-6") -> None:
        self._global = GLOBAL.format(unit=unit, name=name, resolution=resolution)
        self._directory: list[str] = []
        self._parameters: list[str] = []

    def add(
        self,
        kind: int,
        *words: Word,
        form: int = 0,
        status: str = "00000000",
        color: int = 0,
        matrix: int = 0,
        label: str = "",
        subscript: int = 0,
    ) -> int:
        number = len(self._directory) + 1
        lines: list[str] = []
        line = ""
        record = [str(kind), *(_write(word) for word in words)]
        for position, word in enumerate(record):
            token = word + (";" if position == len(record) - 1 else ",")
            if len(line) + len(token) > 64 and line:
                lines.append(line)
                line = ""
            while len(token) > 64:  # only strings go on in the next line
                lines.append((line + token)[:64])
                token, line = (line + token)[64:], ""
            line += token
        lines.append(line)
        first = len(self._parameters) + 1
        for text in lines:
            sequence = len(self._parameters) + 1
            self._parameters.append(f"{text:<64}{number:8d}P{sequence:7d}")
        self._directory += [
            f"{kind:8d}{first:8d}{0:8d}{0:8d}{0:8d}{0:8d}{matrix:8d}{0:8d}{status:>8}D{number:7d}",
            f"{kind:8d}{0:8d}{color:8d}{len(lines):8d}{form:8d}{'':16}{label:>8}{subscript:8d}"
            f"D{number + 1:7d}",
        ]
        return number

    def lines(self) -> list[str]:
        """All lines of the file."""
        parts = [self._global[start : start + 72] for start in range(0, len(self._global), 72)]
        header = [f"{part:<72}G{number:7d}" for number, part in enumerate(parts, 1)]
        end = (
            f"S{1:7d}G{len(header):7d}D{len(self._directory):7d}P{len(self._parameters):7d}"
            f"{'':40}T{1:7d}"
        )
        return [f"{'test':<72}S{1:7d}", *header, *self._directory, *self._parameters, end]

    def content(self) -> bytes:
        """The file."""
        return "".join(f"{line}\n" for line in self.lines()).encode()

    def file(self) -> IgesFile:
        """The file's entities."""
        sections = find_sections(self.content())
        header = read_header(sections.global_text)
        return IgesFile(header, read_directory(sections.directory), sections.parameters)


def _write(word: Word) -> str:
    return repr(word).upper().replace("E", "D") if isinstance(word, float) else str(word)


def add_line(writer: Writer, *points: Sequence[float]) -> int:
    """Lines through points: one entity, or a composite curve."""
    pairs = itertools.pairwise(points)
    lines = [
        writer.add(110, *map(float, _space(first)), *map(float, _space(last)), status="00010000")
        for first, last in pairs
    ]
    return lines[0] if len(lines) == 1 else writer.add(102, len(lines), *lines, status="00010000")


def _space(point: Sequence[float]) -> Sequence[float]:
    return [*point, 0.0][:3]


def add_quad(writer: Writer, corners: Sequence[Sequence[float]], **options: int | str) -> int:
    """A flat face (144) with four corners, with curves in space and of parameters."""
    a, b, c, d = corners
    surface = writer.add(
        128, 1, 1, 1, 1, 0, 0, 1, 0, 0, *[0.0, 0.0, 1.0, 1.0] * 2, *[1.0] * 4,
        *map(float, [*a, *b, *d, *c]), 0.0, 1.0, 0.0, 1.0, status="00010000",
    )  # fmt: skip
    space = add_line(writer, a, b, c, d, a)
    inside = add_line(writer, (0, 0), (1, 0), (1, 1), (0, 1), (0, 0))
    loop = writer.add(142, 0, surface, inside, space, 3, status="00010500")
    return writer.add(144, surface, 1, 0, loop, **options)  # type: ignore[arg-type] # by name


def add_box(writer: Writer, size: Sequence[float], **options: int | str) -> list[int]:
    """Six faces with the corners of a box; their normals point in different directions."""
    x, y, z = size
    corners = [(i * x, j * y, k * z) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    rings = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return [add_quad(writer, [corners[n] for n in ring], **options) for ring in rings]
