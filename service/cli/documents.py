"""Commands that make one file from one document: in this process, or at a service (`--url`)."""

import argparse
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from service.cli.flags import Command, Flag, Flags, read_values
from service.cli.output import check_output, choose_format, output_flags, perform
from service.cli.source import (
    NET_FILES,
    field_line,
    read_document,
    read_field_flags,
    read_request,
)
from service.errors import Issue

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.encoders.format import FileFormat
    from service.pipeline.calls import CallLimits

Request = TypeVar("Request", bound="BaseModel")
Document = dict[str, Any]


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
    line : callable or None
        Returns the line of an issue; by default, a line that names the flag which set the field.
    is_curve : bool
        Whether the source is a curve, not a surface.
    """

    name: str
    text: str
    path: str
    source: Flag
    title: str
    flags: Flags
    merge: Callable[[Document, Document], Document] = _keep_fields
    has_formats: bool = False
    line: Callable[[Issue, argparse.Namespace], str] | None = None
    is_curve: bool = False

    def add_to(self, commands: Any) -> None:
        """Adds the command to the result of `add_subparsers`."""
        command = Command(
            self.name,
            self.text,
            self._run,
            (self.source, *output_flags(formats=self.has_formats)),
            groups=((self.title, self.flags), *(() if self.is_curve else (NET_FILES,))),
            has_exit_codes=True,
        )
        command.add_to(commands)

    def _run(self, arguments: argparse.Namespace) -> int:
        fmt = _choose_format(arguments, self.path) if self.has_formats else None
        check_output(arguments)
        document = (
            read_request(arguments.source, "curve", "no such file")
            if self.is_curve
            else read_document(arguments)
        )
        values = read_values(arguments, self.flags)
        document = self.merge(document, values) | values
        return perform_document(
            arguments,
            self.path,
            document,
            lambda document: _compute(self.path, document, fmt),
            flags=values,
            fmt=fmt,
            line=self.line,
        )


def _choose_format(arguments: argparse.Namespace, path: str) -> "FileFormat":
    from service.pipeline.calls import CALLS

    return choose_format(arguments, CALLS[path].formats)


def _compute(path: str, document: Document, fmt: "FileFormat | None") -> bytes:
    """Computes the file of a call in this process."""
    from service.pipeline.calls import CALLS, JSON

    request, limits = parse_request(CALLS[path].model, document)
    return bytes(CALLS[path].plan(request, fmt or JSON, limits).run().content)


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
        lambda: _post(arguments.url, path, document, fmt, query),
        lambda issue: line(issue, arguments) if line else field_line(issue, all_flags),
    )


def _post(
    url: str, path: str, document: Document, fmt: "FileFormat | None", query: Mapping[str, str]
) -> bytes:
    from service.remote.calls import post

    return post(url, path, document, fmt, query)


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
    from service.settings.runtime import pin_blas
    from service.settings.values import document_limits, result_limits

    pin_blas()
    settings = command_settings()
    return CallLimits(document_limits(settings), result_limits(settings))
