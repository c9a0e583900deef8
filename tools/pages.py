"""Writes the generated files (`make generated`).

They are the reference (docs/reference.md), the tables of docs/settings.md, of docs/observability.md
and of formats and calls in the README, the links in docs/browser.md, the alerts in the form of the
Prometheus Operator, the flags of `surface mesh`, and the list of all names that clients use. The
text around a table is written by hand; this program does not change it.
"""

import json
import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from service.api.app import create_app
from service.api.body import BodyRoute
from service.api.stored import stored_links
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.mesh_plan import build_plan
from service.schemas.accuracy import ACCURACY_FIELDS
from service.schemas.brep_parts import (
    EdgeDefinition,
    FaceDefinition,
    LoopDefinition,
    ShellDefinition,
)
from service.schemas.groups import MemberDefinition
from service.schemas.kinds import KINDS
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import SurfaceDefinition
from service.settings.environment import describe_values, variable
from service.settings.limits import result_limits
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from service.surface.sizes import SurfaceKind
from tools.contract import CONTRACT, add_names, list_metrics
from tools.processes import ROOT

ALERTS = ROOT / "deploy" / "prometheus" / "alerts.yaml"

CHANNELS = {"colors": "colours", "uvs": "uvs", "attribute": "attributes"}
"""Names of a format's channels in documents."""


def write_settings_page(text: str) -> str:
    """The text of docs/settings.md, with the tables of all settings and of the largest meshes."""
    rows = [
        (
            f"`{variable(name)}`",
            _describe_default(name, field),
            describe_values(field),
            field.description or "",
        )
        for name, field in Settings.model_fields.items()
    ]
    text = _replace_table(text, ("variable", "default", "values", "what it is"), rows)
    surfaces = [find(name).surface() for name in ("saddle", "utah-teapot")]
    sizes = [
        (fmt.name, *(f"{_count_largest(s, fmt) / 1e6:.2f} million vertices" for s in surfaces))
        for fmt in FORMATS
    ]
    return _replace_table(text, ("format", "one patch", "the teapot"), sizes)


def write_metrics_page(text: str) -> str:
    """The text of docs/observability.md, with the table of metrics."""
    rows = [
        (
            f"`{metric.name}`",
            metric.kind,
            ", ".join(f"`{label}`" for label in metric.labels),
            metric.text,
        )
        for metric in list_metrics()
    ]
    return _replace_table(text, ("metric", "kind", "labels", "what it is"), rows)


def write_alert_rules(_: str) -> str:
    """The manifest of the Prometheus Operator with the alerts."""
    manifest = {
        "apiVersion": "monitoring.coreos.com/v1",
        "kind": "PrometheusRule",
        "metadata": {
            "name": "surface-service",
            "labels": {"app.kubernetes.io/name": "surface-service"},
        },
        "spec": yaml.safe_load(ALERTS.read_text(encoding="utf-8")),
    }
    text: str = yaml.safe_dump(manifest, sort_keys=False, allow_unicode=True, width=100)
    return f"# Made of deploy/prometheus/alerts.yaml by `python -m tools.pages`.\n{text}"


def write_readme(text: str) -> str:
    """The text of the README, with the tables of all formats and of all questions to a surface."""
    rows = [
        (fmt.title, f"`.{fmt.suffix}`", f"`{fmt.media_type}`", ", ".join(_list_contents(fmt)))
        for fmt in FORMATS
    ]
    text = _replace_table(text, ("format", "suffix", "media type", "content"), rows)
    calls = [
        (f"`POST {route.path}`", route.summary or "")
        for route in create_app(Settings()).routes
        if isinstance(route, BodyRoute)
        and route.path not in ("/v1/mesh", "/v1/surfaces", "/v1/jobs")
    ]
    return _replace_table(text, ("request", "response"), calls)


def write_browser_page(text: str) -> str:
    """The text of docs/browser.md, with links to a mesh in every format."""
    link = r' +"\w+": "/v1/surfaces/(\w+)/mesh\.\w+\?engine=\d+",?\n'

    def write_links(match: re.Match[str]) -> str:
        links = stored_links("", match[1])["mesh"].items()
        return ",\n".join(f'      "{suffix}": "{url}"' for suffix, url in links) + "\n"

    return re.sub(f"(?:{link})+", write_links, text)


def write_reference_page(_: str) -> str:
    """The text of docs/reference.md: all options of a mesh, and the fields of all surfaces."""
    lines = ["# Reference", "", "Written by `make generated` from the models of the interface."]
    lines += ["", "## Options of a mesh", "", *_list_fields(MeshOptionFields.model_json_schema())]
    # `SurfaceDefinition` is a union of members `Annotated[model, Tag(kind)]`.
    models = {
        get_args(member)[1].tag: get_args(member)[0]
        for member in get_args(get_args(SurfaceDefinition.__value__)[0])
    }
    for kind in KINDS:
        lines += _describe_model(f"## `{kind}`", models[kind])
        for field, model in _PARTS.get(kind, {}).items():
            lines += _describe_model(f"### One of the `{field}`", model)
    return "\n".join([*lines, ""])


_PARTS: dict[str, dict[str, type[BaseModel]]] = {
    "brep": {
        "edges": EdgeDefinition,
        "faces": FaceDefinition,
        "loops": LoopDefinition,
        "shells": ShellDefinition,
    },
    "group": {"members": MemberDefinition},
}
"""For kinds whose fields are lists of objects, the models of these."""


def _describe_model(title: str, model: type[BaseModel]) -> list[str]:
    """Lines with a title, the docstring of a model, and the table of its fields."""
    summary = (model.__doc__ or "").strip()
    paragraphs = ["\n".join(map(str.strip, part.splitlines())) for part in summary.split("\n\n")]
    return ["", title, "", "\n\n".join(paragraphs), "", *_list_fields(model.model_json_schema())]


def write_flags(_: str) -> str:
    """The text of service/cli/flags.json, with one option of `surface mesh` in each line.

    The command reads this file, because importing the models would take too long.
    """
    options = MeshOptionFields.model_json_schema()["properties"]
    rows = [
        json.dumps(
            {
                "name": name,
                "value": _describe_value(field),
                "text": _first_sentence(field["description"]).replace("`", ""),
                "is_accuracy": name in ACCURACY_FIELDS,
            }
        )
        for name, field in options.items()
    ]
    return "[\n" + ",\n".join(rows) + "\n]\n"


PAGES: dict[Path, Callable[[str], str]] = {
    ROOT / "README.md": write_readme,
    ROOT / "docs" / "browser.md": write_browser_page,
    ROOT / "docs" / "reference.md": write_reference_page,
    ROOT / "docs" / "settings.md": write_settings_page,
    ROOT / "docs" / "observability.md": write_metrics_page,
    ROOT / "deploy" / "kubernetes" / "monitoring" / "rules.yaml": write_alert_rules,
    ROOT / "service" / "cli" / "flags.json": write_flags,
    CONTRACT: add_names,
}
"""Files, and functions that return the new text of a file from its old text."""


def _replace_table(text: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """The text of a page, in which the table with this head has new rows."""
    start = "".join(f"| {' | '.join(cells)} |\n" for cells in (head, ("---",) * len(head)))
    text_before, _, text_after = text.partition(start)
    lines = text_after.splitlines(keepends=True)
    end = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    return text_before + start + table + "".join(lines[end:])


def _list_contents(fmt: Format) -> Iterable[str]:
    """The contents of a mesh that the format can store, in words."""
    yield "triangles"
    yield from ["quads"] * fmt.has_quads + ["lines"] * fmt.has_overlays
    yield from (word for kind, word in CHANNELS.items() if kind in fmt.carries)


def _list_fields(schema: Mapping[str, Any]) -> list[str]:
    """The lines of the table of the fields of a model."""
    required = schema.get("required", ())
    rows = [
        f"| `{name}` | {'required' if name in required else _default_text(field)} | "
        f"{' '.join(field.get('description', '').split()).replace('|', '&#124;')} |"
        for name, field in schema["properties"].items()
    ]
    return ["| field | default | what it is |", "| --- | --- | --- |", *rows]


def _default_text(field: Mapping[str, Any]) -> str:
    """The default of a field as JSON in backticks; empty if the default is empty or missing."""
    value = field.get("default")
    return "" if value in (None, [], {}) else f"`{json.dumps(value)}`"


def _first_sentence(description: str) -> str:
    """The first sentence of a description, without its full stop."""
    return description.split(". ", maxsplit=1)[0].rstrip(".")


def _describe_value(field: Mapping[str, Any]) -> str | None:
    """The placeholder of the value after a flag, for example `N`; None if the flag has no value."""
    kind = field.get("type")
    if kind == "boolean":
        return None
    if "oneOf" in field:  # one number, or one for u and one for v
        return "N|U,V"
    return (
        "A,B" if kind == "array" else {"integer": "N", "number": "NUMBER"}.get(kind or "", "NAME")
    )


def _count_largest(surface: SurfaceKind, fmt: Format) -> int:
    """The vertices of the largest mesh of a surface that the service makes.

    The limits are those of a machine with 8 GB, of which the service uses half by default.
    """
    limits = result_limits(Settings(memory_bytes=4_000_000_000))

    def count_vertices(resolution: int) -> int:
        try:
            options = MeshOptions(resolution=(resolution, resolution))
            return build_plan(surface, options, fmt, limits=limits).size.vertices
        except TooLarge:
            return 0

    # Each resolution above the largest is refused, so `bisect_left` finds the index of the first
    # refused resolution. Resolution k has the index k − 1, so this index is the largest resolution.
    resolutions = range(1, 5000)
    largest = bisect_left(resolutions, True, key=lambda number: not count_vertices(number))
    return count_vertices(largest)


def _describe_default(name: str, field: FieldInfo) -> str:
    """The default of a setting: in backticks, or in words that its description explains."""
    if name == "memory_bytes":  # half of the memory of the machine
        return "half"
    if name == "store":  # without the variable, `read_environment` sets a folder
        return "a folder"
    value = ",".join(field.default) if isinstance(field.default, tuple) else field.default
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"`{text}`" if text else ""


if __name__ == "__main__":
    for file, write_text in PAGES.items():
        old_text = file.read_text(encoding="utf-8") if file.exists() else ""
        file.write_text(write_text(old_text), encoding="utf-8")
