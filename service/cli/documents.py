"""Commands that make one file from one document: in this process, or at a service (`--url`)."""

import argparse
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
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
    from service.pipeline.limits import Limits

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
        The path of the URL to which the document is posted.
    source : Flag
        The file or the example.
    title : str
        The heading of the flags.
    flags : tuple of Flag
        Each overrides the field of the file.
    compute : callable
        Computes the bytes of the file in this process, from the document; and from the argument
        `fmt`, if there are several formats.
    merge : callable
        Returns the fields of the file's document that stay beside the values of the flags; it may
        change these values to those that the request needs.
    formats : callable or None
        Returns the formats of the file; None if the file is JSON.
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
    compute: Callable[..., bytes]
    merge: Callable[[Document, Document], Document] = _keep_fields
    formats: "Callable[[], Sequence[FileFormat]] | None" = None
    line: Callable[[Issue, argparse.Namespace], str] | None = None
    is_curve: bool = False

    def add_to(self, commands: Any) -> None:
        """Adds the command to the result of `add_subparsers`."""
        command = Command(
            self.name,
            self.text,
            self._run,
            (self.source, *output_flags(formats=self.formats is not None)),
            groups=((self.title, self.flags), *(() if self.is_curve else (NET_FILES,))),
            has_exit_codes=True,
        )
        command.add_to(commands)

    def _run(self, arguments: argparse.Namespace) -> int:
        fmt = None
        if self.formats is None:
            check_output(arguments)
        else:
            fmt = choose_format(arguments, self.formats())
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
            self.compute if fmt is None else partial(self.compute, fmt=fmt),
            flags=values,
            fmt=fmt,
            line=self.line,
        )


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
    from service.remote import post

    return post(url, path, document, fmt, query)


def parse_request(model: type[Request], document: Mapping[str, Any]) -> "tuple[Request, Limits]":
    """The request in a document, and the limits of this command; limits NumPy to one thread.

    Raises
    ------
    InvalidRequest
        With JSON pointers into the document.
    InvalidSettings
    """
    from service.schemas.validation import validate_document
    from service.settings.environment import command_settings
    from service.settings.runtime import pin_blas
    from service.settings.values import document_limits, result_limits

    pin_blas()
    settings = command_settings()
    return validate_document(model, document, document_limits(settings)), result_limits(settings)
