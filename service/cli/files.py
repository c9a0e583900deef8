"""Files as sources of commands: files of control points, and CAD files, with what flags set."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.flags import flag, read_values
from service.cli.output import printable
from service.cli.reading import print_counts, print_reading
from service.cli.refusals import Refused, UsageError, issue_line

if TYPE_CHECKING:
    from service.decoders.format import Decoded, Decoder

_FIELD_FLAGS = (
    flag("--type", "bezier, bspline, patches", "KIND"),
    flag("--degree", "degree of a bspline (3)", "P|P,Q"),
    flag("--knots", "clamped (default), uniform, periodic", "K|K,K"),
    flag(
        "--homogeneous",
        "points of four numbers in .npy are [w x, w y, w z, w]",
        action="store_const",
        const="true",
    ),
    flag("--up", "y or z; default: y, of a CAD file z", "AXIS"),
    flag("--name", "name of the surface", "NAME"),
    flag("--invalid-faces", "of a CAD file: skip (default) or refuse", "HOW"),
)
"""Flags of the fields of a surface, listed here because to import their module is slow."""

FIELDS = tuple(each.destination for each in _FIELD_FLAGS)

FILE_FLAGS = (
    "files of control points: .npy, .bez, .bbp, .oogl, .teapot, .obj (free-form surfaces), and "
    "geomdl's .json; CAD files: .step, .stp, .p21, .igs, .iges, .3dm",
    (
        flag(
            "--input-format",
            "json, npy, oogl, teapot, obj, geomdl, step, iges or 3dm; default: by suffix",
            "NAME",
        ),
        *_FIELD_FLAGS,
    ),
)
"""The heading and the flags for files."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A file with a surface: its name, bytes, decoder, and the fields that flags set, as text."""

    name: str
    content: bytes
    decoder: "Decoder"
    fields: Mapping[str, str]

    def read(self) -> tuple[dict[str, Any], Mapping[str, Any] | None]:
        """The body of a request without options, and the report of a CAD file, which is printed.

        Raises
        ------
        SurfaceError
            The file is invalid.
        Refused
            It has another format, or a library is missing.
        """
        from service.pipeline.files import check_beside
        from service.schemas import file_fields
        from service.schemas.request import SurfaceRequest

        fields, is_cad = file_fields.surface_fields(self.fields), self.decoder.is_cad
        if is_cad:
            check_beside(SurfaceRequest, self.decoder, {"surface": fields})
        decoded = self._decode()
        self.print_reading(decoded.reading)
        surface = file_fields.add_fields(decoded.tree, fields, is_cad=is_cad)
        return {"surface": surface}, decoded.reading

    def print_reading(self, reading: Mapping[str, Any] | None) -> None:
        """Prints a report of reading this file."""
        print_reading(printable(self.name), reading)

    def print_counts(self, header: str) -> None:
        """Prints what a service has read in this file, by the header of its response."""
        print_counts(printable(self.name), header)

    def _decode(self) -> "Decoded":
        from service.decoders import refused
        from service.decoders.child import read_file
        from service.settings.environment import read_environment
        from service.settings.limits import file_limits

        decoder = self.decoder
        if not decoder.is_available():
            extra = f"pip install 'surface-service[{decoder.extra}]'"
            raise Refused(f"files of {decoder.title} need the extra packages of {extra}")
        if decoder.is_cad and (known := refused.find_by_content(self.content)) is not None:
            raise Refused(issue_line(known.issue()))
        limits = file_limits(read_environment())
        return read_file(decoder, self.content, self.fields.get("type"), limits)


def read_field_flags(arguments: argparse.Namespace) -> dict[str, str]:
    """The texts of the fields that flags set, by name."""
    return read_values(arguments, _FIELD_FLAGS)


def choose_decoder(arguments: argparse.Namespace) -> "Decoder | None":
    """The decoder of the source, by `--input-format`, by its suffix or by its first bytes.

    None for JSON.

    Raises
    ------
    UsageError
        No format has this name, or a flag does not belong to files of this format.
    Refused
        The suffix, or the first bytes, are those of a format that is not read.
    """
    from service.decoders.refused import find_by_suffix
    from service.decoders.registry import BY_NAME, BY_SUFFIX

    name, path = arguments.input_format, Path(arguments.source)
    suffix = path.suffix.removeprefix(".").lower()
    if name is None:
        decoder = BY_SUFFIX.get(suffix)
        if decoder is None and (known := find_by_suffix(suffix)) is not None:
            raise Refused(issue_line(known.issue()))
        decoder = decoder or _look_inside(path)
    elif name != "json" and name not in BY_NAME:
        raise UsageError(f"--input-format: unknown; needed one of json, {', '.join(BY_NAME)}")
    else:
        decoder = BY_NAME.get(name)
    if decoder is not None:
        _check_flags(arguments, decoder)
    return decoder


def _look_inside(path: Path) -> "Decoder | None":
    """The decoder of a file by its first bytes, whatever its name is; None for a request.

    Raises
    ------
    Refused
        The format is known, and not read.
    """
    from service.decoders import refused
    from service.decoders.registry import find_by_content

    if not path.is_file():
        return None
    with path.open("rb") as file:
        start = file.read(refused.SNIFFED_BYTES)
    if (known := refused.find_by_content(start)) is not None:
        raise Refused(issue_line(known.issue()))
    return find_by_content(start)


def _check_flags(arguments: argparse.Namespace, decoder: "Decoder") -> None:
    """Raises `UsageError` if a flag sets a field that files of this format do not take."""
    from service.errors import InvalidRequest
    from service.schemas.file_fields import check_fields

    try:
        check_fields(read_field_flags(arguments), decoder.fields)
    except InvalidRequest as error:
        issue = error.issues[0]
        flag_name = issue.pointer.removeprefix("/").replace("_", "-")
        raise UsageError(f"--{flag_name}: {issue.message} (needed {issue.needed})") from None


def refuse_fields(arguments: argparse.Namespace) -> None:
    """Raises `UsageError` if a flag sets one of `FIELDS`.

    For JSON, examples and stored surfaces, which contain these fields themselves.
    """
    for name in read_field_flags(arguments):
        flag_name = name.replace("_", "-")
        files = "files of control points and CAD files"
        raise UsageError(f"--{flag_name}: only for {files}; JSON has a field for it")
