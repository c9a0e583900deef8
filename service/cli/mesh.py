"""`surface mesh`: writes the mesh of a surface."""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from service.cli.document import parse_request
from service.cli.nets import NetFile, add_fields, field_line, read_field_flags
from service.cli.source import (
    Commands,
    add_command,
    add_output,
    add_source,
    choose_format,
    find_stored_id,
    perform,
    read_option_flags,
    surface_source,
)

if TYPE_CHECKING:
    from service.encoders.format import Format

_FLAGS = json.loads(Path(__file__).with_name("flags.json").read_bytes())
"""The options of a mesh, in a file that `make generated` writes: to import their models is slow.

`value` is the metavar of an option, or None if the option is on or off; `text` is its help."""

OPTIONS = tuple(flag["name"] for flag in _FLAGS)

ACCURACY = tuple(flag["name"] for flag in _FLAGS if flag["is_accuracy"])
"""Options that replace a resolution."""

CAMERA_FIELDS = ("camera", "pixel_tolerance")
"""Options that replace a resolution and have no flags: only files have them."""


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    mesh = add_command(commands, "mesh", "write the mesh of a surface")
    add_source(mesh, "options", "; with --url also the id of a surface that is stored there")
    add_output(mesh)
    add_options(mesh)
    add_fields(mesh)
    mesh.set_defaults(run=_run)


def add_options(mesh: argparse.ArgumentParser) -> None:
    """Adds the options of a mesh; each overrides the file's."""
    shape = mesh.add_argument_group("options of the mesh")
    accuracy = mesh.add_argument_group("instead of a resolution: accuracy, proved")
    for option in _FLAGS:
        flag = f"--{option['name'].replace('_', '-')}"
        group = accuracy if option["is_accuracy"] else shape
        if option["value"] is None:
            group.add_argument(flag, action=argparse.BooleanOptionalAction, help=option["text"])
        else:
            group.add_argument(flag, metavar=option["value"], help=option["text"])


def drop_replaced(source: dict[str, Any], flag_values: Mapping[str, str]) -> dict[str, Any]:
    """The request of a file, without the options that flags of the command line replace.

    A resolution and a tolerance replace each other; `tolerance` and `relative_tolerance`, too.
    """
    replaced_names: set[str] = set()
    if "resolution" in flag_values:
        replaced_names |= {*ACCURACY, *CAMERA_FIELDS}
    elif any(name in flag_values for name in ACCURACY):
        replaced_names.add("resolution")
    if {"tolerance", "relative_tolerance"} & flag_values.keys():
        replaced_names |= {"tolerance", "relative_tolerance"}
    return {key: value for key, value in source.items() if key not in replaced_names}


def _run(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    fmt = choose_format(arguments, FORMATS)
    source = find_stored_id(arguments) or surface_source(arguments)
    flag_values = read_option_flags(arguments, OPTIONS)
    if isinstance(source, dict):
        source = drop_replaced(source, flag_values)
    return perform(
        arguments,
        lambda: _compute(source, flag_values, fmt),
        lambda remote: _request_mesh(remote, arguments.url, source, flag_values, fmt),
        lambda issue: field_line(issue, flag_values | read_field_flags(arguments)),
    )


def _request_mesh(
    remote: ModuleType,
    url: str,
    source: str | dict[str, Any] | NetFile,
    flag_values: Mapping[str, str],
    fmt: "Format",
) -> bytes:
    """Gets the file from the service at `url`; sends a file of control points unchanged."""
    content: bytes
    if isinstance(source, NetFile):
        query, media_type = {**source.fields, **flag_values}, source.decoder.media_type
        content = remote.remote_mesh_of_file(url, source.content, media_type, query, fmt)
    else:
        content = remote.remote_mesh(url, source, flag_values, fmt)
    return content


def _compute(
    source: str | dict[str, Any] | NetFile, flag_values: Mapping[str, str], fmt: "Format"
) -> bytes:
    """Computes the file in this process. A `source` that is a text is the id of an example."""
    from service.pipeline.mesh import render, select_encode_options
    from service.schemas.query import options_from_text, values_from_text
    from service.schemas.request import MeshRequest
    from service.settings.environment import command_settings
    from service.settings.runtime import pin_blas
    from service.settings.values import result_limits
    from service.surface.examples.catalogue import find
    from service.surface.kinds import Surface

    if isinstance(source, str):
        pin_blas()
        limits = result_limits(command_settings())
        surface: Surface = find(source).surface()
        options = options_from_text(flag_values.items())
    else:
        source = source.document() if isinstance(source, NetFile) else source
        request, limits = parse_request(MeshRequest, source | values_from_text(flag_values.items()))
        surface, options = request.to_surface(), request
    return render(surface, options.mesh_options(), fmt, select_encode_options(options), limits)
