"""`surface key`: makes an API key, and its line for the service's settings."""

import argparse

from service.cli.output import print_lines
from service.cli.refusals import OK, UsageError
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """Adds the command and its argument."""
    key = commands.add_parser(
        "key",
        help="make an API key",
        description="Prints a new key, for the client, and the line for SURFACE_API_KEYS or for "
        "the file SURFACE_API_KEYS_FILE, which contains the key's hash. The key itself is stored "
        "nowhere and cannot be printed again.",
    )
    key.add_argument("name", metavar="NAME", help="name of the client, for logs")
    key.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.api.guard.keys import NAMES, entry_line, is_name, new_key

    if not is_name(arguments.name):
        raise UsageError(f"NAME: needed {NAMES}")
    key = new_key()
    print_lines([f"key   {key}", f"line  {entry_line(arguments.name, key)}"])
    return OK
