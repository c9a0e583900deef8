"""Files of control points, and the flags for the other fields of their surface."""

import argparse
from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.flags import Flag
from service.cli.refusals import UsageError, issue_line
from service.errors import Issue, first_part

if TYPE_CHECKING:
    from service.decoders.format import Decoder

FIELDS = ("type", "degree", "knots", "up", "name")
"""The fields of a surface that have flags, listed here because to import their module is slow."""


NET_FILES = (
    "files of control points: .npy, .bez, .bbp, .oogl, .teapot",
    (
        Flag("--input-format", "json, npy, oogl or teapot; default: by suffix", "NAME"),
        Flag("--type", "bezier, bspline, patches", "KIND"),
        Flag("--degree", "degree of a bspline (3)", "P|P,Q"),
        Flag("--knots", "clamped (default), uniform, periodic", "K|K,K"),
        Flag("--up", "y (default) or z", "AXIS"),
        Flag("--name", "name of the surface", "NAME"),
    ),
)
"""The heading and the flags for files of control points."""


@dataclass(frozen=True, slots=True)
class NetFile:
    """A file of control points: its bytes, its decoder, and the fields that flags set, as text."""

    content: bytes
    decoder: "Decoder"
    fields: Mapping[str, str]

    def document(self) -> dict[str, Any]:
        """The body of a request without options; raises `SurfaceError` if the file is invalid."""
        from service.schemas import query
        from service.settings.environment import read_environment

        max_points = read_environment().max_control_points
        net = self.decoder.decode(self.content, self.fields.get("type"), max_points)
        fields = query.surface_fields(self.fields)
        return {"surface": query.add_fields(net, fields)}


def read_field_flags(arguments: argparse.Namespace) -> dict[str, str]:
    """The texts of the fields that flags set, by name."""
    return {
        name: str(getattr(arguments, name))
        for name in FIELDS
        if getattr(arguments, name, None) is not None
    }


def choose_decoder(arguments: argparse.Namespace) -> "Decoder | None":
    """The decoder of the source, by `--input-format` or by its suffix; None for JSON."""
    from service.decoders.registry import BY_NAME, BY_SUFFIX

    name = arguments.input_format
    if name is None:
        return BY_SUFFIX.get(Path(arguments.source).suffix.removeprefix(".").lower())
    if name != "json" and name not in BY_NAME:
        raise UsageError(f"--input-format: unknown; needed one of json, {', '.join(BY_NAME)}")
    return BY_NAME.get(name)


def refuse_fields(arguments: argparse.Namespace) -> None:
    """Raises `UsageError` if a flag sets one of `FIELDS`.

    For JSON, examples and stored surfaces, which contain these fields themselves.
    """
    for name in read_field_flags(arguments):
        raise UsageError(f"--{name}: only for files of control points; JSON has a field for it")


def field_line(issue: Issue, flags: Container[str]) -> str:
    """An issue as a line; if a flag set the field that has the issue, the line names that flag.

    `flags` has the names of all fields that flags set: fields beside the surface, and those of
    `FIELDS`, which are inside the surface.
    """
    name = first_part(issue.pointer.removeprefix("/surface"))
    if name in flags and name in FIELDS:
        issue = replace(issue, pointer=f"/{name}")
    return issue_line(issue, flags)
