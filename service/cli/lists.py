"""`surface examples`, `formats` and `openapi`: lists for people and for programs."""

import argparse

from service.cli.output import print_lines
from service.cli.refusals import OK
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """The commands; they have no flags."""
    for name, run, text in (
        ("examples", _examples, "list the built-in surfaces"),
        ("formats", _formats, "list the formats"),
        ("openapi", _openapi, "print the OpenAPI document"),
    ):
        command = commands.add_parser(name, help=text)
        command.set_defaults(run=run)


def _examples(_: argparse.Namespace) -> int:
    from service.surface.examples import EXAMPLES

    width = max(map(len, EXAMPLES))
    print_lines(f"{example.id:<{width}}  {example.title}" for example in EXAMPLES.values())
    return OK


def _formats(_: argparse.Namespace) -> int:
    from service.encoders.registry import FORMATS

    print_lines(
        f"{fmt.name:<5} .{fmt.suffix:<5} {fmt.media_type:<20} {fmt.title}" for fmt in FORMATS
    )
    return OK


def _openapi(_: argparse.Namespace) -> int:
    import json

    from service.api.openapi.document import document

    print_lines([json.dumps(document(), indent=2, ensure_ascii=False)])
    return OK
