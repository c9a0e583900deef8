"""`surface store`: stores a surface at a service and prints its URLs."""

import argparse

from service.cli.nets import add_fields, field_line, read_field_flags
from service.cli.output import print_lines
from service.cli.refusals import OK, Refused
from service.cli.source import Commands, add_command, add_source, surface_document, surface_source
from service.errors import SurfaceError


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    store = add_command(commands, "store", "store a surface at a service and print its URLs")
    add_source(store, "no options")
    store.add_argument("--url", required=True, help="URL of the service that stores it")
    add_fields(store)
    store.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    from service.remote import remote_store

    document = surface_document(surface_source(arguments))
    try:
        urls = remote_store(arguments.url, document)
    except SurfaceError as error:
        fields = read_field_flags(arguments)
        raise Refused(*(field_line(issue, fields) for issue in error.issues)) from None
    print_lines(f"{name:<5} {url}" for name, url in urls.items())
    return OK
