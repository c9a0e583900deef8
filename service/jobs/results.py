"""The result of a part: its file in the store, and its record.

A file in the store is a line of JSON, the header, and then the content. The header has the hash of
the content: results are written without fsync, so after a power failure a file may be damaged, and
the part is then computed again.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from typing import Any

import orjson

from service.encoders.format import FileFormat
from service.errors import DamagedObject, Issue, SurfaceError
from service.pipeline.cad_files import count_writing
from service.pipeline.calls import File
from service.pipeline.files import count_reading

MAX_HEADER = 4096
"""The most bytes of a header."""


@dataclass(frozen=True, slots=True)
class Result:
    """The properties of the file of a part.

    Attributes
    ----------
    media_type, suffix, name : str
        `name` is that of the surface; empty if the file has none.
    bytes : int
    sha256 : str
        The hash of the content.
    vertices, triangles : int or None
    deviation_bound, gap_bound : float or None
        Of the report of a mesh; None for other files.
    reading : str or None
        Counts of the report of reading the part's file (`count_reading`); None without a file.
    writing : str or None
        Counts of the report of writing a file of definitions (`count_writing`); None for others.
    """

    media_type: str
    suffix: str
    name: str
    bytes: int
    sha256: str
    vertices: int | None = None
    triangles: int | None = None
    deviation_bound: float | None = None
    gap_bound: float | None = None
    reading: str | None = None
    writing: str | None = None


def describe_file(file: File, content: bytes, fmt: FileFormat) -> Result:
    """The result of a file whose content is `content`."""
    digest = sha256(content).hexdigest()
    about = (fmt.media_type, fmt.suffix, file.name, len(content), digest)
    reading = None if file.reading is None else count_reading(file.reading)
    writing = None if file.writing is None else count_writing(file.writing)
    if (report := file.report) is None:
        return Result(*about, reading=reading, writing=writing)
    return Result(
        *about,
        report.vertices,
        report.triangles,
        report.deviation_bound,
        report.gap_bound,
        reading,
        writing,
    )


def write_object(result: Result, content: bytes) -> bytes:
    """The bytes of the file in the store."""
    return b"\n".join((orjson.dumps(asdict(result)), content))


def read_object(stored: bytes) -> tuple[Result, memoryview]:
    """The result and the content of a file in the store; checks the hash.

    Raises
    ------
    DamagedObject
    """
    end = stored.find(b"\n", 0, MAX_HEADER)
    try:
        result = Result(**orjson.loads(stored[: max(end, 0)]))
    except (ValueError, TypeError):
        raise DamagedObject from None
    content = memoryview(stored)[end + 1 :]
    if len(content) != result.bytes or sha256(content).hexdigest() != result.sha256:
        raise DamagedObject
    return result, content


def write_error(error: SurfaceError) -> dict[str, Any]:
    """An error as JSON: the name of its class, and its issues."""
    return {"class": type(error).__name__, "issues": [asdict(issue) for issue in error.issues]}


def read_issues(error: Mapping[str, Any]) -> tuple[Issue, ...]:
    """The issues of an error as JSON."""
    return tuple(Issue(**issue) for issue in error["issues"])
