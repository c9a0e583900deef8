"""The command `surface`: serve, mesh, convert, curve, examples, formats, openapi.

Whatever is heavy is imported by the command that needs it, so that `--help` answers at once.
"""

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from service.errors import BadAddress, Issue, ServiceFailed, SurfaceError, first_part
from service.output import Refused, print_bytes, write

if TYPE_CHECKING:
    from service.encoders.curve_format import CurveFormat
    from service.encoders.format import FileFormat, Format

AnyFormat = TypeVar("AnyFormat", bound="FileFormat")

OPTIONS = (
    "resolution", "faces", "normals", "uvs", "weld", "crease_angle", "overlays", "oogl",
    "isocurves", "wires", "wire_width", "wire_sides", "method",
)  # fmt: skip
"""The options of a mesh, by name; their models would take too long to import for `--help`."""

CURVE_OPTIONS = ("resolution", "tolerance", "tangents", "arc_lengths")
"""The options of a curve, by name."""

_DRAIN = 25
"""Seconds that answers under way may take once the service is told to stop."""

OK, REFUSED, USAGE, UNREACHABLE = range(4)

_EXIT_CODES = """\
exit codes:
  0  done
  1  refused: the surface or an option says nothing that can be computed, a file cannot
     be read or written, the port is taken, or standard output was closed (silently, if
     that was by the program it is piped into)
  2  the command line itself, or a variable SURFACE_*, is wrong
  3  the service given by --url does not answer, or fails
"""

_CURVE_HELP = (
    "a JSON file (a curve, or a request with a curve and options), or - for standard input"
)

_FILE_HELP = (
    "a JSON file (a surface, or a request with a surface and {}), the id of an example, or - for "
    "standard input"
)


class UsageError(Exception):
    """The command line cannot be understood."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    options = _parser().parse_args(arguments)
    from service.settings import InvalidSettings

    try:
        return int(options.run(options))
    except SurfaceError as error:
        for issue in error.issues:
            _complain(_issue_line(issue))
        return REFUSED
    except Refused as error:
        for line in error.args:
            _complain(line)
        return REFUSED
    except (UsageError, BadAddress, InvalidSettings) as error:
        _complain(str(error))
        return USAGE
    except ServiceFailed as error:
        _complain(str(error))
        return UNREACHABLE
    except OSError as error:
        _complain(f"{error.filename or 'output'}: {error.strerror}")
        return REFUSED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="surface",
        description="Parametric surfaces in, meshes out.",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    serve = commands.add_parser("serve", help="answer over HTTP")
    serve.add_argument("--host", help="address to listen at (SURFACE_HOST, 127.0.0.1)")
    serve.add_argument("--port", help="port to listen at (SURFACE_PORT, 8000)")
    serve.set_defaults(run=_serve)

    mesh = commands.add_parser(
        "mesh",
        help="write the mesh of a surface",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    mesh.add_argument("source", metavar="FILE|EXAMPLE", help=_FILE_HELP.format("options"))
    _add_output(mesh)
    _add_options(mesh)
    mesh.set_defaults(run=_mesh)

    convert = commands.add_parser(
        "convert",
        help="write a surface in another form with the same points",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    convert.add_argument("source", metavar="FILE|EXAMPLE", help=_FILE_HELP.format("operations"))
    convert.add_argument(
        "-o", "--output", required=True, help="JSON file to write, or - for standard output"
    )
    convert.add_argument("--url", help="let the service at this address do the work")
    _add_operations(convert)
    convert.set_defaults(run=_convert)
    curve = commands.add_parser(
        "curve",
        help="write a curve as points or lines",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    curve.add_argument("source", metavar="FILE", help=_CURVE_HELP)
    _add_output(curve)
    _add_curve_options(curve)
    curve.set_defaults(run=_curve)

    for name, run, text in (
        ("examples", _examples, "list the built-in surfaces"),
        ("formats", _formats, "list the formats"),
        ("openapi", _openapi, "print the OpenAPI document"),
    ):
        command = commands.add_parser(name, help=text)
        command.set_defaults(run=run)
    return parser


def _add_output(command: argparse.ArgumentParser) -> None:
    """Where the file goes, and who computes it."""
    command.add_argument(
        "-o", "--output", required=True, help="file to write, or - for standard output"
    )
    command.add_argument("--format", help="format, if the suffix of the output does not tell")
    command.add_argument("--url", help="let the service at this address do the work")


def _add_curve_options(curve: argparse.ArgumentParser) -> None:
    """The options of a curve; each overrides the same one in the file."""
    group = curve.add_argument_group("options of the curve")
    group.add_argument("--resolution", metavar="N", help="divisions of every piece (16)")
    group.add_argument(
        "--tolerance", metavar="DISTANCE", help="instead: how far lines may be from the curve"
    )
    for name, text in (
        ("tangents", "unit tangents (yes)"),
        ("arc-lengths", "length up to every point (yes)"),
    ):
        group.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)


def _add_options(mesh: argparse.ArgumentParser) -> None:
    """The options of a mesh; each overrides the same one in the file."""
    group = mesh.add_argument_group("options of the mesh")
    group.add_argument("--resolution", metavar="N|U,V", help="divisions of every patch (16)")
    group.add_argument("--faces", metavar="KIND", help="triangles (default), quads or none")
    for name, text in (
        ("normals", "unit normals (yes)"),
        ("uvs", "parameters (u, v) where the surface has no uvs of its own (no)"),
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


class _Append(argparse.Action):
    """Appends the name of a flag and its text to the operations, whichever flag it is."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """The flags in the order in which they stand, for that is the order of the work."""
        del parser, option_string
        text = values if isinstance(values, str) else ""
        namespace.operations = [*(namespace.operations or []), (self.metavar_name, text)]

    @property
    def metavar_name(self) -> str:
        """The flag without its hyphens."""
        return self.option_strings[0].removeprefix("--")


def _add_operations(convert: argparse.ArgumentParser) -> None:
    """The operations, done in the order in which they are given; they replace those of a file."""
    group = convert.add_argument_group("operations, done in the order given")
    for flag, metavar, text in (
        ("elevate", "P,Q|N", "raise the degree"),
        ("split", "u=A,v=B|R,S,T", "cut at u, at v or at both; a triangle at a point"),
        ("restrict", "u=A:B,v=C:D", "cut out a piece"),
        ("transpose", None, "exchange u and v"),
        ("reverse", "u|v", "run u or v backwards"),
        ("bezier", None, "make Bézier patches of a B-spline"),
        ("triangle", "lower|upper", "make a triangular patch of half a patch"),
        ("operations", "JSON", "a list of operations as in a request"),
    ):
        nargs = 0 if metavar is None else None
        group.add_argument(
            f"--{flag}", action=_Append, dest="operations", nargs=nargs, metavar=metavar, help=text
        )


def _serve(arguments: argparse.Namespace) -> int:
    import uvicorn

    from service.api.app import create_app
    from service.settings import from_environment, with_flags

    given = {"host": arguments.host, "port": arguments.port}
    flags = {name: text for name, text in given.items() if text is not None}
    settings = with_flags(from_environment(), flags)
    host, port = settings.host, settings.port
    try:
        uvicorn.run(create_app(settings), host=host, port=port, timeout_graceful_shutdown=_DRAIN)
    except SystemExit as stop:
        if stop.code:
            # It has logged why; its exit code would mean something else here.
            raise Refused(f"cannot serve at {host}, port {port}; the reason stands above") from None
    return OK


def _mesh(arguments: argparse.Namespace) -> int:
    fmt = _mesh_format(arguments)
    source = _source(arguments.source)
    chosen = _chosen(arguments, OPTIONS)
    try:
        if arguments.url is None:
            content = _local(source, chosen, fmt)
        else:
            from service.remote import remote_mesh

            content = remote_mesh(arguments.url, source, chosen, fmt)
    except SurfaceError as error:
        raise Refused(*(_issue_line(issue, chosen) for issue in error.issues)) from None
    write(arguments.output, content)
    return OK


def _convert(arguments: argparse.Namespace) -> int:
    from service.schemas.operation_text import operations_from_text

    if not arguments.output:
        raise UsageError("--output: empty; needed a file, or - for standard output")
    source = _source(arguments.source)
    flags: list[str] = []
    try:
        document = _document(source)
        if arguments.operations is not None:
            flags, operations = operations_from_text(arguments.operations)
            document = document | {"operations": operations}
        if arguments.url is None:
            content = _converted_here(document)
        else:
            from service.remote import remote_convert

            content = remote_convert(arguments.url, document)
    except SurfaceError as error:
        raise Refused(*(_operation_line(issue, flags) for issue in error.issues)) from None
    write(arguments.output, content)
    return OK


def _document(source: str | dict[str, Any]) -> dict[str, Any]:
    """The request in a file, or the surface of an example as one."""
    import orjson

    from service.encoders.text import json_text
    from service.schemas.surfaces import definition
    from service.surface.examples import find

    if isinstance(source, dict):
        return source
    # As a file would hold it: numbers in lists, not in arrays.
    return {"surface": orjson.loads(json_text(definition(find(source).surface())))}


def _converted_here(document: dict[str, Any]) -> bytes:
    """The new surface, computed in this process."""
    from service import pipeline
    from service.schemas.convert import convert_request
    from service.settings import document_limits, from_environment, pin_blas, result_limits
    from service.surface.convert.nets import Allowed

    pin_blas()
    settings = from_environment()
    request = convert_request(document, document_limits(settings))
    surface, operations = request.to_surface(), request.to_operations()
    allowed = Allowed(settings.max_control_points, settings.max_degree)
    return pipeline.converted(surface, operations, allowed, result_limits(settings))


def _operation_line(issue: Issue, flags: Sequence[str]) -> str:
    """One issue as a line; it names the flag that asked for the operation."""
    _, first, number = (*issue.pointer.split("/"), "", "")[:3]
    if first == "operations" and number.isdecimal() and int(number) < len(flags):
        return _issue_line(
            replace(issue, pointer=f"/{flags[int(number)]}"), dict.fromkeys(flags, "")
        )
    return _issue_line(issue)


def _curve(arguments: argparse.Namespace) -> int:
    from service.encoders.curve_registry import CURVE_FORMATS

    fmt = _format(arguments, CURVE_FORMATS)
    source = _read(arguments.source, "curve", "no such file")
    chosen = _chosen(arguments, CURVE_OPTIONS)
    if "resolution" in chosen or "tolerance" in chosen:
        # One of the two on the command line takes the place of either in the file.
        source = {key: value for key, value in source.items() if key not in CURVE_OPTIONS[:2]}
    try:
        if arguments.url is None:
            content = _local_curve(source, chosen, fmt)
        else:
            from service.remote import remote_curve

            content = remote_curve(arguments.url, source, chosen, fmt)
    except SurfaceError as error:
        raise Refused(*(_issue_line(issue, chosen) for issue in error.issues)) from None
    write(arguments.output, content)
    return OK


def _mesh_format(arguments: argparse.Namespace) -> "Format":
    from service.encoders.registry import FORMATS

    return _format(arguments, FORMATS)


def _format(arguments: argparse.Namespace, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format by name, else by the suffix of the output."""
    by_name = {fmt.name: fmt for fmt in formats}
    by_suffix = {fmt.suffix: fmt for fmt in formats}
    if not arguments.output:
        raise UsageError("--output: empty; needed a file, or - for standard output")
    if arguments.format is not None:
        if arguments.format not in by_name:
            raise UsageError(f"--format: unknown; needed one of {', '.join(by_name)}")
        return by_name[arguments.format]
    suffix = Path(arguments.output).suffix.removeprefix(".").lower()
    if arguments.output == "-" or suffix not in by_suffix:
        raise UsageError(
            f"the output's name does not tell the format; needed --format or one of the suffixes "
            f"{', '.join(by_suffix)}"
        )
    return by_suffix[suffix]


def _source(source: str) -> str | dict[str, Any]:
    """The id of an example, or the request in a file."""
    from service.surface.examples import EXAMPLES

    if source in EXAMPLES and not Path(source).exists():
        return source
    missing = f"no such file and no such example; examples: {', '.join(EXAMPLES)}"
    return _read(source, "surface", missing)


def _read(source: str, what: str, missing: str) -> dict[str, Any]:
    """The request in a file; one that holds a bare surface or curve makes one without options."""
    from service.schemas.document import parse_document

    if not source:
        raise UsageError(f"the name is empty; needed a file with a {what}, or - for standard input")
    if source == "-":
        if sys.stdin is None:
            raise Refused("standard input is closed")
        document = parse_document(sys.stdin.buffer.read())
    elif Path(source).exists():
        document = parse_document(Path(source).read_bytes())
    else:
        raise UsageError(missing)
    if isinstance(document, dict) and what in document:
        return document
    return {what: document}


def _chosen(arguments: argparse.Namespace, names: Sequence[str]) -> dict[str, str]:
    """The options that the command line gives, as a query would give them."""
    chosen: dict[str, str] = {}
    for name in names:
        value = getattr(arguments, name)
        if value is not None:
            chosen[name] = str(value).lower() if isinstance(value, bool) else value
    return chosen


def _local(source: str | dict[str, Any], chosen: Mapping[str, str], fmt: "Format") -> bytes:
    """The file, computed in this process."""
    from service import pipeline
    from service.encoders.format import EncodeOptions
    from service.schemas.query import options_from_text, values_from_text
    from service.schemas.request import mesh_request
    from service.settings import document_limits, from_environment, pin_blas, result_limits
    from service.surface.examples import find

    pin_blas()
    settings = from_environment()
    if isinstance(source, str):
        surface: pipeline.Lowerable = find(source).surface()
        wanted = options_from_text(chosen.items())
    else:
        request = mesh_request(source | values_from_text(chosen.items()), document_limits(settings))
        surface, wanted = request.to_surface(), request
    return pipeline.render(
        surface, wanted.mesh_options(), fmt, EncodeOptions(wanted.oogl), result_limits(settings)
    )


def _local_curve(source: dict[str, Any], chosen: Mapping[str, str], fmt: "CurveFormat") -> bytes:
    """The file of a curve, computed in this process."""
    from service.curve_pipeline import render_curve
    from service.schemas.curve_request import curve_request
    from service.schemas.query import values_from_text
    from service.settings import document_limits, from_environment, pin_blas, result_limits

    pin_blas()
    settings = from_environment()
    wanted = curve_request(source | values_from_text(chosen.items()), document_limits(settings))
    return render_curve(wanted.to_curve(), wanted.curve_options(), fmt, result_limits(settings))


def _examples(_: argparse.Namespace) -> int:
    from service.surface.examples import EXAMPLES

    width = max(map(len, EXAMPLES))
    _print_lines(f"{example.id:<{width}}  {example.title}" for example in EXAMPLES.values())
    return OK


def _formats(_: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    _print_lines(
        f"{fmt.name:<5} .{fmt.suffix:<5} {fmt.media_type:<20} {fmt.title}" for fmt in FORMATS
    )
    return OK


def _openapi(_: argparse.Namespace) -> int:
    import json

    from service.api.openapi import document

    _print_lines([json.dumps(document(), indent=2, ensure_ascii=False)])
    return OK


def _print_lines(lines: Iterable[str]) -> None:
    print_bytes("".join(f"{line}\n" for line in lines).encode())


def _issue_line(issue: Issue, chosen: Mapping[str, str] = MappingProxyType({})) -> str:
    """One issue as a line; it names the flag where the value is one that the command line chose."""
    name = first_part(issue.pointer)
    place = f"--{name.replace('_', '-')}" if name in chosen else issue.pointer
    facts = ", ".join(
        f"{name} {text}" for name, text in (("got", issue.got), ("needed", issue.needed)) if text
    )
    return (f"{place}: " if place else "") + issue.message + (f" ({facts})" if facts else "")


def _complain(line: str) -> None:
    if sys.stderr is not None:  # else `print` would take standard output
        print(f"surface: {line}", file=sys.stderr)
