"""Writes the generated files (`make generated`).

They are the reference (docs/reference.md), the tables of docs/settings.md, of
docs/observability.md and of formats and calls in the README, the links in docs/browser.md, the
alerts as the Prometheus Operator wants them, the flags of `surface mesh`, and the list of all names
that clients use. The text around a table is written by hand, and kept.
"""

import json
import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic.fields import FieldInfo

from service.api.app import create_app
from service.api.body import BodyRoute
from service.api.links import mesh_links
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.mesh import plan_mesh
from service.schemas.accuracy import ACCURACY
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import KINDS, SurfaceDefinition
from service.settings.environment import describe_values, variable
from service.settings.values import Settings, result_limits
from service.surface.examples import find
from service.surface.sizes import SurfaceKind
from tools.contract import CONTRACT, add_names, list_metrics
from tools.processes import ROOT

ALERTS = ROOT / "deploy" / "prometheus" / "alerts.yaml"

CHANNELS = {"colors": "colours", "uvs": "uvs", "attribute": "attributes"}
"""Names of a format's channels in documents."""


def settings_page(text: str) -> str:
    """The page of the settings, with the tables of all settings and of the largest meshes."""
    rows = [
        (f"`{variable(name)}`", _default(field), describe_values(field), field.description or "")
        for name, field in Settings.model_fields.items()
    ]
    text = _with_table(text, ("variable", "default", "values", "what it is"), rows)
    surfaces = [find(name).surface() for name in ("saddle", "utah-teapot")]
    sizes = [
        (fmt.name, *(f"{_largest(s, fmt) / 1e6:.2f} million vertices" for s in surfaces))
        for fmt in FORMATS
    ]
    return _with_table(text, ("format", "one patch", "the teapot"), sizes)


def metrics_page(text: str) -> str:
    """The page on observability, with the table of metrics."""
    rows = [
        (
            f"`{metric.name}`",
            metric.kind,
            ", ".join(f"`{label}`" for label in metric.labels),
            metric.text,
        )
        for metric in list_metrics()
    ]
    return _with_table(text, ("metric", "kind", "labels", "what it is"), rows)


def rules_page(_: str) -> str:
    """The alerts as a manifest of the Prometheus Operator."""
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


def readme(text: str) -> str:
    """The README, with the tables of all formats and of all queries."""
    rows = [(f.title, f"`.{f.suffix}`", f"`{f.media_type}`", ", ".join(_holds(f))) for f in FORMATS]
    text = _with_table(text, ("format", "suffix", "media type", "holds"), rows)
    calls = [
        (f"`POST {route.path}`", route.summary or "")
        for route in create_app(Settings()).routes
        if isinstance(route, BodyRoute) and route.path not in ("/v1/mesh", "/v1/surfaces")
    ]
    return _with_table(text, ("request", "response"), calls)


def browser_page(text: str) -> str:
    """The page on browsers, with a link to the stored surface's mesh in every format."""
    link = r' +"\w+": "/v1/surfaces/(\w+)/mesh\.\w+\?engine=\d+",?\n'

    def write_links(found: re.Match[str]) -> str:
        links = mesh_links("", found[1]).items()
        return ",\n".join(f'      "{suffix}": "{url}"' for suffix, url in links) + "\n"

    return re.sub(f"(?:{link})+", write_links, text)


def reference_page(_: str) -> str:
    """Every kind of surface with its fields, and every option of a mesh, as OpenAPI has them."""
    lines = ["# Reference", "", "Written by `make generated` from the models of the interface."]
    lines += ["", "## Options of a mesh", "", *_fields(MeshOptionFields.model_json_schema())]
    models = {
        get_args(member)[1].tag: get_args(member)[0]
        for member in get_args(get_args(SurfaceDefinition.__value__)[0])
    }
    for kind in KINDS:
        summary = (models[kind].__doc__ or "").strip()
        paragraphs = [
            "\n".join(map(str.strip, part.splitlines())) for part in summary.split("\n\n")
        ]
        lines += ["", f"## `{kind}`", "", "\n\n".join(paragraphs), ""]
        lines += _fields(models[kind].model_json_schema())
    return "\n".join([*lines, ""])


def flags(_: str) -> str:
    """The flags of `surface mesh`, which has no time to import the models: one option a line."""
    options = MeshOptionFields.model_json_schema()["properties"]
    rows = [
        json.dumps(
            {
                "name": name,
                "value": _value(field),
                "text": _summary(field["description"]).replace("`", ""),
                "is_accuracy": name in ACCURACY,
            }
        )
        for name, field in options.items()
    ]
    return "[\n" + ",\n".join(rows) + "\n]\n"


PAGES: dict[Path, Callable[[str], str]] = {
    ROOT / "README.md": readme,
    ROOT / "docs" / "browser.md": browser_page,
    ROOT / "docs" / "reference.md": reference_page,
    ROOT / "docs" / "settings.md": settings_page,
    ROOT / "docs" / "observability.md": metrics_page,
    ROOT / "deploy" / "kubernetes" / "monitoring" / "rules.yaml": rules_page,
    ROOT / "service" / "cli" / "flags.json": flags,
    CONTRACT: add_names,
}
"""Files, and functions that return the new text of a file from its present text."""


def _with_table(text: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """The page, with new rows for the table that has this head."""
    start = "".join(f"| {' | '.join(cells)} |\n" for cells in (head, ("---",) * len(head)))
    before, _, rest = text.partition(start)
    lines = rest.splitlines(keepends=True)
    end = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    return before + start + table + "".join(lines[end:])


def _holds(fmt: Format) -> Iterable[str]:
    """The abilities of a format, in words."""
    yield "triangles"
    yield from ["quads"] * fmt.quads + ["lines"] * fmt.overlays
    yield from (word for kind, word in CHANNELS.items() if kind in fmt.carries)


def _fields(schema: Mapping[str, Any]) -> list[str]:
    """The table of the fields of a model."""
    required = schema.get("required", ())
    rows = [
        f"| `{name}` | {'required' if name in required else _default_text(field)} | "
        f"{' '.join(field.get('description', '').split()).replace('|', '&#124;')} |"
        for name, field in schema["properties"].items()
    ]
    return ["| field | default | what it is |", "| --- | --- | --- |", *rows]


def _default_text(field: Mapping[str, Any]) -> str:
    """The default of a field as JSON; empty for an empty or missing default."""
    value = field.get("default")
    return "" if value in (None, [], {}) else f"`{json.dumps(value)}`"


def _summary(description: str) -> str:
    """The first sentence of a description, without its full stop."""
    return description.split(". ", maxsplit=1)[0].rstrip(".")


def _value(field: Mapping[str, Any]) -> str | None:
    """The value that follows an option's flag, in words; None for a switch."""
    kind = field.get("type")
    if kind == "boolean":
        return None
    if "oneOf" in field:
        return "N|U,V"
    return (
        "A,B" if kind == "array" else {"integer": "N", "number": "NUMBER"}.get(kind or "", "NAME")
    )


def _largest(surface: SurfaceKind, fmt: Format) -> int:
    """Vertices of the largest mesh of a surface that a service makes on a machine of 8 GB."""
    limits = result_limits(Settings(memory_bytes=4_000_000_000))

    def size(resolution: int) -> int:
        try:
            options = MeshOptions(resolution=(resolution, resolution))
            return plan_mesh(surface, options, fmt, limits=limits).size.vertices
        except TooLarge:
            return 0

    return size(bisect_left(range(1, 5000), True, key=lambda r: not size(r)))


def _default(field: FieldInfo) -> str:
    if field.default_factory is not None:
        return "half"
    value = ",".join(field.default) if isinstance(field.default, tuple) else field.default
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"`{text}`" if text else ""


if __name__ == "__main__":
    for file, page in PAGES.items():
        present = file.read_text(encoding="utf-8") if file.exists() else ""
        file.write_text(page(present), encoding="utf-8")
