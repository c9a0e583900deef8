"""`surface examples`, `formats` and `openapi`: print lists, and the OpenAPI document."""

import argparse

from service.cli.output import print_lines
from service.cli.refusals import OK
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """Adds the commands and their flags."""
    examples = commands.add_parser("examples", help="list the built-in surfaces")
    examples.set_defaults(run=_examples)
    formats = commands.add_parser("formats", help="list the formats")
    formats.set_defaults(run=_formats)
    openapi = commands.add_parser("openapi", help="print the OpenAPI document")
    openapi.add_argument(
        "--all",
        action="store_true",
        help="with all optional features; otherwise with those that the settings switch on",
    )
    openapi.set_defaults(run=_openapi)


def _examples(_: argparse.Namespace) -> int:
    from service.surface.examples.catalogue import EXAMPLES

    width = max(map(len, EXAMPLES))
    print_lines(f"{example.id:<{width}}  {example.title}" for example in EXAMPLES.values())
    return OK


def _formats(_: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    print_lines(
        f"{fmt.name:<5} .{fmt.suffix:<5} {fmt.media_type:<20} {fmt.title}" for fmt in FORMATS
    )
    return OK


def _openapi(arguments: argparse.Namespace) -> int:
    import json

    from service.api.app import create_app
    from service.api.openapi.document import build_full_settings

    app = create_app(build_full_settings() if arguments.all else None)
    print_lines([json.dumps(app.openapi(), indent=2, ensure_ascii=False)])
    return OK
