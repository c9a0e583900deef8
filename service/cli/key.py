"""`surface key`: a new API key, and what the service is told of it."""

import argparse

from service.cli.output import print_lines
from service.cli.refusals import OK, UsageError
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """The command and its argument."""
    key = commands.add_parser(
        "key",
        help="make an API key",
        description="Prints a new key, for who uses the service, and the line for SURFACE_API_KEYS "
        "or the file SURFACE_API_KEYS_FILE, which tells the service its hash. The key is kept "
        "nowhere: it cannot be printed again.",
    )
    key.add_argument("name", metavar="NAME", help="whose key it is; logs have this name")
    key.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.api.guard.keys import NAMES, entry_line, is_name, new_key

    if not is_name(arguments.name):
        raise UsageError(f"NAME: needed {NAMES}")
    key = new_key()
    print_lines([f"key   {key}", f"line  {entry_line(arguments.name, key)}"])
    return OK
