"""Commands that make one file from one document: in this process, or at a service (`--url`)."""

import argparse
import sys
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from service.cli.files import FILE_FLAGS, SourceFile, read_field_flags
from service.cli.flags import Command, Flag, Flags, read_values
from service.cli.output import check_output, choose_format, output_flags, perform
from service.cli.refusals import print_error
from service.cli.source import (
    build_document,
    field_line,
    read_file,
    read_request,
    surface_source,
)
from service.errors import Issue

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.encoders.format import FileFormat
    from service.pipeline.calls import CallLimits

Request = TypeVar("Request", bound="BaseModel")
Document = dict[str, Any]


READING_HEADER, WRITING_HEADER = "Surface-Reading", "Surface-Writing"
"""Headers with the counts of a CAD file that a service has read, and of one that it has written."""

_WITH_REPORT = ("/v1/convert", "/v1/surfaces")
"""Calls whose JSON has the whole report of reading a file; others have a header with counts."""


def _keep_fields(document: Document, _: Document) -> Document:
    """The fields of a file, all of which stay beside the values of flags."""
    return document


@dataclass(frozen=True, slots=True)
class Query:
    """A command that makes one file from one document, as a row of a table.

    Attributes
    ----------
    name, text : str
        The name of the command, and its line in the list of commands.
    path : str
        The path of the URL to which the document is posted; also the name of the call that computes
        the file in this process.
    source : Flag
        The file or the example.
    title : str
        The heading of the flags.
    flags : tuple of Flag
        Each overrides the field of the file.
    merge : callable
        Returns the fields of the file's document that stay beside the values of the flags; it may
        change these values to those that the request needs.
    has_formats : bool
        Whether the file has one of several formats; otherwise it is JSON.
    default_format : str or None
        The name of the format of an output without a known suffix; None if it is refused.
    line : callable or None
        Returns the line of an issue; by default, a line that names the flag which set the field.
    is_curve : bool
        Whether the source is a curve, not a surface.
    reads_files : bool
        Whether the call at `path` reads files, so that `--url` gets them unchanged.
    """

    name: str
    text: str
    path: str
    source: Flag
    title: str
    flags: Flags
    merge: Callable[[Document, Document], Document] = _keep_fields
    has_formats: bool = False
    default_format: str | None = None
    line: Callable[[Issue, argparse.Namespace], str] | None = None
    is_curve: bool = False
    reads_files: bool = False

    def add_to(self, commands: Any) -> None:
        """Adds the command to the result of `add_subparsers`."""
        command = Command(
            self.name,
            self.text,
            self._run,
            (self.source, *output_flags(formats=self.has_formats)),
            groups=((self.title, self.flags), *(() if self.is_curve else (FILE_FLAGS,))),
            has_exit_codes=True,
        )
        command.add_to(commands)

    def _run(self, arguments: argparse.Namespace) -> int:
        from service.schemas.brep_writing import list_columns

        fmt = None
        if self.has_formats:
            fmt = _choose_format(arguments, self.path, self.default_format)
        check_output(arguments)
        values = read_values(arguments, self.flags)
        reading = None
        if self.is_curve:
            document = read_request(arguments.source, "curve", "no such file")
        else:
            source = surface_source(arguments)
            if isinstance(source, SourceFile):
                if self.reads_files and arguments.url is not None:
                    self.merge({}, values)
                    return send_file(arguments, self.path, source, values, fmt, line=self.line)
                document, reading = read_file(source)
                if arguments.url is not None:
                    document = {"surface": list_columns(document["surface"])}
            else:
                document = build_document(source)
        document = self.merge(document, values) | values
        return perform_document(
            arguments,
            self.path,
            document,
            lambda document: compute_document(self.path, document, fmt, reading),
            flags=values,
            fmt=fmt,
            line=self.line,
        )


def _choose_format(arguments: argparse.Namespace, path: str, default: str | None) -> "FileFormat":
    from service.pipeline.calls import CALLS

    return choose_format(arguments, CALLS[path].formats, default)


def compute_document(
    path: str,
    document: Document,
    fmt: "FileFormat | None" = None,
    reading: Mapping[str, Any] | None = None,
) -> bytes:
    """Computes the file of a call in this process; `reading` is the report of a CAD file.

    Says if a file of definitions has a unit that the surface does not have.
    """
    from service.pipeline.calls import CALLS
    from service.schemas.request import SurfaceRequest

    request, limits = parse_request(CALLS[path].model, document)
    if isinstance(request, SurfaceRequest):
        request.keep_reading(reading)
    call = CALLS[path]
    file = call.plan(request, fmt or call.default_format, limits).run()
    if file.writing is not None and file.writing.is_unit_assumed:
        _print_assumed_unit()
    return bytes(file.content)


def _print_assumed_unit() -> None:
    print_error("one unit is written as 1 mm, because the surface has no `metres_per_unit`")


def perform_document(
    arguments: argparse.Namespace,
    path: str,
    document: Document,
    compute: Callable[[Document], bytes],
    *,
    flags: Collection[str] = (),
    fmt: "FileFormat | None" = None,
    query: Mapping[str, str] = MappingProxyType({}),
    line: Callable[[Issue, argparse.Namespace], str] | None = None,
) -> int:
    """Writes the result of `compute(document)`, or the response of the service at `--url`.

    Parameters
    ----------
    path : str
        The path of the URL to which the document is posted.
    flags : collection of str
        The fields of the document that the command's own flags set. The line of an error in such a
        field names the flag.
    fmt : FileFormat, optional
        The format of the response; default: JSON.
    query : Mapping
        Further parameters of the URL.
    line : callable, optional
        Returns the line of an issue; by default, a line that names the flag which set the field.
    """
    all_flags = {*flags, *read_field_flags(arguments)}
    return perform(
        arguments,
        lambda: compute(document),
        lambda: post_document(arguments.url, path, document, fmt, query),
        lambda issue: line(issue, arguments) if line else field_line(issue, all_flags),
    )


def send_file(
    arguments: argparse.Namespace,
    path: str,
    source: SourceFile,
    values: Mapping[str, Any],
    fmt: "FileFormat | None" = None,
    *,
    query: Mapping[str, str] = MappingProxyType({}),
    line: Callable[[Issue, argparse.Namespace], str] | None = None,
) -> int:
    """Writes the response of the service at `--url` to a file, which is sent as it is.

    Parameters
    ----------
    values : Mapping
        The options that flags set, which become parameters of the URL.
    fmt, query, line
        As those of `perform_document`.
    """
    all_flags = {*values, *source.fields}
    return perform(
        arguments,
        bytes,  # there is a URL
        lambda: post_file(arguments.url, path, source, {**query, **query_texts(values)}, fmt),
        lambda issue: line(issue, arguments) if line else field_line(issue, all_flags),
    )


def post_file(
    url: str,
    path: str,
    source: SourceFile,
    query: Mapping[str, str],
    fmt: "FileFormat | None" = None,
) -> bytes:
    """The response to a file; prints what the service has read in it, and an assumed unit.

    Raises the errors of `service.cli.remote.post`.
    """
    import orjson

    from service.cli.remote import post

    seen: list[Mapping[str, str]] = []
    content = post(
        url,
        path,
        source.content,
        fmt,
        {**source.fields, **query},
        media_type=source.decoder.media_type,
        on_headers=seen.append,
    )
    (headers,) = seen
    counts = headers.get(READING_HEADER)
    if counts and path in _WITH_REPORT and (fmt is None or fmt.name == "json"):
        source.print_reading(orjson.loads(content).get("reading"))
    elif counts:
        source.print_counts(counts)
    _note_writing(headers)
    return content


def _note_writing(headers: Mapping[str, str]) -> None:
    """Says if the service has written a unit that the surface does not have."""
    if "unit=assumed" in headers.get(WRITING_HEADER, "").split("; "):
        _print_assumed_unit()


def query_texts(values: Mapping[str, Any]) -> dict[str, str]:
    """Options as texts of a query: lists and objects as JSON."""
    from service.encoders.text import json_text

    return {
        name: value if isinstance(value, str) else json_text(value).decode()
        for name, value in values.items()
    }


def post_document(
    url: str,
    path: str,
    document: Document,
    fmt: "FileFormat | None" = None,
    query: Mapping[str, str] = MappingProxyType({}),
) -> bytes:
    """The response to a document; says if a file of definitions has an assumed unit.

    Raises the errors of `service.cli.remote.post`.
    """
    from service.cli.remote import post

    return post(url, path, document, fmt, query, on_headers=_note_writing)


def parse_request(
    model: type[Request], document: Mapping[str, Any]
) -> "tuple[Request, CallLimits]":
    """The request in a document, and the limits of this command; limits NumPy to one thread.

    Raises
    ------
    InvalidRequest
        With JSON pointers into the document.
    InvalidSettings
    """
    from service.schemas.validation import validate_document

    limits = command_limits()
    return validate_document(model, document, limits.document), limits


def command_limits() -> "CallLimits":
    """The limits of a command that computes in this process; limits NumPy to one thread.

    Raises
    ------
    InvalidSettings
    """
    from service.pipeline.calls import CallLimits
    from service.settings.environment import command_settings
    from service.settings.limits import document_limits, file_limits, result_limits
    from service.settings.runtime import pin_blas

    pin_blas()
    settings = command_settings()
    # No request waits for a command, so its time is not limited.
    result = replace(result_limits(settings), max_mesh_faces=sys.maxsize)
    return CallLimits(document_limits(settings), result, file_limits(settings))
