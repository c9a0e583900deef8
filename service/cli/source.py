"""Parts of most commands: a file or an example as input, a file as output."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from service.cli.flags import Flag, Flags
from service.cli.nets import NetFile, choose_decoder, field_line, read_field_flags, refuse_fields
from service.cli.output import write
from service.cli.refusals import OK, Refused, UsageError
from service.errors import Issue, SurfaceError

if TYPE_CHECKING:
    from service.encoders.format import FileFormat

Source = str | dict[str, Any] | NetFile
AnyFormat = TypeVar("AnyFormat", bound="FileFormat")


def source_flag(fields: str, suffix: str = "", *, is_curve: bool = False) -> Flag:
    """The source of the surface, or of the curve.

    Parameters
    ----------
    fields : str
        In words, for the help: the fields that a request in a file has beside the surface.
    suffix : str
        Text at the end of the help.
    is_curve : bool
    """
    if is_curve:
        kind, others, metavar = "curve", "", "FILE"
    else:
        kind, others = "surface", "a file of control points, the id of an example, "
        metavar = "FILE|EXAMPLE"
    text = f"a JSON file (a {kind}, or a request with a {kind} and {fields}), {others}"
    return Flag("source", f"{text}or - for standard input{suffix}", metavar)


def output_flags(*, formats: bool = True) -> Flags:
    """The output file, its format if there are several, and `--url`."""
    kind = "file" if formats else "JSON file"
    output = Flag("-o --output", f"{kind} to write, or - for standard output", is_required=True)
    format_flag = Flag("--format", "format of the output; default: by its suffix")
    url = Flag("--url", "URL of a service that computes the result")
    return (output, format_flag, url) if formats else (output, url)


def perform(
    arguments: argparse.Namespace,
    compute: Callable[[], bytes],
    request: Callable[[], bytes],
    line: Callable[[Issue], str],
) -> int:
    """Computes the result in this process or at `--url`, and writes it.

    Parameters
    ----------
    compute : callable
        Computes the bytes in this process.
    request : callable
        Gets the bytes from the service at `--url`.
    line : callable
        Returns the line of an issue.
    """
    try:
        content = compute() if arguments.url is None else request()
    except SurfaceError as error:
        raise Refused(*map(line, error.issues)) from None
    write(arguments.output, content)
    return OK


def check_output(arguments: argparse.Namespace) -> None:
    """Raises `UsageError` if the name of the output is empty."""
    if not arguments.output:
        raise UsageError("--output: empty; needed a file, or - for standard output")


def choose_format(arguments: argparse.Namespace, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format of the output, by `--format` or else by the suffix of the output."""
    by_suffix = {fmt.suffix: fmt for fmt in formats}
    check_output(arguments)
    if arguments.format is not None:
        return find_format(arguments.format, formats)
    suffix = Path(arguments.output).suffix.removeprefix(".").lower()
    if arguments.output == "-" or suffix not in by_suffix:
        raise UsageError(
            f"the output's name has no known suffix; needed --format or one of the suffixes "
            f"{', '.join(by_suffix)}"
        )
    return by_suffix[suffix]


def find_format(name: str, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format with this name."""
    by_name = {fmt.name: fmt for fmt in formats}
    if name not in by_name:
        raise UsageError(f"--format: unknown; needed one of {', '.join(by_name)}")
    return by_name[name]


def surface_source(arguments: argparse.Namespace) -> Source:
    """The id of an example, the request in a JSON file, or a file of control points."""
    from service.surface.examples.catalogue import EXAMPLES

    source = arguments.source
    is_example = source in EXAMPLES and not Path(source).exists()
    decoder = None if is_example else choose_decoder(arguments)
    missing_text = f"no such file and no such example; examples: {', '.join(EXAMPLES)}"
    if decoder is not None:
        return NetFile(_read(source, "surface", missing_text), decoder, read_field_flags(arguments))
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

    document = parse_document(_read(source, field, missing_text))
    if isinstance(document, dict) and field in document:
        return document
    return {field: document}


def _read(source: str, noun: str, missing_text: str) -> bytes:
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


def surface_document(source: Source) -> dict[str, Any]:
    """The request in a file, or a request that has an example as its surface."""
    if isinstance(source, NetFile):
        try:
            return source.document()
        except SurfaceError as error:
            raise Refused(*(field_line(i, source.fields) for i in error.issues)) from None
    if isinstance(source, dict):
        return source
    import orjson

    from service.encoders.text import json_text
    from service.schemas.surfaces import definition
    from service.surface.examples.catalogue import find

    # By way of JSON, because a document has lists of numbers where a definition has arrays.
    return {"surface": orjson.loads(json_text(definition(find(source).surface())))}
