"""The file of HAProxy agrees with the service: `make test-rolling` runs it."""

import json
import re

from service.api.observing.health import DEADLINE
from service.settings.values import Settings
from tests.deploy.files import DEPLOY, build_settings, load

TEXT = (DEPLOY / "haproxy" / "haproxy.cfg").read_text(encoding="utf-8")
SERVICES = load(DEPLOY / "compose.yaml")["services"]
DEFAULTS = Settings()


def read_seconds(name: str) -> float:
    """One of HAProxy's times."""
    (result,) = re.findall(rf"\b{name} (\d+)(ms|s)\b", TEXT)
    return int(result[0]) / (1000 if result[1] == "ms" else 1)


def read_number(name: str) -> int:
    return int(re.findall(rf"\b{name} (\d+)\b", TEXT)[0])


def test_the_service_refuses_before_the_proxy_does() -> None:
    assert read_seconds("timeout server") > DEFAULTS.request_timeout
    assert read_seconds("timeout client") > DEFAULTS.body_timeout
    assert read_seconds("timeout http-request") >= DEFAULTS.head_timeout


def test_idle_connections_are_closed_by_the_proxy_first() -> None:
    assert read_seconds("timeout http-keep-alive") < DEFAULTS.keep_alive


def test_heads_are_as_long_as_the_service_takes() -> None:
    assert read_number("tune.bufsize") - read_number("tune.maxrewrite") >= DEFAULTS.max_head_bytes


def test_connections_are_fewer_than_an_instance_takes() -> None:
    assert re.findall(r"default-server .*maxconn (\d+)", TEXT) == ["1000"]
    assert DEFAULTS.max_connections > 1000


def test_one_address_cannot_take_all_connections() -> None:
    assert 4 * read_number("sc0_conn_cur gt") <= read_number("maxconn")


def test_not_ready_is_known_before_the_listener_closes() -> None:
    """A draining service responds to the check at once."""
    seconds = read_seconds("inter") + (read_number("fall") - 1) * read_seconds("fastinter")
    settings = build_settings(SERVICES["surface"]["environment"])
    assert settings.drain_delay >= 2 * seconds
    assert read_seconds("timeout check") > DEADLINE, "a working service may take that long"
    assert "uri /health/ready " in TEXT


def test_addresses_are_those_of_compose() -> None:
    addresses = re.findall(r'server (\S+) "\$\{\w+-(\S+):(\d+)\}"', TEXT)
    assert {host for _, host, _ in addresses} == {"surface", "surface-2"} <= SERVICES.keys()
    for name, host, port in addresses:
        assert name in (host, f"any-{host}")
        assert int(port) == DEFAULTS.port


def test_responses_of_the_proxy_itself_are_problems() -> None:
    texts = re.findall(
        r"status (\d+) content-type application/problem\+json string '([^']*)'", TEXT
    )
    assert len(texts) == 6
    for status, text in texts:
        problem = json.loads(text)
        assert problem.keys() == {"type", "title", "status", "code", "detail"}
        assert problem["status"] == int(status)
