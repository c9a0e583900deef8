"""The command `surface`: serve, mesh, convert, examples, formats, openapi.

Whatever is heavy is imported by the command that needs it, so that `--help` answers at once.
"""

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from service.errors import BadAddress, Issue, ServiceFailed, SurfaceError, first_part

if TYPE_CHECKING:
    from service.encoders.format import Format

OPTIONS = (
    "resolution", "faces", "normals", "uvs", "weld", "crease_angle", "overlays", "oogl",
)  # fmt: skip
"""The options of a mesh, by name; their models would take too long to import for `--help`."""

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

_FILE_HELP = (
    "a JSON file (a surface, or a request with a surface and options), the id of an example, "
    "or - for standard input"
)


class UsageError(Exception):
    """The command line cannot be understood."""


class Refused(Exception):
    """Nothing can be done, and the lines say why."""


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
    mesh.add_argument("source", metavar="FILE|EXAMPLE", help=_FILE_HELP)
    mesh.add_argument(
        "-o", "--output", required=True, help="file to write, or - for standard output"
    )
    mesh.add_argument("--format", help="format, if the suffix of the output does not tell")
    mesh.add_argument("--url", help="let the service at this address do the work")
    _add_options(mesh)
    mesh.set_defaults(run=_mesh)

    convert = commands.add_parser(
        "convert",
        help="write a surface in another form with the same points",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    convert.add_argument("source", metavar="FILE|EXAMPLE", help=_FILE_HELP)
    convert.add_argument(
        "-o", "--output", required=True, help="JSON file to write, or - for standard output"
    )
    convert.add_argument("--url", help="let the service at this address do the work")
    _add_operations(convert)
    convert.set_defaults(run=_convert)

    for name, run, text in (
        ("examples", _examples, "list the built-in surfaces"),
        ("formats", _formats, "list the formats"),
        ("openapi", _openapi, "print the OpenAPI document"),
    ):
        command = commands.add_parser(name, help=text)
        command.set_defaults(run=run)
    return parser


def _add_options(mesh: argparse.ArgumentParser) -> None:
    """The options of a mesh; each overrides the same one in the file."""
    group = mesh.add_argument_group("options of the mesh")
    group.add_argument("--resolution", metavar="N|U,V", help="divisions of every patch (16)")
    group.add_argument("--faces", metavar="KIND", help="triangles (default) or quads")
    for name, text in (
        ("normals", "unit normals (yes)"),
        ("uvs", "parameters (u, v) where the surface has no uvs of its own (no)"),
        ("weld", "vertices shared along shared edges (yes)"),
    ):
        group.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=text)
    group.add_argument("--crease-angle", metavar="RADIANS", help="keep normals apart beyond (1°)")
    group.add_argument("--overlays", metavar="A,B", help="lines: control_net, boundary")
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
    fmt = _format(arguments)
    source = _source(arguments.source)
    chosen = _chosen(arguments)
    try:
        if arguments.url is None:
            content = _local(source, chosen, fmt)
        else:
            from service.remote import remote_mesh

            content = remote_mesh(arguments.url, source, chosen, fmt)
    except SurfaceError as error:
        raise Refused(*(_issue_line(issue, chosen) for issue in error.issues)) from None
    _write(arguments.output, content)
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
    _write(arguments.output, content)
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


def _format(arguments: argparse.Namespace) -> "Format":
    """The format by name, else by the suffix of the output."""
    from service.encoders.registry import BY_NAME, BY_SUFFIX

    if not arguments.output:
        raise UsageError("--output: empty; needed a file, or - for standard output")
    if arguments.format is not None:
        if arguments.format not in BY_NAME:
            raise UsageError(f"--format: unknown; needed one of {', '.join(BY_NAME)}")
        return BY_NAME[arguments.format]
    suffix = Path(arguments.output).suffix.removeprefix(".").lower()
    if arguments.output == "-" or suffix not in BY_SUFFIX:
        raise UsageError(
            f"the output's name does not tell the format; needed --format or one of the suffixes "
            f"{', '.join(BY_SUFFIX)}"
        )
    return BY_SUFFIX[suffix]


def _source(source: str) -> str | dict[str, Any]:
    """The id of an example, or the request in a file.

    A file that holds a bare surface makes a request without options.
    """
    from service.schemas.document import parse_document
    from service.surface.examples import EXAMPLES

    if not source:
        raise UsageError("the name is empty; needed a file, an example or - for standard input")
    if source in EXAMPLES and not Path(source).exists():
        return source
    if source == "-":
        if sys.stdin is None:
            raise Refused("standard input is closed")
        document = parse_document(sys.stdin.buffer.read())
    elif Path(source).exists():
        document = parse_document(Path(source).read_bytes())
    else:
        raise UsageError(f"no such file and no such example; examples: {', '.join(EXAMPLES)}")
    if isinstance(document, dict) and "surface" in document:
        return document
    return {"surface": document}


def _chosen(arguments: argparse.Namespace) -> dict[str, str]:
    """The options that the command line gives, as a query would give them."""
    chosen: dict[str, str] = {}
    for name in OPTIONS:
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
    _print("".join(f"{line}\n" for line in lines).encode())


def _write(output: str, content: bytes) -> None:
    """Writes to a file, or to standard output for "-".

    Raises
    ------
    OSError
        With the name that was given, not that of a file beside it.
    """
    if output == "-":
        _print(content)
        return
    try:
        _write_file(Path(os.path.realpath(output)), content)
    except OSError as error:
        raise OSError(error.errno, error.strerror, output) from None


def _write_file(place: Path, content: bytes) -> None:
    """Writes a whole file or none: beside its place first, then into it."""
    if place.exists() and not place.is_file():
        # A device or a pipe: nothing may be put in its place.
        place.write_bytes(content)
        return
    beside = place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        with beside.open("xb") as file:
            file.write(content)
        beside.replace(place)
    finally:
        beside.unlink(missing_ok=True)


def _print(content: bytes) -> None:
    """Writes to standard output; silent where the program that should read it has ended."""
    if sys.stdout is None:
        raise Refused("standard output is closed")
    rest = memoryview(content)
    try:
        while rest:  # with PYTHONUNBUFFERED a write may end early, and only the next one fails
            rest = rest[sys.stdout.buffer.write(rest) :]
        sys.stdout.buffer.flush()
    except OSError as error:
        # Python writes what is left in the buffer when it ends, and would fail once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise Refused from None
        raise OSError(error.errno, error.strerror, "standard output") from None


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
