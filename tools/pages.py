"""Files that say what the code says: `python -m tools.pages` writes them anew.

These are the tables of docs/settings.md and docs/observability.md, and the alerts as the Prometheus
Operator wants them. What stands around a table is written by hand, and kept.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable
from pathlib import Path

import yaml
from pydantic.fields import FieldInfo

from service.api.app import create_app
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.mesh import plan_mesh
from service.settings.environment import values, variable
from service.settings.values import Settings, result_limits
from service.surface.examples import find
from service.surface.sizes import SurfaceKind
from tools.processes import ROOT

ALERTS = ROOT / "deploy" / "prometheus" / "alerts.yaml"


def settings_page(text: str) -> str:
    """The page of the settings, with the tables of all settings and of the largest meshes."""
    rows = [
        (f"`{variable(name)}`", _default(field), values(field), field.description or "")
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
    """The page of what is seen of the service, with the table of its metrics."""
    registry = create_app(Settings()).state.observed.registry
    rows = []
    for collector in vars(registry)["_collector_to_names"]:
        for family in collector.collect():
            if family.name.startswith("surface_"):
                end = {"counter": "_total", "info": "_info"}.get(family.type, "")
                names = vars(collector).get("_labelnames") or vars(family).get("_labelnames", ())
                labels = ", ".join(f"`{label}`" for label in names)
                rows.append((f"`{family.name}{end}`", family.type, labels, family.documentation))
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
    made: str = yaml.safe_dump(manifest, sort_keys=False, allow_unicode=True, width=100)
    return f"# Made of deploy/prometheus/alerts.yaml by `python -m tools.pages`.\n{made}"


PAGES: dict[Path, Callable[[str], str]] = {
    ROOT / "docs" / "settings.md": settings_page,
    ROOT / "docs" / "observability.md": metrics_page,
    ROOT / "deploy" / "kubernetes" / "monitoring" / "rules.yaml": rules_page,
}
"""Files, and functions that return what must stand in them from what stands in them."""


def _with_table(text: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """The page with the rows of the table of this head anew."""
    start = "".join(f"| {' | '.join(cells)} |\n" for cells in (head, ("---",) * len(head)))
    before, _, rest = text.partition(start)
    lines = rest.splitlines(keepends=True)
    end = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    return before + start + table + "".join(lines[end:])


def _largest(surface: SurfaceKind, fmt: Format) -> int:
    """Vertices of the largest mesh of a surface that is answered on a machine of 8 GB."""
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
        file.write_text(page(file.read_text(encoding="utf-8")), encoding="utf-8")
