"""`surface points`: writes points, partials, normals and curvatures of a surface."""

import argparse
from collections.abc import Mapping
from typing import Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    check_output,
    surface_document,
    surface_source,
)

PLACE_FLAGS = ("uv", "barycentric", "patch")
FLAGS = (*PLACE_FLAGS, "derivatives")


def add(commands: Commands) -> None:
    """Adds the command and its flags; each overrides the file's field."""
    text = "write points, partials, normals and curvatures of a surface"
    points = add_command(commands, "points", text)
    add_source(points, "places")
    add_output(points, formats=False)
    group = points.add_argument_group("places; --uv and --barycentric may be repeated")
    group.add_argument("--uv", metavar="U,V", action="append", help="parameters of a place")
    group.add_argument(
        "--barycentric", metavar="R,S,T", action="append", help="a place on a triangle"
    )
    group.add_argument("--patch", metavar="K", help="index of the patch, if there are several")
    group.add_argument("--derivatives", metavar="N", help="0, 1 (default) or 2")
    add_fields(points)
    points.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    check_output(arguments)
    source = surface_source(arguments)
    flags = {name: getattr(arguments, name) for name in FLAGS}
    flag_values = {name: _parse_value(text) for name, text in flags.items() if text is not None}
    if {"uv", "barycentric"} & flag_values.keys() and isinstance(source, dict):
        # Places on the command line replace those in the file.
        source = {key: value for key, value in source.items() if key not in PLACE_FLAGS}
    document = surface_document(source) | flag_values
    return perform_document(arguments, "/v1/points", document, _compute, flags=flag_values)


def _parse_value(text: str | list[str]) -> Any:
    """The value of a flag, as in a document; the model of the request refuses malformed numbers."""
    if isinstance(text, list):
        return [parse_numbers(place) for place in text]
    return parse_number(text)


def parse_numbers(text: str) -> list[int | float | str]:
    """Comma-separated numbers; a malformed number stays a string, which the model refuses."""
    return [parse_number(part) for part in text.split(",")]


def parse_number(text: str) -> int | float | str:
    """One number; a malformed number stays a string, which the model refuses."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _compute(document: Mapping[str, Any]) -> bytes:
    """Evaluates the points in this process."""
    from service.pipeline.points import plan_points
    from service.schemas.queries import PointsRequest

    request, limits = parse_request(PointsRequest, document)
    return plan_points(request.to_surface(), request.to_query(), limits).run()
