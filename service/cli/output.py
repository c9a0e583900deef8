"""Writes the output to standard output, or to a file, as a whole or not at all."""

import os
import sys
from collections.abc import Iterable
from pathlib import Path

from service.cli.refusals import Refused


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


def print_lines(lines: Iterable[str]) -> None:
    """Writes lines to standard output."""
    print_bytes("".join(f"{line}\n" for line in lines).encode())
