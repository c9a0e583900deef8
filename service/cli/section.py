"""`surface section`: writes where planes cut a surface, as polylines."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from service.cli.document import parse_request, perform_document
from service.cli.nets import add_fields
from service.cli.points import parse_number, parse_numbers
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    choose_format,
    surface_document,
    surface_source,
)

if TYPE_CHECKING:
    from service.encoders.sections.format import SectionFormat

TOLERANCES = ("tolerance", "relative_tolerance")

FIELDS = ("surface", "planes", *TOLERANCES)
"""The fields of a request with planes. `/v1/intersect` also takes requests with rays."""


def add(commands: Commands) -> None:
    """Adds the command and its flags; each overrides the file's field."""
    text = "write where planes cut a surface: JSON, glTF, OBJ, OOGL, SVG"
    section = add_command(commands, "section", text)
    add_source(section, "planes")
    add_output(section)
    group = section.add_argument_group("planes")
    group.add_argument("--normal", metavar="X,Y,Z", help="normal of all planes (0,0,1)")
    group.add_argument(
        "--offsets",
        metavar="D,D,…",
        help="distances of the planes from the origin, along the normal",
    )
    group.add_argument(
        "--point",
        metavar="X,Y,Z",
        action="append",
        help="instead of --offsets: a point of a plane; may be repeated",
    )
    group.add_argument("--tolerance", metavar="DISTANCE", help="largest deviation, in model units")
    group.add_argument(
        "--relative-tolerance", metavar="X", help="largest deviation, in diagonals (1e-3)"
    )
    add_fields(section)
    section.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.encoders.sections.registry import SECTION_FORMATS

    fmt = choose_format(arguments, SECTION_FORMATS)
    fields = surface_document(surface_source(arguments))
    # A file may have a request with rays, for `surface intersect`: take only the fields for planes.
    document = {key: value for key, value in fields.items() if key in FIELDS}
    flag_values: dict[str, Any] = {}
    if arguments.offsets is not None or arguments.point is not None or arguments.normal is not None:
        file_planes = document.get("planes")
        planes = dict(file_planes) if isinstance(file_planes, dict) else {"normals": [[0, 0, 1]]}
        if arguments.normal is not None:
            planes["normals"] = [parse_numbers(arguments.normal)]
        # Offsets replace the points of the file, and points its offsets; with both flags, the model
        # refuses the planes.
        if arguments.offsets is not None:
            planes["offsets"] = parse_numbers(arguments.offsets)
            planes.pop("points", None)
        if arguments.point is not None:
            planes["points"] = [parse_numbers(text) for text in arguments.point]
            if arguments.offsets is None:
                planes.pop("offsets", None)
        flag_values["planes"] = planes
    for name in TOLERANCES:
        text = getattr(arguments, name)
        if text is not None:
            # Each of the two tolerances replaces both in the file.
            document = {key: value for key, value in document.items() if key not in TOLERANCES}
            flag_values[name] = parse_number(text)
    return perform_document(
        arguments,
        "/v1/intersect",
        document | flag_values,
        lambda document: _compute(document, fmt),
        flags=flag_values,
        fmt=fmt,
    )


def _compute(document: Mapping[str, Any], fmt: "SectionFormat") -> bytes:
    """Computes the sections in this process."""
    from service.pipeline.section import plan_sections
    from service.schemas.intersect import IntersectRequest

    request, limits = parse_request(IntersectRequest, document)
    return plan_sections(request.to_surface(), request.to_sections(), fmt, limits).run()
