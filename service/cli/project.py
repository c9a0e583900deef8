"""`surface project`: writes the closest points of a surface or a curve."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields
from service.cli.points import parse_number, parse_numbers
from service.cli.refusals import Refused
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    surface_document,
    surface_source,
)
from service.errors import SurfaceError


def add(commands: Commands) -> None:
    """Adds the command and its flags; each overrides the file's field."""
    text = "write the closest points of a surface or a curve, with proofs"
    project = add_command(commands, "project", text)
    add_source(project, "points", "; a request may have a curve instead of a surface")
    add_output(project, formats=False)
    group = project.add_argument_group("points")
    group.add_argument("--point", metavar="X,Y,Z", action="append", help="a point; may be repeated")
    group.add_argument("--points", metavar="FILE", help="a .npy file of points, (m, 3)")
    group.add_argument(
        "--relative-tolerance",
        metavar="X",
        help="largest width of the interval that is proved to contain a distance, as a share of "
        "the diagonal (1e-9)",
    )
    group.add_argument(
        "--sign", action="store_true", help="write signs too: -1 inside a closed surface, 1 outside"
    )
    add_fields(project)
    project.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    check_output(arguments)
    document = surface_document(surface_source(arguments))
    source = document["surface"]
    if isinstance(source, dict) and "curve" in source and "type" not in source:
        # A request with a curve: it was taken for a surface, because it has no field `surface`.
        document = source
    flag_values: dict[str, Any] = {}
    if arguments.point is not None:
        flag_values["points"] = [parse_numbers(text) for text in arguments.point]
    elif arguments.points is not None:
        flag_values["points"] = read_npy(arguments.points, "--points")
    if arguments.relative_tolerance is not None:
        flag_values["relative_tolerance"] = parse_number(arguments.relative_tolerance)
    if arguments.sign:
        flag_values["sign"] = True
    return perform_document(
        arguments, "/v1/project", document | flag_values, _compute, flags=flag_values
    )


def read_npy(name: str, flag: str) -> Any:
    """The array in a .npy file; an error names the flag."""
    from service.decoders.npy import read_array

    try:
        return read_array(Path(name).read_bytes())
    except SurfaceError as error:
        raise Refused(*(f"{flag}: {issue.message}" for issue in error.issues)) from None


def _compute(document: Mapping[str, Any]) -> bytes:
    """Computes the closest points in this process."""
    from service.pipeline.project import plan_project
    from service.schemas.queries import ProjectRequest

    request, limits = parse_request(ProjectRequest, document)
    return plan_project(request.to_shape(), request.to_query(), limits).run()
