"""`surface measure`: writes area, volume, centroid and borders of a surface."""

import argparse
from collections.abc import Mapping
from typing import Any

from service.cli.nets import add_fields, chosen_fields, field_line
from service.cli.points import coordinates
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    perform,
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
        help="share of the diagonal within which borders are joined (1e-12)",
    )
    add_fields(measure)
    measure.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    check_output(arguments)
    document = surface_document(surface_source(arguments))
    chosen: dict[str, Any] = {}
    for name in ("tolerance", "weld_tolerance"):
        if (text := getattr(arguments, name)) is not None:
            (chosen[name],) = coordinates(text)
    flags = dict.fromkeys(chosen, "")
    return perform(
        arguments,
        lambda: _local(document | chosen),
        lambda remote: remote.remote_answer(arguments.url, "/v1/measure", document | chosen),
        lambda issue: field_line(issue, flags | chosen_fields(arguments)),
    )


def _local(document: Mapping[str, Any]) -> bytes:
    """Measures in this process."""
    from service.pipeline.measure import plan_measure
    from service.schemas.measure import MeasureRequest
    from service.schemas.validation import validate_document
    from service.settings.environment import for_one_command
    from service.settings.runtime import pin_blas
    from service.settings.values import document_limits, result_limits

    pin_blas()
    settings = for_one_command()
    wanted = validate_document(MeasureRequest, document, document_limits(settings))
    return plan_measure(wanted.to_surface(), wanted.to_query(), result_limits(settings)).run()
