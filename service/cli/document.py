"""Commands that make one file from one document: in this process, or at a service (`--url`)."""

import argparse
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from service.cli.nets import field_line, read_field_flags
from service.cli.source import perform
from service.errors import Issue

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.encoders.format import FileFormat
    from service.pipeline.limits import Limits

Request = TypeVar("Request", bound="BaseModel")


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
    request = validate_document(model, document, document_limits(settings))
    return request, result_limits(settings)


def perform_document(
    arguments: argparse.Namespace,
    path: str,
    document: dict[str, Any],
    compute: Callable[[Mapping[str, Any]], bytes],
    *,
    flags: Collection[str] = (),
    fmt: "FileFormat | None" = None,
    query: Mapping[str, str] = MappingProxyType({}),
    line: Callable[[Issue], str] | None = None,
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
        lambda remote: remote.remote_document(arguments.url, path, document, fmt, query),
        line or (lambda issue: field_line(issue, all_flags)),
    )
