"""`surface measure`: writes area, volume, centroid and borders of a surface."""

import argparse
from collections.abc import Mapping
from typing import Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields
from service.cli.points import parse_number
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    surface_document,
    surface_source,
)


def add(commands: Commands) -> None:
    """Adds the command and its flags; each overrides the file's field."""
    text = "write area, volume, centroid and borders of a surface, with proofs"
    measure = add_command(commands, "measure", text)
    add_source(measure, "tolerance")
    add_output(measure, formats=False)
    group = measure.add_argument_group("intervals")
    group.add_argument("--tolerance", metavar="X", help="relative width of the intervals (1e-6)")
    group.add_argument(
        "--weld-tolerance",
        metavar="X",
        help="distance within which borders are joined, as a share of the diagonal (1e-12)",
    )
    add_fields(measure)
    measure.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    check_output(arguments)
    document = surface_document(surface_source(arguments))
    flag_values: dict[str, Any] = {}
    for name in ("tolerance", "weld_tolerance"):
        if (text := getattr(arguments, name)) is not None:
            flag_values[name] = parse_number(text)
    return perform_document(
        arguments, "/v1/measure", document | flag_values, _compute, flags=flag_values
    )


def _compute(document: Mapping[str, Any]) -> bytes:
    """Measures in this process."""
    from service.pipeline.measure import plan_measure
    from service.schemas.queries import MeasureRequest

    request, limits = parse_request(MeasureRequest, document)
    return plan_measure(request.to_surface(), request.to_query(), limits).run()
