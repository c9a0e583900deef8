"""The output of commands: its format, and writing it to a file, as a whole or not at all."""

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from service.cli.flags import Flags, flag
from service.cli.refusals import OK, Refused, UsageError
from service.errors import Issue, SurfaceError

if TYPE_CHECKING:
    from service.encoders.format import FileFormat

AnyFormat = TypeVar("AnyFormat", bound="FileFormat")


def output_flags(*, formats: bool = True) -> Flags:
    """The output file, its format if there are several, and `--url`."""
    kind = "file" if formats else "JSON file"
    output = flag("-o --output", f"{kind} to write, or - for standard output", required=True)
    format_flag = flag("--format", "format of the output; default: by its suffix")
    url = flag("--url", "URL of a service that computes the result")
    return (output, format_flag, url) if formats else (output, url)


def check_output(arguments: argparse.Namespace) -> None:
    """Raises `UsageError` if the name of the output is empty."""
    if not arguments.output:
        raise UsageError("--output: empty; needed a file, or - for standard output")


def choose_format(
    arguments: argparse.Namespace, formats: Sequence[AnyFormat], default: str | None = None
) -> AnyFormat:
    """The format of the output, by `--format` or else by the suffix of the output.

    `default` names the format of outputs without a known suffix; without it, these are refused.
    """
    by_suffix = {suffix: fmt for fmt in formats for suffix in (fmt.suffix, *fmt.other_suffixes)}
    check_output(arguments)
    if arguments.format is not None:
        return find_format(arguments.format, formats)
    suffix = Path(arguments.output).suffix.removeprefix(".").lower()
    if arguments.output == "-" or suffix not in by_suffix:
        if default is not None:
            return find_format(default, formats)
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


def perform(
    arguments: argparse.Namespace,
    compute: Callable[[], bytes],
    request: Callable[[], bytes],
    line: Callable[[Issue], str],
) -> int:
    """Computes the result in this process or at `--url`, and writes it; parameters of `obtain`."""
    write(arguments.output, obtain(arguments, compute, request, line))
    return OK


def obtain(
    arguments: argparse.Namespace,
    compute: Callable[[], bytes],
    request: Callable[[], bytes],
    line: Callable[[Issue], str],
) -> bytes:
    """The result, computed in this process or at `--url`.

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
        return compute() if arguments.url is None else request()
    except SurfaceError as error:
        raise Refused(*map(line, error.issues)) from None


def write(output: str, content: bytes) -> None:
    """Writes to a file, or to standard output for "-".

    Raises
    ------
    OSError
        The error names `output`, not the temporary file.
    """
    if output == "-":
        print_bytes(content)
        return
    try:
        _replace(Path(os.path.realpath(output)), content)
    except OSError as error:
        raise OSError(error.errno, error.strerror, output) from None


def _replace(target: Path, content: bytes) -> None:
    """Writes a file as a whole or not at all: renames a temporary file when it is complete."""
    if target.exists() and not target.is_file():
        # A device or a pipe cannot be replaced.
        target.write_bytes(content)
        return
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with temporary.open("xb") as file:
            file.write(content)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def print_bytes(content: bytes) -> None:
    """Writes to standard output.

    Raises
    ------
    Refused
        Standard output is closed; without a text if the program that reads the pipe closed it.
    OSError
        The error names standard output.
    """
    if sys.stdout is None:
        raise Refused("standard output is closed")
    unwritten = memoryview(content)
    try:
        while unwritten:  # with PYTHONUNBUFFERED a write may be partial, and only the next fails
            unwritten = unwritten[sys.stdout.buffer.write(unwritten) :]
        sys.stdout.buffer.flush()
    except OSError as error:
        # At exit Python writes the rest of the buffer: to the null device, so that it succeeds.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise Refused from None
        raise OSError(error.errno, error.strerror, "standard output") from None


def printable(text: str) -> str:
    """A name of a file, with escapes for characters that cannot be printed, or that control it."""
    return text if text.isprintable() else ascii(text)[1:-1]


def print_lines(lines: Iterable[str]) -> None:
    """Writes lines to standard output."""
    print_bytes("".join(f"{line}\n" for line in lines).encode())
