"""`surface examples`, `formats` and `openapi`: print lists, and the OpenAPI document."""

import argparse

from service.cli.flags import Command, flag
from service.cli.output import print_lines
from service.cli.refusals import OK


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


EXAMPLES = Command("examples", "list the built-in surfaces", _examples)
FORMATS = Command("formats", "list the formats", _formats)
OPENAPI = Command(
    "openapi",
    "print the OpenAPI document",
    _openapi,
    (
        flag(
            "--all",
            "with all optional features; otherwise with those that the settings switch on",
            action="store_true",
        ),
    ),
)
