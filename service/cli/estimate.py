"""`surface estimate`: writes the size of a mesh before it is computed."""

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from service.cli.document import parse_request, perform_document
from service.cli.mesh import OPTIONS, add_options, drop_replaced
from service.cli.nets import add_fields
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    find_format,
    read_option_flags,
    surface_document,
    surface_source,
)

if TYPE_CHECKING:
    from service.encoders.format import Format


def add(commands: Commands) -> None:
    """Adds the command, with the flags of `surface mesh`."""
    text = "write the size of a mesh before it is computed: vertices, faces, bytes, limits"
    command = add_command(commands, "estimate", text)
    add_source(command, "options")
    add_output(command, formats=False)
    command.add_argument("--format", metavar="NAME", help="estimate this format only")
    add_options(command)
    add_fields(command)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS
    from service.schemas.query import values_from_text

    check_output(arguments)
    formats: Sequence[Format] = FORMATS
    if arguments.format is not None:
        formats = (find_format(arguments.format, FORMATS),)
    source = surface_document(surface_source(arguments))
    flag_values = read_option_flags(arguments, OPTIONS)
    document = drop_replaced(source, flag_values) | values_from_text(flag_values.items())
    query = {} if arguments.format is None else {"format": str(arguments.format)}
    return perform_document(
        arguments,
        "/v1/estimate",
        document,
        lambda document: _compute(document, formats),
        flags=flag_values,
        query=query,
    )


def _compute(document: Mapping[str, Any], formats: "Sequence[Format]") -> bytes:
    """Computes the estimate in this process."""
    from service.encoders.text import json_text
    from service.pipeline.estimate import plan_estimate
    from service.pipeline.mesh import select_encode_options
    from service.schemas.request import MeshRequest

    request, limits = parse_request(MeshRequest, document)
    result = plan_estimate(
        request.to_surface(),
        request.mesh_options(),
        select_encode_options(request),
        limits,
        formats,
    ).run()
    return json_text(result.to_object())
