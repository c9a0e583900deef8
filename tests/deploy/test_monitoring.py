"""Alerts and the dashboard: valid for Prometheus, with metrics that exist, and documented."""

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families as families

from service.api.app import create_app
from service.settings.values import Settings
from tests.api.client import start_client
from tests.deploy.files import DEPLOY, ROOT, load, run
from tests.programs import find_program

ALERTS = DEPLOY / "prometheus" / "alerts.yaml"
CONFIG = DEPLOY / "prometheus" / "prometheus.yml"
PAGE = ROOT / "docs" / "alerts.md"
RULES: list[dict[str, Any]] = load(ALERTS)["groups"][0]["rules"]
DASHBOARD = DEPLOY / "grafana" / "dashboards" / "surface.json"
PANELS: list[dict[str, Any]] = json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]
EXPRESSIONS = [target["expr"] for panel in PANELS for target in panel["targets"]]
NAME = re.compile(r"\b(?:surface|process|python)_\w+")

SERVICE = 'job="surface-service",instance="a"'
TOOK = "surface_http_request_duration_seconds"
POOLS = f'surface_memory_limit_bytes{{{SERVICE},pool="large"}}'
FIRING: dict[str, dict[str, str]] = {
    "SurfaceAbsent": {f"up{{{SERVICE}}}": "0x200", 'up{job="other"}': "1x200"},
    "SurfaceRestarts": {f"process_start_time_seconds{{{SERVICE}}}": "0x30 1 2 3 4 4x170"},
    "SurfaceNotReady": {f"surface_ready{{{SERVICE}}}": "0x200"},
    "SurfaceErrors": {
        f'{TOOK}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+2x200",
        f'{TOOK}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+98x200",
    },
    "SurfaceSlow": {
        f'{TOOK}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="10.0"}}': "0+90x200",
        f'{TOOK}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="30.0"}}': "0+100x200",
        f'{TOOK}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
    },
    "SurfaceBusy": {f'surface_refused_total{{{SERVICE},code="busy"}}': "0+12x200"},
    "SurfaceMemoryLent": {
        f'surface_memory_bytes{{{SERVICE},pool="large"}}': "95x200",
        POOLS: "100x200",
    },
    "SurfaceMemoryAbovePrediction": {
        f"process_resident_memory_bytes{{{SERVICE}}}": "610e6x200",
        POOLS: "400e6x200",
    },
    "SurfaceStoreFailing": {f"surface_store_answering{{{SERVICE}}}": "0x200"},
    "SurfaceStoreNearlyFull": {
        f"surface_store_bytes{{{SERVICE}}}": "86x200",
        f"surface_store_quota_bytes{{{SERVICE}}}": "100x200",
    },
    "SurfaceConnections": {
        f"surface_connections{{{SERVICE}}}": "91x200",
        f"surface_connections_limit{{{SERVICE}}}": "100x200",
    },
    "SurfaceLogLost": {f"surface_log_lines_dropped_total{{{SERVICE}}}": "0+1x200"},
    "SurfaceCacheMisses": {
        f"surface_cache_hits_total{{{SERVICE}}}": "0+10x200",
        f"surface_cache_misses_total{{{SERVICE}}}": "0+90x200",
    },
}
"""Numbers, minute by minute, that make each alert fire."""

QUIET: dict[str, dict[str, str]] = {
    "well": {
        f'{TOOK}_count{{{SERVICE},route="/v1/mesh",status="5xx"}}': "0+0x200",
        f'{TOOK}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+100x200",
        f'{TOOK}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="10.0"}}': "0+100x200",
        f'{TOOK}_bucket{{{SERVICE},route="/v1/mesh",status="2xx",le="+Inf"}}': "0+100x200",
        f'surface_refused_total{{{SERVICE},code="busy"}}': "0+1x200",
        f'surface_refused_total{{{SERVICE},code="invalid_request"}}': "0+900x200",
        f'surface_memory_bytes{{{SERVICE},pool="large"}}': "200e6x200",
        POOLS: "400e6x200",
        f"process_resident_memory_bytes{{{SERVICE}}}": "590e6x200",
        f"process_start_time_seconds{{{SERVICE}}}": "0x50 1x150",
        f"surface_ready{{{SERVICE}}}": "1x200",
        f"surface_store_answering{{{SERVICE}}}": "1x200",
        f"surface_store_bytes{{{SERVICE}}}": "86x200",
        f"surface_connections{{{SERVICE}}}": "10x200",
        f"surface_connections_limit{{{SERVICE}}}": "100x200",
        f"surface_log_lines_dropped_total{{{SERVICE}}}": "5x200",
        f"surface_cache_hits_total{{{SERVICE}}}": "0+90x200",
        f"surface_cache_misses_total{{{SERVICE}}}": "0+90x200",
    },
    # Without a quota the store is never nearly full; without requests, none is slow or missed.
    "idle": {f"surface_store_quota_bytes{{{SERVICE}}}": "0x200"},
    # Rare restarts and refused probes need no alert.
    "rolling": {
        f"surface_ready{{{SERVICE}}}": "1x50 0 0 1x150",
        f'{TOOK}_count{{{SERVICE},route="/health/ready",status="5xx"}}': "0+60x200",
        f'{TOOK}_count{{{SERVICE},route="/v1/mesh",status="2xx"}}': "0+100x200",
    },
}


@pytest.fixture(scope="module")
def promtool() -> str:
    return find_program("promtool")


@pytest.fixture(scope="module")
def scraped() -> set[str]:
    """Names of all samples of an application, also of families that have no samples yet."""
    with start_client(create_app(Settings())) as client:
        client.get("/v1/surfaces/saddle/mesh.glb?resolution=2")
        result = client.get("/metrics").text
    return {name for family in families(result) for name in _find_names(family.name, family.type)}


def _find_names(name: str, kind: str) -> Iterator[str]:
    ends = {
        "counter": ("_total",),
        "summary": ("_count", "_sum"),
        "histogram": ("_count", "_sum", "_bucket"),
    }
    yield from (name + end for end in ends.get(kind, ("",)))


def test_panels_differ_in_place_and_title() -> None:
    places = {(panel["gridPos"]["x"], panel["gridPos"]["y"]) for panel in PANELS}
    for different in (places, {p["title"] for p in PANELS}, {p["id"] for p in PANELS}):
        assert len(different) == len(PANELS)


def test_every_named_metric_exists(scraped: set[str]) -> None:
    for expression in (*EXPRESSIONS, *(rule["expr"] for rule in RULES)):
        named = {name for name in NAME.findall(expression) if name != "surface-service"}
        assert named <= scraped, expression


def test_all_of_ours_is_on_the_dashboard(scraped: set[str]) -> None:
    named = {name for expression in EXPRESSIONS for name in NAME.findall(expression)}
    ours = {name for name in scraped if name.startswith("surface_")}
    left = {"surface_cache_limit_bytes", f"{TOOK}_sum"}
    assert ours - named == left


def test_every_alert_is_explained() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert re.findall(r"^## (\w+)$", page, re.MULTILINE) == [rule["alert"] for rule in RULES]
    for rule in RULES:
        assert rule["labels"]["severity"] in {"critical", "warning", "info"}
        assert rule["annotations"]["summary"].endswith(".")
        assert rule["annotations"]["runbook_url"] == f"docs/alerts.md#{rule['alert'].lower()}"


def test_prometheus_accepts_the_rules(promtool: str) -> None:
    run(promtool, "check", "config", str(CONFIG))
    run(promtool, "check", "rules", "--lint-fatal", str(ALERTS))


def test_prometheus_parses_the_numbers(promtool: str) -> None:
    with start_client(create_app(Settings())) as client:
        for url in ("/v1/surfaces/saddle/mesh.glb", "/v1/surfaces/saddle/mesh.glb", "/nowhere"):
            client.get(url)
        result = client.get("/metrics").text
    run(promtool, "check", "metrics", stdin=result)


def test_each_alert_fires_when_it_should_and_no_other(promtool: str, tmp_path: Path) -> None:
    shutil.copy(ALERTS, tmp_path / "alerts.yaml")
    well = {f"up{{{SERVICE}}}": "1x200"}
    also = {"SurfaceAbsent": ["SurfaceAbsent", "SurfaceDown"]}
    assert {name for names in also.values() for name in names} | FIRING.keys() == {
        rule["alert"] for rule in RULES
    }
    tests = [_test(well | series, also.get(alert, [alert])) for alert, series in FIRING.items()]
    tests += [_test(well | series, []) for series in QUIET.values()]
    file = tmp_path / "tests.yaml"
    whole = {"rule_files": ["alerts.yaml"], "evaluation_interval": "1m", "tests": tests}
    file.write_text(yaml.safe_dump(whole), "utf-8")
    run(promtool, "test", "rules", str(file))


def _test(series: dict[str, str], firing: list[str]) -> dict[str, Any]:
    # Restarts at 30 to 34 minutes count for 15 minutes; cache misses alert after 2 hours.
    at = "150m" if firing in ([], ["SurfaceCacheMisses"]) else "40m"
    return {
        "interval": "1m",
        "input_series": [{"series": name, "values": values} for name, values in series.items()],
        "promql_expr_test": [
            {
                "expr": 'sum by (alertname) (ALERTS{alertstate="firing"}) > 0',
                "eval_time": at,
                "exp_samples": [
                    {"labels": f'{{alertname="{name}"}}', "value": 1} for name in firing
                ],
            }
        ],
    }
