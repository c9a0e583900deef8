"""The source of a command: an example, a JSON file, or a file of another format with flags."""

import argparse
import sys
from collections.abc import Container, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from service.cli.files import FIELDS, SourceFile, choose_decoder, read_field_flags, refuse_fields
from service.cli.flags import Flag, flag
from service.cli.refusals import Refused, UsageError, issue_line
from service.errors import Issue, SurfaceError, first_part

Source = str | dict[str, Any] | SourceFile
"""The id of an example or of a stored surface, a request, or a file of another format."""


def source_flag(fields: str, suffix: str = "", **options: Any) -> Flag:
    """The source of the surface.

    `fields` are, in words for the help, the fields that a request in a file has beside the surface;
    `suffix` is the end of the help; `options` are those of argparse.
    """
    text = (
        f"a JSON file (a surface, or a request with a surface and {fields}), a CAD file, a "
        f"file of control points, the id of an example, or - for standard input{suffix}"
    )
    return flag("source", text, "FILE|EXAMPLE", **options)


def read_document(arguments: argparse.Namespace) -> dict[str, Any]:
    """The request in a file, or a request that has an example as its surface."""
    return build_document(surface_source(arguments))


def read_file(source: SourceFile) -> tuple[dict[str, Any], Mapping[str, Any] | None]:
    """The request with the surface of a file, and the report of reading it.

    Raises
    ------
    Refused
        The file is invalid; the lines name the flags.
    """
    try:
        return source.read()
    except SurfaceError as error:
        raise Refused(*(field_line(issue, source.fields) for issue in error.issues)) from None


def build_document(source: Source) -> dict[str, Any]:
    """The request of a source."""
    if isinstance(source, SourceFile):
        return read_file(source)[0]
    if isinstance(source, dict):
        return source
    import orjson

    from service.encoders.text import json_text
    from service.schemas.surfaces import definition
    from service.surface.examples.catalogue import find

    # By way of JSON, because a document has lists of numbers where a definition has arrays.
    return {"surface": orjson.loads(json_text(definition(find(source).surface())))}


def surface_source(arguments: argparse.Namespace) -> Source:
    """The id of an example, the request in a JSON file, or a file of another format."""
    from service.surface.examples.catalogue import EXAMPLES

    source = arguments.source
    is_example = source in EXAMPLES and not Path(source).exists()
    decoder = None if is_example else choose_decoder(arguments)
    missing_text = f"no such file and no such example; examples: {', '.join(EXAMPLES)}"
    if decoder is not None:
        content = read_source(source, "surface", missing_text)
        return SourceFile(source, content, decoder, read_field_flags(arguments))
    refuse_fields(arguments)
    return source if is_example else read_request(source, "surface", missing_text)


def find_stored_id(arguments: argparse.Namespace) -> str | None:
    """The source if it may be the id of a surface that is stored at `--url`; else None."""
    from service.storage.keys import is_id

    source = arguments.source
    if arguments.url is None or not is_id(source) or Path(source).exists():
        return None
    refuse_fields(arguments)
    return str(source)


def read_request(source: str, field: str, missing_text: str) -> dict[str, Any]:
    """The request in a file; a surface or curve alone becomes a request without options.

    Parameters
    ----------
    field : str
        "surface" or "curve": the field that a request must have.
    missing_text : str
        The text of the error if the file does not exist.
    """
    from service.schemas.document import parse_document

    document = parse_document(read_source(source, field, missing_text))
    return document if isinstance(document, dict) and field in document else {field: document}


def read_source(source: str, noun: str, missing_text: str) -> bytes:
    """The bytes of a file, or of standard input; errors name what the file has (`noun`)."""
    if not source:
        raise UsageError(f"the name is empty; needed a file with a {noun}, or - for standard input")
    if source == "-":
        if sys.stdin is None:
            raise Refused("standard input is closed")
        return sys.stdin.buffer.read()
    if not Path(source).exists():
        raise UsageError(missing_text)
    return Path(source).read_bytes()


def field_line(issue: Issue, flags: Container[str]) -> str:
    """An issue as a line; if a flag set the field that has the issue, the line names that flag.

    `flags` has the names of all fields that flags set: fields beside the surface, and those of
    `FIELDS`, which are inside the surface.
    """
    name = first_part(issue.pointer.removeprefix("/surface"))
    if name in flags and name in FIELDS:
        issue = replace(issue, pointer=f"/{name}")
    return issue_line(issue, flags)
