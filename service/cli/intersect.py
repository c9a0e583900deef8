"""`surface intersect`: writes where rays hit a surface."""

import argparse
from collections.abc import Mapping
from typing import Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields
from service.cli.points import parse_number, parse_numbers
from service.cli.project import read_npy
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

FIELDS = ("surface", "rays", "hits", "relative_thickness")
"""The fields of a request with rays. `/v1/intersect` also takes requests with planes."""


def add(commands: Commands) -> None:
    """Adds the command and its flags. A flag overrides the field of the request in a file."""
    text = "write where rays hit a surface; no hit is missed"
    intersect = add_command(commands, "intersect", text)
    add_source(intersect, "rays")
    add_output(intersect, formats=False)
    group = intersect.add_argument_group("rays")
    group.add_argument(
        "--ray",
        metavar="X,Y,Z,DX,DY,DZ",
        action="append",
        help="a ray from a point in a direction; may be repeated",
    )
    group.add_argument("--rays", metavar="FILE", help="a .npy file with a ray in each row, (m, 6)")
    group.add_argument(
        "--all", action="store_true", help="all hits of each ray, not only the first"
    )
    group.add_argument(
        "--relative-thickness",
        metavar="X",
        help="how near a ray may pass to count as a hit, in diagonals (1e-9)",
    )
    add_fields(intersect)
    intersect.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    check_output(arguments)
    fields = surface_document(surface_source(arguments))
    # A file may have a request with planes, for `surface section`: take only the fields for rays.
    document = {key: value for key, value in fields.items() if key in FIELDS}
    flag_values: dict[str, Any] = {}
    rows: Any = None
    if arguments.ray is not None:
        rows = [parse_numbers(text) for text in arguments.ray]
    elif arguments.rays is not None:
        rows = read_npy(arguments.rays, "--rays").tolist()
    if rows is not None:
        if not all(isinstance(row, list) and len(row) == 6 for row in rows):
            raise Refused("a ray is six numbers: a point and a direction, X,Y,Z,DX,DY,DZ")
        origins, directions = [row[:3] for row in rows], [row[3:] for row in rows]
        flag_values["rays"] = {"origins": origins, "directions": directions}
    if arguments.all:
        flag_values["hits"] = "all"
    if arguments.relative_thickness is not None:
        flag_values["relative_thickness"] = parse_number(arguments.relative_thickness)
    return perform_document(
        arguments, "/v1/intersect", document | flag_values, _compute, flags=flag_values
    )


def _compute(document: Mapping[str, Any]) -> bytes:
    """Computes the hits in this process."""
    from service.pipeline.intersect import plan_intersect
    from service.schemas.intersect import IntersectRequest

    request, limits = parse_request(IntersectRequest, document)
    return plan_intersect(request.to_surface(), request.to_query(), limits).run()
