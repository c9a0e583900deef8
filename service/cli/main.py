"""The command line: runs a command, and turns its errors into lines and exit codes."""

import argparse
from collections.abc import Sequence

from service import __version__
from service.cli.bake import BAKE
from service.cli.check import CHECK
from service.cli.convert import CONVERT
from service.cli.lists import EXAMPLES, FORMATS, OPENAPI
from service.cli.mesh import ESTIMATE, MESH
from service.cli.queries import CURVE, IMAGE, INTERSECT, MEASURE, POINTS, PROJECT, SECTION
from service.cli.refusals import (
    EXIT_CODES,
    REFUSED,
    UNREACHABLE,
    USAGE,
    Refused,
    UsageError,
    issue_line,
    print_error,
)
from service.cli.services import HEALTH, KEY, SERVE, SIGN, STORE
from service.cli.stored import STORED
from service.errors import BadAddress, InvalidSettings, ServiceFailed, SurfaceError

COMMANDS = (
    SERVE,
    HEALTH,
    MESH,
    IMAGE,
    BAKE,
    ESTIMATE,
    POINTS,
    PROJECT,
    INTERSECT,
    SECTION,
    MEASURE,
    CHECK,
    CONVERT,
    CURVE,
    STORE,
    STORED,
    SIGN,
    KEY,
    EXAMPLES,
    FORMATS,
    OPENAPI,
)
"""All commands, in the order of the help."""

INTERRUPTED = 128 + 2
"""Exit code after Ctrl+C: 128 plus the number of the signal, as shells expect."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    try:
        return _run(build_parser().parse_args(arguments))
    except KeyboardInterrupt:
        return INTERRUPTED


def _run(options: argparse.Namespace) -> int:
    """Runs a command; writes its errors to standard error."""
    try:
        return int(options.run(options))
    except (SurfaceError, Refused) as error:
        for line in error.args if isinstance(error, Refused) else map(issue_line, error.issues):
            print_error(line)
        return REFUSED
    except (UsageError, BadAddress, InvalidSettings, ServiceFailed) as error:
        print_error(str(error))
        return UNREACHABLE if isinstance(error, ServiceFailed) else USAGE
    except OSError as error:
        print_error(f"{error.filename or 'output'}: {error.strerror}")
        return REFUSED


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = argparse.ArgumentParser(
        prog="surface",
        description="Parametric surfaces in, meshes out.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"surface {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add_to(commands)
    return parser
