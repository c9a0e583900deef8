"""The dashboard of Grafana, `deploy/grafana/dashboards/surface.json`.

`python -m tools.dashboard` writes it anew. A panel is a title, a unit, and what it draws: pairs of
a name and an expression. Rows have three of them.
"""

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

FILE = Path(__file__).parents[1] / "deploy" / "grafana" / "dashboards" / "surface.json"
WIDTH, HEIGHT, ACROSS = 8, 8, 3

Json: TypeAlias = dict[str, Any]


class Panel(NamedTuple):
    """Curves over time, or where `single` is set, the last number of each."""

    title: str
    unit: str
    curves: tuple[tuple[str, str], ...]
    about: str = ""
    single: bool = False


OURS = 'job="surface-service",instance=~"$instance"'
WORK = f'{OURS},route!~"/health/.*|/metrics"'
TOOK = "surface_http_request_duration_seconds"


def _rate(name: str, by: str = "", more: str = OURS) -> str:
    """What a counter grows by in a second."""
    total = f"sum by ({by}) " if by else "sum "
    return f"{total}(rate({name}{{{more}}}[5m]))"


def _quantile(q: float) -> str:
    return f"histogram_quantile({q}, {_rate(TOOK + '_bucket', 'le', WORK)})"


PANELS = (
    Panel("Ready", "none", (("{{instance}}", f"surface_ready{{{OURS}}}"),), "1 is ready.", True),
    Panel(
        "Version",
        "none",
        (
            (
                "{{version}}, engine {{engine}}",
                f"sum by (version, engine) (surface_build_info{{{OURS}}})",
            ),
        ),
        "Instances by version.",
        True,
    ),
    Panel(
        "Since the last start",
        "s",
        (("{{instance}}", f"time() - process_start_time_seconds{{{OURS}}}"),),
        "",
        True,
    ),
    Panel("Requests", "reqps", (("{{route}}", _rate(TOOK + "_count", "route", WORK)),)),
    Panel(
        "Errors of the service",
        "reqps",
        (("{{route}}", _rate(TOOK + "_count", "route", f'{OURS},status="5xx"')),),
        "503 of /health/ready are among them: whoever asks that wants to know.",
    ),
    Panel("Refused, by code", "reqps", (("{{code}}", _rate("surface_refused_total", "code")),)),
    Panel(
        "Time of an answer",
        "s",
        (("median", _quantile(0.5)), ("95 %", _quantile(0.95)), ("99 %", _quantile(0.99))),
        "Until it was handed to the server; hits of the cache are among them.",
    ),
    Panel(
        "Under way",
        "none",
        (
            ("requests", f"sum (surface_http_requests_in_flight{{{OURS}}})"),
            ("waiting, {{lane}}", f"sum by (lane) (surface_queue_length{{{OURS}}})"),
            ("computing, {{lane}}", f"sum by (lane) (surface_threads_busy{{{OURS}}})"),
            ("threads, {{lane}}", f"sum by (lane) (surface_threads{{{OURS}}})"),
        ),
    ),
    Panel(
        "Waited for a thread or for memory",
        "s",
        (("{{lane}}", _rate("surface_queue_wait_seconds_total", "lane")),),
        "Seconds in each second: how many waited on average.",
    ),
    Panel(
        "Memory that is lent",
        "bytes",
        (
            ("{{pool}}", f"sum by (pool) (surface_memory_bytes{{{OURS}}})"),
            ("{{pool}}, at most", f"sum by (pool) (surface_memory_limit_bytes{{{OURS}}})"),
        ),
        "By prediction: what may be needed, not what is in use.",
    ),
    Panel(
        "Memory of the process",
        "bytes",
        (
            ("{{instance}}", f"process_resident_memory_bytes{{{OURS}}}"),
            ("cache, {{instance}}", f"surface_cache_bytes{{{OURS}}}"),
        ),
    ),
    Panel(
        "Processor",
        "percentunit",
        (("{{instance}}", _rate("process_cpu_seconds_total", "instance")),),
        "1 is one processor.",
    ),
    Panel(
        "From memory",
        "percentunit",
        (
            (
                "hits",
                f"{_rate('surface_cache_hits_total')} / ({_rate('surface_cache_hits_total')} "
                f"+ {_rate('surface_cache_misses_total')})",
            ),
        ),
        "Of the meshes by URL.",
    ),
    Panel(
        "Kept answers",
        "none",
        (
            ("{{instance}}", f"surface_cache_entries{{{OURS}}}"),
            ("forgotten a second", _rate("surface_cache_evictions_total")),
        ),
    ),
    Panel(
        "Bytes sent", "Bps", (("{{format}}", _rate("surface_http_response_bytes_total", "format")),)
    ),
    Panel(
        "Meshes",
        "none",
        (
            ("vertices a second", _rate("surface_vertices_total")),
            ("triangles a second", _rate("surface_triangles_total")),
        ),
    ),
    Panel(
        "Computing, by formulation",
        "s",
        (("{{formulation}}", _rate("surface_engine_seconds_total", "formulation")),),
        "Seconds in each second.",
    ),
    Panel(
        "Connections",
        "none",
        (
            ("{{instance}}", f"surface_connections{{{OURS}}}"),
            ("at most", f"max (surface_connections_limit{{{OURS}}})"),
        ),
    ),
    Panel(
        "Store: operations",
        "ops",
        (
            (
                "{{operation}}, {{outcome}}",
                _rate("surface_store_operation_seconds_count", "operation, outcome"),
            ),
        ),
    ),
    Panel(
        "Store: time of an operation",
        "s",
        (
            (
                "{{operation}}",
                f"{_rate('surface_store_operation_seconds_sum', 'operation')} "
                f"/ {_rate('surface_store_operation_seconds_count', 'operation')}",
            ),
        ),
    ),
    Panel(
        "Store: bytes",
        "bytes",
        (
            ("used", f"max (surface_store_bytes{{{OURS}}})"),
            ("quota", f"max (surface_store_quota_bytes{{{OURS}}} > 0)"),
            ("answering", f"min (surface_store_answering{{{OURS}}})"),
            ("lost lines of the log", f"sum (surface_log_lines_dropped_total{{{OURS}}})"),
        ),
        "As last counted; none without a quota.",
    ),
)


def dashboard() -> Json:
    """The whole of it."""
    return {
        "uid": "surface-service",
        "title": "Surface Service",
        "tags": ["surface-service"],
        "timezone": "browser",
        "schemaVersion": 39,
        "version": 1,
        "refresh": "30s",
        "time": {"from": "now-3h", "to": "now"},
        "editable": False,
        "templating": {"list": [_instances()]},
        "annotations": {"list": []},
        "panels": [_panel(number, panel) for number, panel in enumerate(PANELS)],
    }


_SOURCE = {"type": "prometheus", "uid": "prometheus"}


def _instances() -> Json:
    query = 'label_values(up{job="surface-service"}, instance)'
    return {
        "name": "instance",
        "label": "Instance",
        "type": "query",
        "datasource": _SOURCE,
        "query": {"query": query, "refId": "instances"},
        "definition": query,
        "refresh": 2,
        "includeAll": True,
        "allValue": ".*",
        "multi": True,
        "sort": 1,
        "current": {"text": "All", "value": "$__all"},
    }


def _panel(number: int, panel: Panel) -> Json:
    down, across = divmod(number, ACROSS)
    return {
        "id": number + 1,
        "type": "stat" if panel.single else "timeseries",
        "title": panel.title,
        "description": panel.about,
        "datasource": _SOURCE,
        "gridPos": {"x": across * WIDTH, "y": down * HEIGHT, "w": WIDTH, "h": HEIGHT},
        "fieldConfig": {"defaults": {"unit": panel.unit, "min": 0}, "overrides": []},
        "targets": [
            {"refId": chr(ord("A") + k), "datasource": _SOURCE, "expr": expr, "legendFormat": name}
            for k, (name, expr) in enumerate(panel.curves)
        ],
    }


def text() -> str:
    """The file."""
    return json.dumps(dashboard(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
    sys.exit()
