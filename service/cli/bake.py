"""`surface bake`: makes a file for each part of a list, as jobs do, without a service."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from service.cli.baking import MAX_PROCESSES, Many, make_files
from service.cli.flags import Command, flag
from service.cli.output import check_output, find_format
from service.cli.refusals import Refused, UsageError
from service.errors import InvalidRequest, Issue, SurfaceError

if TYPE_CHECKING:
    from service.jobs.bake import Entry


def _run_bake(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    fmt = find_format(arguments.format, FORMATS)
    check_output(arguments)
    processes = _parse_processes(arguments)
    with _open_list(arguments.list) as (lines, total):
        folder = Path() if arguments.list == "-" else Path(arguments.list).parent
        read = partial(read_entry, f"/v1/mesh?format={fmt.name}", folder=folder.absolute())
        return make_files(Many(lines, read, total, arguments.output, processes, arguments.cluster))


def _parse_processes(arguments: argparse.Namespace) -> int:
    text = arguments.processes
    if text is None:
        return 0
    if arguments.cluster is not None:
        raise UsageError("--processes: not with --cluster, whose workers compute")
    if not (text.isascii() and text.isdigit() and len(text) < 5 and int(text) <= MAX_PROCESSES):
        raise UsageError(f"--processes: needed a whole number from 0 to {MAX_PROCESSES}")
    return int(text)


@contextmanager
def _open_list(name: str) -> Iterator[tuple[IO[bytes], int | None]]:
    """The list as a file, and the number of its parts if the file can be read twice."""
    if name == "-" and sys.stdin is None:
        raise Refused("standard input is closed")
    if name != "-" and not Path(name).exists():
        raise UsageError("LIST: no such file; needed a file, or - for standard input")
    if name == "-" or not Path(name).is_file():
        # A thread may still wait for this pipe when the command ends: to close the file would then
        # wait for the thread.
        source: int | str = sys.stdin.fileno() if name == "-" else name
        yield open(source, "rb", closefd=name != "-"), None  # noqa: SIM115
        return
    with Path(name).open("rb") as lines:
        total = sum(not line.isspace() for line in lines)
        lines.seek(0)
        yield lines, total


def read_entry(
    default_path: str, number: int, line: bytes, folder: Path = Path()
) -> "Entry | None":
    """The entry of a line; None for a blank line.

    Parameters
    ----------
    default_path : str
        The path of parts without a `path`.
    folder : Path
        The folder from which the names of files begin that parts read.
    """
    from service.jobs.bake import Entry
    from service.schemas.document import parse_document
    from service.schemas.jobs import PartDefinition
    from service.schemas.validation import validate_document

    if line.isspace():
        return None
    place = f"line {number}"
    try:
        document = parse_document(line)
        if isinstance(document, dict):
            document.setdefault("path", default_path)
        file, document = _take_file(document)
        part = validate_document(PartDefinition, document)
        if part.name is None and file is None:
            needed = "a name, which the file of the part gets"
            raise InvalidRequest(Issue("missing_field", "A name is missing.", "/name", "", needed))
    except SurfaceError as error:
        return Entry(place, "", {}, len(line), error)
    fields: dict[str, Any] = {"path": part.path}
    if part.body is not None:
        fields["body"] = part.body
    if file is not None:
        # Without a name, the part has that of its file.
        source = folder / file
        fields["file"] = str(source)
        return Entry(place, part.name or source.stem, fields, len(line))
    return Entry(place, part.name or "", fields, len(line))


def _take_file(document: object) -> tuple[str | None, object]:
    """The name of the file that a part reads, if it has one, and the part without it.

    Raises
    ------
    InvalidRequest
        The name is no text, or the part has a body too.
    """
    if not isinstance(document, dict) or "file" not in document:
        return None, document
    file = document["file"]
    if not (isinstance(file, str) and file):
        issue = Issue("wrong_type", "This must be a name.", "/file", "no name", "a name of a file")
        raise InvalidRequest(issue)
    if "body" in document:
        message, got = "A part has a body, or a file in its place.", "both"
        raise InvalidRequest(Issue("conflicting_options", message, "/file", got, "one of the two"))
    return file, {key: value for key, value in document.items() if key != "file"}


BAKE = Command(
    "bake",
    "write a file for each part of a list, such as 100,000 meshes",
    _run_bake,
    (
        flag(
            "list",
            'a file with a JSON object a line: {"name": …, "body": …}, or {"file": "part.step"} '
            'with a CAD file, and "path" for other calls than /v1/mesh, or with the options of a '
            "file; or - for standard input",
            "LIST",
        ),
        flag(
            "-o --output",
            "folder for the files, or a bucket, s3://bucket/prefix",
            "FOLDER|URL",
            required=True,
        ),
        flag("--format", "format of parts without a path (glb)", "NAME", default="glb"),
        flag("--processes", "processes that compute; default: one a processor", "N"),
        flag("--cluster", "scheduler of a Dask cluster that computes: tls://host:port", "URL"),
    ),
    description="Each file has the name of its part and the suffix of its format. What an earlier "
    "run has made is not made again, so an interrupted command can be repeated. Parts that fail "
    "are listed at the end, and the exit code is then 1. Stored surfaces are read from "
    "SURFACE_STORE.",
    has_exit_codes=True,
)
