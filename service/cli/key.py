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
        "the file SURFACE_API_KEYS_FILE, with the hash of the key. The key itself is not stored: "
        "it cannot be printed again.",
    )
    key.add_argument("name", metavar="NAME", help="name of the client, for logs")
    key.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.api.guard.keys import NAME_FORM, format_entry, is_key_name, make_key

    if not is_key_name(arguments.name):
        raise UsageError(f"NAME: needed {NAME_FORM}")
    key = make_key()
    print_lines([f"key   {key}", f"line  {format_entry(arguments.name, key)}"])
    return OK
