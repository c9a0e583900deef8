"""`surface mesh` writes the mesh of a surface, and `surface estimate` its size."""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.baking import Many, make_files
from service.cli.documents import (
    command_limits,
    parse_request,
    perform_document,
    post_file,
    send_file,
)
from service.cli.files import FILE_FLAGS, SourceFile, choose_decoder, read_field_flags
from service.cli.flags import Command, Flag, flag, option_texts, read_values
from service.cli.output import (
    check_output,
    choose_format,
    find_format,
    output_flags,
    perform,
    printable,
)
from service.cli.refusals import Refused, UsageError
from service.cli.source import (
    Source,
    build_document,
    field_line,
    find_stored_id,
    read_document,
    source_flag,
    surface_source,
)
from service.errors import InvalidRequest, Issue, SurfaceError

if TYPE_CHECKING:
    from service.encoders.format import Format
    from service.jobs.bake import Entry

_OPTIONS = json.loads(Path(__file__).with_name("flags.json").read_bytes())
"""The options of a mesh, in a file that `make generated` writes: to import their models is slow.

`value` is the metavar of an option, or None if the option is on or off; `text` is its help."""

ACCURACY = tuple(option["name"] for option in _OPTIONS if option["is_accuracy"])
"""Options that replace a resolution."""

CAMERA_FIELDS = ("camera", "pixel_tolerance")
"""Options that replace a resolution and have no flags: only files have them."""


_TITLES = ("options of the mesh", "instead of a resolution: accuracy, proved")


def _option_flag(option: Mapping[str, Any]) -> Flag:
    name, value = option["name"].replace("_", "-"), option["value"]
    switch = {"action": argparse.BooleanOptionalAction} if value is None else {}
    return flag(f"--{name}", option["text"], value, **switch)


_GROUPS = tuple(
    (_TITLES[is_accuracy], tuple(map(_option_flag, options)))
    for is_accuracy, options in groupby(_OPTIONS, itemgetter("is_accuracy"))
)


def _read_options(arguments: argparse.Namespace) -> dict[str, str]:
    """The options that flags set, as texts of a query, by name."""
    return option_texts(read_values(arguments, (each for _, flags in _GROUPS for each in flags)))


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


def _run_mesh(arguments: argparse.Namespace) -> int:
    if len(arguments.source) > 1 or _is_folder(arguments.output):
        return _run_meshes(arguments)
    return _run_one_mesh(_select_source(arguments, arguments.source[0]))


def _is_folder(output: str) -> bool:
    """Whether an output is a folder or a bucket, which gets one file for each input."""
    return output.endswith("/") or "://" in output or Path(output).is_dir()


def _run_one_mesh(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    fmt = choose_format(arguments, FORMATS)
    source = find_stored_id(arguments) or surface_source(arguments)
    flag_values = _read_options(arguments)
    if isinstance(source, dict):
        source = drop_replaced(source, flag_values)
    return perform(
        arguments,
        lambda: _compute_mesh(source, flag_values, fmt),
        lambda: _request_mesh(arguments.url, source, flag_values, fmt),
        lambda issue: field_line(issue, flag_values | read_field_flags(arguments)),
    )


def _request_mesh(url: str, source: Source, flag_values: Mapping[str, str], fmt: "Format") -> bytes:
    """Gets the file from the service at `url`; sends a file that is not JSON unchanged."""
    from service.cli import remote
    from service.schemas.query import values_from_text

    if isinstance(source, SourceFile):
        return post_file(url, "/v1/mesh", source, flag_values, fmt)
    if isinstance(source, str):
        return remote.fetch_mesh(url, source, flag_values, fmt)
    return remote.post(url, "/v1/mesh", source | values_from_text(flag_values.items()), fmt)


def _compute_mesh(source: Source, flag_values: Mapping[str, str], fmt: "Format") -> bytes:
    """Computes the file in this process. A `source` that is a text is the id of an example."""
    from service.pipeline.calls import plan_mesh_file
    from service.schemas.query import options_from_text, values_from_text
    from service.schemas.request import MeshRequest
    from service.surface.examples.catalogue import find
    from service.surface.kinds import Surface

    if isinstance(source, str):
        limits = command_limits()
        surface: Surface = find(source).surface()
        options = options_from_text(flag_values.items())
    else:
        source = source.read()[0] if isinstance(source, SourceFile) else source
        request, limits = parse_request(MeshRequest, source | values_from_text(flag_values.items()))
        surface, options = request.to_surface(), request
    return bytes(plan_mesh_file(surface, options, fmt, limits).run().content)


def _run_meshes(arguments: argparse.Namespace) -> int:
    """Writes the meshes of all sources into a folder or a bucket, as `surface bake` does."""
    from service.encoders.registry import BY_SUFFIX, FORMATS

    check_output(arguments)
    suffix = Path(arguments.output).suffix.removeprefix(".").lower()
    if not _is_folder(arguments.output) and (arguments.output == "-" or suffix in BY_SUFFIX):
        raise UsageError("--output: several inputs need a folder, such as out/")
    fmt = find_format(arguments.format or "glb", FORMATS)
    if arguments.url is not None:
        raise UsageError("--url: writes one file; meshes in a folder are computed here")
    if "-" in arguments.source:
        raise UsageError("standard input has no name; needed files for an output in a folder")
    flag_values = _read_options(arguments)
    all_flags = {*flag_values, *read_field_flags(arguments)}

    def read(_: int, source: str) -> "Entry":
        return _read_entry(_select_source(arguments, source), flag_values, fmt)

    return make_files(
        Many(arguments.source, read, len(arguments.source), arguments.output),
        lambda issue: field_line(
            replace(issue, pointer=issue.pointer.removeprefix("/body")), all_flags
        ),
    )


def _select_source(arguments: argparse.Namespace, source: str) -> argparse.Namespace:
    """The arguments of a command with one source."""
    return argparse.Namespace(**{**vars(arguments), "source": source})


def _read_entry(
    arguments: argparse.Namespace, flag_values: Mapping[str, str], fmt: "Format"
) -> "Entry":
    """The part of one source, or the reason why it cannot be read."""
    import orjson

    from service.encoders.text import json_text
    from service.jobs.bake import Entry
    from service.schemas.query import values_from_text

    place, name = printable(arguments.source), printable(Path(arguments.source).stem)
    try:
        if (decoder := choose_decoder(arguments)) is not None and decoder.is_cad:
            return _build_file_entry(arguments, flag_values, fmt)
        document = drop_replaced(read_document(arguments), flag_values)
        # Files of control points are read as arrays, and the text of a part has lists.
        text = json_text(document | values_from_text(flag_values.items()))
    except SurfaceError as error:
        return Entry(place, name, {}, 0, error)
    except (Refused, UsageError, OSError) as error:
        message = (error.strerror or "") if isinstance(error, OSError) else "; ".join(error.args)
        return Entry(place, name, {}, 0, InvalidRequest(Issue("unreadable", message)))
    line = {"path": f"/v1/mesh?format={fmt.name}", "body": orjson.loads(text)}
    return Entry(place, name, line, len(text))


def _build_file_entry(
    arguments: argparse.Namespace, flag_values: Mapping[str, str], fmt: "Format"
) -> "Entry":
    """The part of a CAD file, which the process that computes it reads."""
    from urllib.parse import urlencode

    from service.jobs.bake import Entry

    source = Path(arguments.source)
    query = urlencode({"format": fmt.name, **read_field_flags(arguments), **flag_values})
    line = {"path": f"/v1/mesh?{query}", "file": str(source.absolute())}
    return Entry(printable(arguments.source), printable(source.stem), line, source.stat().st_size)


def _run_estimate(arguments: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS
    from service.schemas.query import values_from_text

    check_output(arguments)
    formats: Sequence[Format] = FORMATS
    query = {}
    if arguments.format is not None:
        formats = (find_format(arguments.format, FORMATS),)
        query = {"format": str(arguments.format)}
    flag_values = _read_options(arguments)
    source = surface_source(arguments)
    if isinstance(source, SourceFile) and arguments.url is not None:
        return send_file(arguments, "/v1/estimate", source, flag_values, query=query)
    document = build_document(source)
    return perform_document(
        arguments,
        "/v1/estimate",
        drop_replaced(document, flag_values) | values_from_text(flag_values.items()),
        partial(_compute_estimate, formats),
        flags=flag_values,
        query=query,
    )


def _compute_estimate(formats: "Sequence[Format]", document: Mapping[str, Any]) -> bytes:
    """Computes the estimate in this process."""
    from service.pipeline.estimate import plan_estimate
    from service.pipeline.mesh import select_encode_options
    from service.schemas.request import MeshRequest

    request, limits = parse_request(MeshRequest, document)
    options, encode = request.mesh_options(), select_encode_options(request)
    return plan_estimate(request.to_surface(), options, encode, limits.result, formats).run()


MESH = Command(
    "mesh",
    "write the mesh of a surface, or of several into a folder",
    _run_mesh,
    (
        source_flag(
            "options", "; with --url also the id of a surface that is stored there", nargs="+"
        ),
        *output_flags(),
    ),
    groups=(*_GROUPS, FILE_FLAGS),
    description="If the output is a folder, such as out/, or a bucket, s3://bucket/prefix, it gets "
    "a file for each input, with the name of the input and, without --format, as GLB. What an "
    "earlier run has made is not made again. Inputs that fail are listed at the end, and the exit "
    "code is then 1.",
    has_exit_codes=True,
)

ESTIMATE = Command(
    "estimate",
    "write the size of a mesh before it is computed: vertices, faces, bytes, limits",
    _run_estimate,
    (
        source_flag("options"),
        *output_flags(formats=False),
        flag("--format", "estimate this format only", "NAME"),
    ),
    groups=(*_GROUPS, FILE_FLAGS),
    has_exit_codes=True,
)
