"""The alerts and the dashboard are valid and documented, and use only metrics that exist."""

import json
import re
import shutil
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families as families

from service.api.app import create_app
from service.settings.values import Settings
from tests.deploy.files import DEPLOY, ROOT, load_yaml, run_command
from tools.client import start_client
from tools.programs import find_program

ALERTS = DEPLOY / "prometheus" / "alerts.yaml"
CONFIG = DEPLOY / "prometheus" / "prometheus.yml"
PAGE = ROOT / "docs" / "alerts.md"
RULES: list[dict[str, Any]] = load_yaml(ALERTS)["groups"][0]["rules"]
DASHBOARD = DEPLOY / "grafana" / "dashboards" / "surface.json"
PANELS: list[dict[str, Any]] = json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]
EXPRESSIONS = [target["expr"] for panel in PANELS for target in panel["targets"]]
METRIC_NAME = re.compile(r"\b(?:surface|process|python)_\w+")
"""The name of a metric in an expression of PromQL."""

SERVICE = 'job="surface-service",instance="a"'
"""Labels of all samples of an instance."""

DURATION = "surface_http_request_duration_seconds"
OPERATIONS = "surface_store_operation_seconds_count"
MEMORY_LIMIT = f'surface_memory_limit_bytes{{{SERVICE},pool="work"}}'
SERIES_OF_ALERTS: dict[str, dict[str, str]] = {
    # An instance of another job is no instance of the service.
    "SurfaceAbsent": {f"up{{{SERVICE}}}": "0x200", 'up{job="other"}': "1x200"},
    "SurfaceRestarts": {f"process_start_time_seconds{{{SERVICE}}}": "0x30 1 2 3 4 4x170"},
    "SurfaceNotReady": {f"surface_ready{{{SERVICE}}}": "0x200"},
    "SurfaceErrors": {
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+2x200",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+98x200",
    },
    "SurfaceSlow": {
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="2.5"}}': "0+90x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="10.0"}}': "0+90x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="30.0"}}': "0+100x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
    },
    "SurfaceErrorBudget": {
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+8x200",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+992x200",
    },
    "SurfaceErrorBudgetSlowly": {
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+2x200",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+998x200",
    },
    "SurfaceLatencyBudget": {
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="2.5"}}': "0+92x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
    },
    "SurfaceLatencyBudgetSlowly": {
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="2.5"}}': "0+98x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
    },
    "SurfaceBusy": {f'surface_refused_total{{{SERVICE},code="busy"}}': "0+12x200"},
    "SurfaceMemoryLent": {
        f'surface_memory_bytes{{{SERVICE},pool="work"}}': "95x200",
        MEMORY_LIMIT: "100x200",
    },
    "SurfaceMemoryAbovePrediction": {
        f"process_resident_memory_bytes{{{SERVICE}}}": "610e6x200",
        MEMORY_LIMIT: "390e6x200",
        f"surface_plan_bytes{{{SERVICE}}}": "10e6x200",
    },
    "SurfaceStoreFailing": {f"surface_store_answering{{{SERVICE}}}": "0x200"},
    "SurfaceStoreNotWritable": {
        f'surface_store_writes{{{SERVICE},state="read_only"}}': "1x200",
        f'surface_store_writes{{{SERVICE},state="ready"}}': "0x200",
        f"surface_store_answering{{{SERVICE}}}": "1x200",
    },
    "SurfaceStoreFull": {
        f'{OPERATIONS}{{{SERVICE},operation="put",outcome="refused"}}': "0+1x200",
    },
    "SurfaceStoreNearlyFull": {
        f"surface_store_bytes{{{SERVICE}}}": "86x200",
        f"surface_store_quota_bytes{{{SERVICE}}}": "100x200",
    },
    "SurfaceConnections": {
        f"surface_connections{{{SERVICE}}}": "91x200",
        f"surface_connections_limit{{{SERVICE}}}": "100x200",
    },
    "SurfaceLogLost": {f"surface_log_lines_dropped_total{{{SERVICE}}}": "0+1x200"},
    "SurfaceKeysFile": {f"surface_keys_file_valid{{{SERVICE}}}": "0x200"},
    "SurfaceCacheMisses": {
        f"surface_cache_hits_total{{{SERVICE}}}": "0+10x200",
        f"surface_cache_misses_total{{{SERVICE}}}": "0+90x200",
    },
}
"""For each alert, time series that make it fire: series and values, one value for each minute.

The values are in the notation of `promtool test rules`: `0+2x200` is 0, and then 200 times 2 more;
`1x200` is 1, and then 200 times 1 again.
"""

SERIES_WITHOUT_ALERT: dict[str, dict[str, str]] = {
    "normal load": {
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+5x200",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+9995x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="2.5"}}': "0+99.5x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="10.0"}}': "0+100x200",
        f'{DURATION}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
        f'surface_refused_total{{{SERVICE},code="busy"}}': "0+1x200",
        f'surface_refused_total{{{SERVICE},code="invalid_request"}}': "0+900x200",
        f'surface_memory_bytes{{{SERVICE},pool="work"}}': "200e6x200",
        MEMORY_LIMIT: "400e6x200",
        f"process_resident_memory_bytes{{{SERVICE}}}": "690e6x200",
        f"surface_plan_bytes{{{SERVICE}}}": "100e6x200",
        f"process_start_time_seconds{{{SERVICE}}}": "0x50 1x150",
        f"surface_ready{{{SERVICE}}}": "1x200",
        f"surface_store_answering{{{SERVICE}}}": "1x200",
        # One failed test of writing is not enough.
        f'surface_store_writes{{{SERVICE},state="ready"}}': "1x40 0x2 1x200",
        f'surface_store_writes{{{SERVICE},state="full"}}': "0x40 1x2 0x200",
        f'{OPERATIONS}{{{SERVICE},operation="put",outcome="refused"}}': "3x200",
        f'{OPERATIONS}{{{SERVICE},operation="put",outcome="done"}}': "0+9x200",
        f"surface_store_bytes{{{SERVICE}}}": "80x200",
        f"surface_store_quota_bytes{{{SERVICE}}}": "100x200",
        f"surface_connections{{{SERVICE}}}": "10x200",
        f"surface_connections_limit{{{SERVICE}}}": "100x200",
        f"surface_log_lines_dropped_total{{{SERVICE}}}": "5x200",
        f"surface_keys_file_valid{{{SERVICE}}}": "1x200",
        f"surface_cache_hits_total{{{SERVICE}}}": "0+90x200",
        f"surface_cache_misses_total{{{SERVICE}}}": "0+90x200",
    },
    # Without a quota the store is never nearly full; without requests, no ratio has a value.
    "idle": {
        f"surface_store_bytes{{{SERVICE}}}": "86x200",
        f"surface_store_quota_bytes{{{SERVICE}}}": "0x200",
    },
    # Two workers of one instance: sums are compared with sums, so that no label is missing.
    "two workers": {
        f'{name}{{{SERVICE},worker="{worker}"{labels}}}': values
        for worker in (0, 1)
        for name, labels, values in (
            ("process_resident_memory_bytes", "", "690e6x200"),
            ("surface_memory_limit_bytes", ',pool="work"', "400e6x200"),
            ("surface_plan_bytes", "", "100e6x200"),
            ("surface_ready", "", "1x200"),
            ("surface_store_answering", "", "1x200"),
            ("surface_store_bytes", "", "80x200"),
            ("surface_store_quota_bytes", "", "100x200"),
            ("surface_log_lines_dropped_total", "", "5x200"),
        )
    },
    # A minute with 10 % of errors, two minutes ago, uses up little of the budget.
    "short fault": {
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0x38 100 100x161",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+1000x200",
    },
    # During a rolling update, instances restart and refuse readiness probes for a short time.
    "rolling update": {
        f"surface_ready{{{SERVICE}}}": "1x50 0 0 1x150",
        f'{DURATION}_count{{{SERVICE},route="/health/ready",status="5xx"}}': "0+60x200",
        f'{DURATION}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+100x200",
    },
}
"""Time series for which no alert may fire."""


@pytest.fixture(scope="module")
def promtool() -> str:
    return find_program("promtool")


@pytest.fixture(scope="module")
def sample_names() -> set[str]:
    """Names of all samples at /metrics, also of metrics that have no samples yet."""
    with start_client(create_app(Settings())) as client:
        client.get("/v1/surfaces/saddle/mesh.glb?resolution=2")
        text = client.get("/metrics").text
    return {name for family in families(text) for name in _list_names(family.name, family.type)}


def _list_names(name: str, kind: str) -> Iterator[str]:
    """Names of the samples of a metric of this type."""
    suffixes = {
        "counter": ("_total",),
        "summary": ("_count", "_sum"),
        "histogram": ("_count", "_sum", "_bucket"),
    }
    yield from (name + suffix for suffix in suffixes.get(kind, ("",)))


def test_panels_differ_in_position_title_and_id() -> None:
    positions = {(panel["gridPos"]["x"], panel["gridPos"]["y"]) for panel in PANELS}
    titles, ids = ({panel[key] for panel in PANELS} for key in ("title", "id"))
    assert len(positions) == len(titles) == len(ids) == len(PANELS)


def test_metrics_in_alerts_and_panels_exist(sample_names: set[str]) -> None:
    for expression in (*EXPRESSIONS, *(rule["expr"] for rule in RULES)):
        assert set(METRIC_NAME.findall(expression)) <= sample_names, expression


def test_the_dashboard_shows_the_metrics_of_the_service(sample_names: set[str]) -> None:
    shown_metrics = {name for expression in EXPRESSIONS for name in METRIC_NAME.findall(expression)}
    service_metrics = {name for name in sample_names if name.startswith("surface_")}
    # The limit of the cache does not change, and panels show quantiles of times, not their sum.
    assert service_metrics - shown_metrics == {
        "surface_cache_limit_bytes",
        f"{DURATION}_sum",
        "surface_wait_seconds_sum",
        "surface_wait_seconds_count",
    }


def test_every_alert_is_documented() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert re.findall(r"^## (\w+)$", page, re.MULTILINE) == [rule["alert"] for rule in RULES]
    for rule in RULES:
        assert rule["labels"]["severity"] in {"critical", "warning", "info"}
        assert rule["annotations"]["summary"].endswith(".")
        assert rule["annotations"]["runbook_url"] == f"docs/alerts.md#{rule['alert'].lower()}"


def test_prometheus_accepts_the_rules(promtool: str) -> None:
    run_command(promtool, "check", "config", str(CONFIG))
    run_command(promtool, "check", "rules", "--lint-fatal", str(ALERTS))


def test_prometheus_accepts_the_metrics_of_the_service(promtool: str) -> None:
    with start_client(create_app(Settings())) as client:
        # The second response comes from the cache.
        for url in ("/v1/surfaces/saddle/mesh.glb", "/v1/surfaces/saddle/mesh.glb", "/nowhere"):
            client.get(url)
        text = client.get("/metrics").text
    run_command(promtool, "check", "metrics", stdin=text)


@pytest.mark.slow
def test_the_series_of_each_alert_make_it_fire_and_no_other_alert(
    promtool: str, tmp_path: Path
) -> None:
    shutil.copy(ALERTS, tmp_path / "alerts.yaml")
    series_of_up = {f"up{{{SERVICE}}}": "1x200"}
    # If all instances are absent, each of them is also down.
    alerts_of = {alert: [alert] for alert in SERIES_OF_ALERTS}
    alerts_of["SurfaceAbsent"].append("SurfaceDown")
    # Many errors, or many slow responses, use up their budget as well.
    alerts_of["SurfaceErrors"].append("SurfaceErrorBudget")
    alerts_of["SurfaceSlow"].append("SurfaceLatencyBudget")
    assert set(chain(*alerts_of.values())) == {rule["alert"] for rule in RULES}
    tests = [
        _build_test(series_of_up | series, alerts_of[alert])
        for alert, series in SERIES_OF_ALERTS.items()
    ]
    tests += [_build_test(series_of_up | series, []) for series in SERIES_WITHOUT_ALERT.values()]
    file = tmp_path / "tests.yaml"
    document = {"rule_files": ["alerts.yaml"], "evaluation_interval": "4m", "tests": tests}
    file.write_text(yaml.safe_dump(document), "utf-8")
    run_command(promtool, "test", "rules", str(file))


def _build_test(series: dict[str, str], alerts: list[str]) -> dict[str, Any]:
    """A test for promtool: with these series, exactly these alerts fire."""
    # SurfaceRestarts fires for 15 minutes after the restarts at 30 to 34 minutes, and
    # SurfaceCacheMisses after 2 hours. 52 minutes are the end of the rolling update.
    if alerts:
        is_slow = alerts[0] == "SurfaceCacheMisses" or alerts[0].endswith("Slowly")
        times = ["150m" if is_slow else "40m"]
    else:
        times = ["40m", "52m", "150m"]
    return {
        "interval": "1m",
        "input_series": [{"series": name, "values": values} for name, values in series.items()],
        "promql_expr_test": [
            {
                "expr": 'sum by (alertname) (ALERTS{alertstate="firing"}) > 0',
                "eval_time": time,
                "exp_samples": [
                    {"labels": f'{{alertname="{name}"}}', "value": 1} for name in alerts
                ],
            }
            for time in times
        ],
    }
