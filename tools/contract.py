"""The list of all names that clients and operators depend on: `tests/contract/names.txt`.

A line of the list is one name, such as `field MeshRequest.tolerance`. `make generated` adds new
names and never removes a name. If the code no longer has a name, `tests/test_contract.py` fails
until a person deletes the line by hand; CHANGELOG.md must mention the removal.
"""

import argparse
import json
from collections.abc import Iterator
from typing import Any, NamedTuple

from prometheus_client import CollectorRegistry

from service.api.app import create_app
from service.decoders.registry import DECODERS
from service.encoders.polylines.registry import CURVE_FORMATS
from service.encoders.registry import FORMATS
from service.settings.environment import variable
from service.settings.values import Settings
from service.surface.examples.catalogue import EXAMPLES
from tools.processes import ROOT

CONTRACT = ROOT / "tests" / "contract" / "names.txt"
IDS = ROOT / "tests" / "golden" / "ids.json"
DOCUMENT = ROOT / "openapi" / "openapi.json"


class Metric(NamedTuple):
    """A metric of the service as Prometheus reads it."""

    name: str
    kind: str
    labels: tuple[str, ...]
    text: str


def add_names(text: str) -> str:
    """The lines of `text` and the names in the code, sorted, without duplicates."""
    return "".join(f"{line}\n" for line in sorted({*text.splitlines(), *list_names()}))


def list_names() -> set[str]:
    """The lines of all names in the code."""
    # Imported here, because the command line reads `service/cli/flags.json` on import, and
    # `tools.pages` must write that file before.
    from service.cli.main import build_parser

    document = json.loads(DOCUMENT.read_text(encoding="utf-8"))
    names = {
        *_list_calls(document),
        *_list_flags(build_parser(), "surface"),
        *(f"setting {variable(name)}" for name in Settings.model_fields),
        *(f"format {each.name} .{each.suffix} {each.media_type}" for each in FORMATS),
        *(f"curve format {each.name}" for each in CURVE_FORMATS),
        *(f"file {each.name}" for each in DECODERS),
        *(f"built-in surface {name}" for name in EXAMPLES),
    }
    for name, schema in document["components"]["schemas"].items():
        names.update(_list_fields(schema, name))
    for metric in list_metrics():
        names.add(f"metric {metric.name}")
        names.update(f"label {metric.name} {label}" for label in metric.labels)
    ids = json.loads(IDS.read_text(encoding="utf-8"))
    return names | {f"stored id {digest} of {title}" for title, digest in ids.items()}


def list_metrics() -> Iterator[Metric]:
    """The metrics whose names begin with `surface_`."""
    registry: CollectorRegistry = create_app(Settings()).state.counters.registry
    for collector in vars(registry)["_collector_to_names"]:
        for family in collector.collect():
            if family.name.startswith("surface_"):
                end = {"counter": "_total", "info": "_info"}.get(family.type, "")
                labels = vars(collector).get("_labelnames") or vars(family).get("_labelnames", ())
                yield Metric(family.name + end, family.type, tuple(labels), family.documentation)


def _list_calls(document: Any) -> Iterator[str]:
    """The lines of the operations of the OpenAPI document: parameters, and headers of responses."""
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            call = f"{method.upper()} {path}"
            yield f"call {call} {operation['operationId']}"
            for parameter in operation.get("parameters", ()):
                yield f"parameter {call} {parameter['in']} {parameter['name']}"
                yield from _list_values(parameter, f"{call} {parameter['name']}")
            for response in operation["responses"].values():
                yield from (f"header {call} {name}" for name in response.get("headers", ()))


def _list_fields(schema: Any, model: str) -> Iterator[str]:
    """The lines of the fields of a model of the OpenAPI document, and of their enumerated values.

    `schema` is the schema of the model in the OpenAPI document.
    """
    for name, field in schema.get("properties", {}).items():
        yield f"field {model}.{name}"
        yield from _list_values(field, f"{model}.{name}")


def _list_values(schema: Any, owner: str) -> Iterator[str]:
    """The lines of the values that `enum` and `const` have at any depth of a schema."""
    if isinstance(schema, dict):
        for value in [*schema.get("enum", ()), *([schema["const"]] if "const" in schema else ())]:
            yield f"value {owner}={value}"
        for key, child in schema.items():
            if key not in ("example", "examples", "default"):
                yield from _list_values(child, owner)
    elif isinstance(schema, list):
        for child in schema:
            yield from _list_values(child, owner)


def _list_flags(parser: argparse.ArgumentParser, command: str) -> Iterator[str]:
    """The lines of a command, of its flags and positional arguments, and of its subcommands."""
    yield f"command {command}"
    for action in vars(parser)["_actions"]:
        if isinstance(action, argparse._SubParsersAction):
            for name, child in action.choices.items():
                yield from _list_flags(child, f"{command} {name}")
        else:
            for flag in action.option_strings or [str(action.dest).upper()]:
                yield f"flag {command} {flag}"
