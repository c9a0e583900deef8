"""`surface curve`: writes a curve as points or lines."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from service.cli.document import parse_request, perform_document
from service.cli.refusals import issue_line
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    choose_format,
    read_option_flags,
    read_request,
)

if TYPE_CHECKING:
    from service.encoders.curves.format import CurveFormat

ACCURACY = ("resolution", "tolerance")
"""Options that replace each other."""

OPTIONS = (*ACCURACY, "tangents", "arc_lengths")
"""The options of a curve, by name."""

_CURVE_HELP = (
    "a JSON file (a curve, or a request with a curve and options), or - for standard input"
)


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    curve = add_command(commands, "curve", "write a curve as points or lines")
    curve.add_argument("source", metavar="FILE", help=_CURVE_HELP)
    add_output(curve)
    _add_options(curve)
    curve.set_defaults(run=_run)


def _add_options(curve: argparse.ArgumentParser) -> None:
    """Adds the options of a curve; each overrides the file's."""
    group = curve.add_argument_group("options of the curve")
    group.add_argument("--resolution", metavar="N", help="divisions of every piece (16)")
    group.add_argument(
        "--tolerance", metavar="DISTANCE", help="instead of --resolution: largest deviation"
    )
    for name, text in (
        ("tangents", "unit tangents (yes)"),
        ("arc-lengths", "arc length up to each point (yes)"),
    ):
        group.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)


def _run(arguments: argparse.Namespace) -> int:
    from service.encoders.curves.registry import CURVE_FORMATS
    from service.schemas.query import values_from_text

    fmt = choose_format(arguments, CURVE_FORMATS)
    source = read_request(arguments.source, "curve", "no such file")
    flag_values = read_option_flags(arguments, OPTIONS)
    if any(name in flag_values for name in ACCURACY):
        source = {key: value for key, value in source.items() if key not in ACCURACY}
    return perform_document(
        arguments,
        "/v1/curve",
        source | values_from_text(flag_values.items()),
        lambda document: _compute(document, fmt),
        fmt=fmt,
        line=lambda issue: issue_line(issue, flag_values),
    )


def _compute(document: Mapping[str, Any], fmt: "CurveFormat") -> bytes:
    """Computes the file of the curve in this process."""
    from service.pipeline.curve import plan_curve
    from service.schemas.curves import CurveRequest

    request, limits = parse_request(CurveRequest, document)
    return plan_curve(request.to_curve(), request.curve_options(), fmt, limits).run()
