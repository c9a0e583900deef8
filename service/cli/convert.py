"""`surface convert`: writes a surface, or a part of it, in another form with the same points."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields, field_line, read_field_flags
from service.cli.refusals import issue_line
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    surface_document,
    surface_source,
)
from service.errors import Issue


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    text = "write a surface, or a part of it, in another form with the same points"
    convert = add_command(commands, "convert", text)
    add_source(convert, "operations")
    add_output(convert, formats=False)
    _add_operations(convert)
    add_fields(convert)
    convert.set_defaults(run=_run)


class _Append(argparse.Action):
    """Appends the flag's name and its text to the list of operations."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Called for each flag of an operation, in the order of the command line."""
        del parser, option_string
        text = values if isinstance(values, str) else ""  # argparse gives [] if a flag has no text
        namespace.operations = [*(namespace.operations or []), (self.flag_name, text)]

    @property
    def flag_name(self) -> str:
        """The flag's name without its hyphens."""
        return self.option_strings[0].removeprefix("--")


def _add_operations(convert: argparse.ArgumentParser) -> None:
    """Adds the flags of operations; if any is used, they replace the operations in the file."""
    group = convert.add_argument_group("operations, applied in the order of the flags")
    for flag, metavar, text in (
        ("elevate", "P,Q|N", "raise the degree"),
        ("split", "u=A,v=B|R,S,T", "cut at u, at v or at both; a triangle at a point"),
        ("restrict", "u=A:B,v=C:D", "cut out a piece"),
        ("transpose", None, "exchange u and v"),
        ("reverse", "u|v", "reverse u or v"),
        ("bezier", None, "convert a B-spline to Bézier patches"),
        ("triangle", "lower|upper", "make a triangular patch of half a patch"),
        ("operations", "JSON", "a list of operations, as in a request"),
    ):
        nargs = 0 if metavar is None else None
        group.add_argument(
            f"--{flag}", action=_Append, dest="operations", nargs=nargs, metavar=metavar, help=text
        )


def _run(arguments: argparse.Namespace) -> int:
    from service.cli.operations import operations_from_text

    check_output(arguments)
    source = surface_source(arguments)
    flags: list[str] = []
    document = surface_document(source)
    if arguments.operations is not None:
        flags, operations = operations_from_text(arguments.operations)
        document = document | {"operations": operations}
    fields = read_field_flags(arguments)
    return perform_document(
        arguments,
        "/v1/convert",
        document,
        _compute,
        line=lambda issue: _operation_line(issue, flags, fields),
    )


def _compute(document: Mapping[str, Any]) -> bytes:
    """Converts the surface in this process."""
    from service.pipeline.documents import plan_conversion
    from service.schemas.convert import ConvertRequest
    from service.settings.environment import command_settings
    from service.surface.convert.nets import SizeLimits

    request, limits = parse_request(ConvertRequest, document)
    settings = command_settings()
    surface, operations = request.to_surface(), request.to_operations()
    size_limits = SizeLimits(settings.max_control_points, settings.max_degree)
    return plan_conversion(surface, operations, size_limits, limits).run()


def _operation_line(issue: Issue, flags: Sequence[str], fields: Mapping[str, str]) -> str:
    """An issue as a line that names the flag of the operation that has the error.

    `flags` has the flag of each operation; `fields` are the fields of the surface set by flags.
    """
    # "/operations/2/…" is split into "", "operations", "2", …; a shorter pointer is filled with "".
    _, field, number = (*issue.pointer.split("/"), "", "")[:3]
    if field == "operations" and number.isdecimal() and int(number) < len(flags):
        return issue_line(replace(issue, pointer=f"/{flags[int(number)]}"), flags)
    return field_line(issue, fields)
