"""`surface mesh`: writes the mesh of a surface."""

import argparse
from collections.abc import Mapping
from types import ModuleType
from typing import TYPE_CHECKING, Any

from service.cli.nets import NetFile, add_fields, chosen_fields, field_line
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    chosen_format,
    chosen_options,
    perform,
    stored_id,
    surface_source,
)

if TYPE_CHECKING:
    from service.encoders.format import Format

ACCURACY = (
    "tolerance", "relative_tolerance", "angle_tolerance", "max_triangles", "max_bytes", "two_sided",
)  # fmt: skip
"""Options that take the place of a resolution."""

SEEN = ("camera", "pixel_tolerance")
"""Such options that only files have."""

OPTIONS = (
    *ACCURACY, "resolution", "faces", "normals", "uvs", "curvatures", "weld", "crease_angle",
    "overlays", "oogl", "isocurves", "wires", "wire_width", "wire_sides", "method",
    "quantize", "compression",
)  # fmt: skip
"""The options of a mesh, by name; their models would take too long to import for `--help`."""


def add(commands: Commands) -> None:
    """The command and its flags."""
    mesh = add_command(commands, "mesh", "write the mesh of a surface")
    add_source(mesh, "options", "; with --url also the id of a surface that is stored there")
    add_output(mesh)
    add_options(mesh)
    add_fields(mesh)
    mesh.set_defaults(run=_run)


def add_options(mesh: argparse.ArgumentParser) -> None:
    """The options of a mesh; each overrides the same one in the file."""
    group = mesh.add_argument_group("options of the mesh")
    group.add_argument("--resolution", metavar="N|U,V", help="divisions of every patch (16)")
    _add_accuracy(mesh)
    group.add_argument("--faces", metavar="KIND", help="triangles (default), quads or none")
    for name, text in (
        ("normals", "unit normals (yes)"),
        ("uvs", "parameters (u, v) where the surface has no uvs of its own (no)"),
        ("curvatures", "Gaussian and mean curvature as attributes (no)"),
        ("weld", "vertices shared along shared edges (yes)"),
    ):
        group.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)
    group.add_argument("--crease-angle", metavar="RADIANS", help="keep normals apart beyond (1°)")
    group.add_argument("--overlays", metavar="A,B", help="lines: control_net, boundary")
    group.add_argument("--isocurves", metavar="N|U,V", help="curves across every patch (0)")
    group.add_argument("--wires", metavar="KIND", help="these as lines (default), tubes or ribbons")
    group.add_argument("--wire-width", metavar="LENGTH", help="width of these (diagonal / 300)")
    group.add_argument("--wire-sides", metavar="N", help="sides of a tube (8)")
    group.add_argument(
        "--method", metavar="NAME", help="matrix (default), de_casteljau, forward_difference"
    )
    group.add_argument("--oogl", metavar="FORM", help="form of OOGL: cquad, mesh, off, bez")
    group.add_argument(
        "--quantize",
        action=argparse.BooleanOptionalAction,
        help="glTF in whole numbers, 16 bits a coordinate (no)",
    )
    group.add_argument("--compression", metavar="NAME", help="of glTF: none (default), meshopt")


def _add_accuracy(mesh: argparse.ArgumentParser) -> None:
    """What may be said instead of a resolution."""
    group = mesh.add_argument_group("instead of a resolution: accuracy, proved")
    group.add_argument("--tolerance", metavar="LENGTH", help="how far the mesh may be")
    group.add_argument("--relative-tolerance", metavar="SHARE", help="the same, of the diagonal")
    group.add_argument("--angle-tolerance", metavar="RADIANS", help="between neighbouring normals")
    group.add_argument("--max-triangles", metavar="N", help="the best that so many allow")
    group.add_argument("--max-bytes", metavar="N", help="the best that so many allow")
    group.add_argument(
        "--two-sided",
        action=argparse.BooleanOptionalAction,
        help="bound the distance from the mesh to the surface as well (no)",
    )


def overridden(source: dict[str, Any], chosen: Mapping[str, str]) -> dict[str, Any]:
    """The request without what the options of the command line take the place of.

    A resolution takes the place of an accuracy, an accuracy that of a resolution, and of the two
    tolerances one that of the other.
    """
    gone: set[str] = set()
    if "resolution" in chosen:
        gone |= {*ACCURACY, *SEEN}
    elif any(name in chosen for name in ACCURACY):
        gone.add("resolution")
    if {"tolerance", "relative_tolerance"} & chosen.keys():
        gone |= {"tolerance", "relative_tolerance"}
    return {key: value for key, value in source.items() if key not in gone}


def _run(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    fmt = chosen_format(arguments, FORMATS)
    source = stored_id(arguments) or surface_source(arguments)
    chosen = chosen_options(arguments, OPTIONS)
    if isinstance(source, dict):
        source = overridden(source, chosen)
    return perform(
        arguments,
        lambda: _local(source, chosen, fmt),
        lambda remote: _remote(remote, arguments.url, source, chosen, fmt),
        lambda issue: field_line(issue, chosen | chosen_fields(arguments)),
    )


def _remote(
    remote: ModuleType,
    url: str,
    source: str | dict[str, Any] | NetFile,
    chosen: Mapping[str, str],
    fmt: "Format",
) -> bytes:
    """The file, computed by a service, which gets a file of control points as it is."""
    content: bytes
    if isinstance(source, NetFile):
        query, media_type = {**source.fields, **chosen}, source.decoder.media_type
        content = remote.remote_mesh_of_file(url, source.content, media_type, query, fmt)
    else:
        content = remote.remote_mesh(url, source, chosen, fmt)
    return content


def _local(
    source: str | dict[str, Any] | NetFile, chosen: Mapping[str, str], fmt: "Format"
) -> bytes:
    """The file, computed in this process."""
    from service.pipeline.encoding import encode_options
    from service.pipeline.mesh import render
    from service.schemas.query import options_from_text, values_from_text
    from service.schemas.request import MeshRequest
    from service.schemas.validation import validate_document
    from service.settings.environment import for_one_command
    from service.settings.process import pin_blas
    from service.settings.values import document_limits, result_limits
    from service.surface import Surface
    from service.surface.examples import find

    pin_blas()
    settings = for_one_command()
    if isinstance(source, str):
        surface: Surface = find(source).surface()
        wanted = options_from_text(chosen.items())
    else:
        source = source.document() if isinstance(source, NetFile) else source
        request = validate_document(
            MeshRequest, source | values_from_text(chosen.items()), document_limits(settings)
        )
        surface, wanted = request.to_surface(), request
    return render(
        surface, wanted.mesh_options(), fmt, encode_options(wanted), result_limits(settings)
    )
