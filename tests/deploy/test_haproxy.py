"""The configuration of HAProxy agrees with the service; `make test-rolling` runs both."""

import json
import re

from service.api.observing.health import DEADLINE
from service.settings.values import Settings
from tests.deploy.files import DEPLOY, build_settings, load_yaml

TEXT = (DEPLOY / "haproxy" / "haproxy.cfg").read_text(encoding="utf-8")
SERVICES = load_yaml(DEPLOY / "compose.yaml")["services"]
DEFAULTS = Settings()


def read_seconds(name: str) -> float:
    """The value of a setting such as `timeout server 70s`, in seconds."""
    ((number, unit),) = re.findall(rf"\b{name} (\d+)(ms|s)\b", TEXT)
    return int(number) / (1000 if unit == "ms" else 1)


def read_number(name: str) -> int:
    """The first number that follows this word or expression in the configuration."""
    return int(re.findall(rf"\b{name} (\d+)\b", TEXT)[0])


def test_timeouts_of_the_proxy_are_longer_than_those_of_the_service() -> None:
    assert read_seconds("timeout server") > DEFAULTS.request_timeout
    assert read_seconds("timeout client") > DEFAULTS.body_timeout
    assert read_seconds("timeout http-request") >= DEFAULTS.head_timeout


def test_the_proxy_closes_idle_connections_before_the_service_does() -> None:
    assert read_seconds("timeout http-keep-alive") < DEFAULTS.keep_alive


def test_the_proxy_accepts_heads_as_long_as_the_service_does() -> None:
    assert read_number("tune.bufsize") - read_number("tune.maxrewrite") >= DEFAULTS.max_head_bytes


def test_the_proxy_opens_fewer_connections_than_an_instance_accepts() -> None:
    assert re.findall(r"default-server .*maxconn (\d+)", TEXT) == ["1000"]
    assert DEFAULTS.max_connections > 1000


def test_one_client_address_may_have_a_quarter_of_the_connections() -> None:
    # The first `maxconn` is that of the section `global`.
    assert 4 * read_number("sc0_conn_cur gt") <= read_number("maxconn")


def test_the_proxy_notices_a_draining_instance_before_its_listener_closes() -> None:
    """A draining instance fails each health check; after `fall` failures it gets no requests.

    The first failure comes after `inter` at the latest, the others follow every `fastinter`.
    """
    detection_time = read_seconds("inter") + (read_number("fall") - 1) * read_seconds("fastinter")
    settings = build_settings(SERVICES["surface"]["environment"])
    assert settings.drain_delay >= 2 * detection_time
    # The health check of an instance that works takes at most DEADLINE seconds.
    assert read_seconds("timeout check") > DEADLINE
    assert "uri /health/ready " in TEXT


def test_an_instance_that_fails_at_once_gets_no_more_requests_than_others() -> None:
    """`leastconn` would prefer it, because its connections are short."""
    assert "balance leastconn" in TEXT
    options = re.findall(r"default-server (observe .*)", TEXT)
    assert options == ["observe layer7 error-limit 10 on-error mark-down slowstart 10s"]


def test_hosts_are_services_of_the_compose_file() -> None:
    addresses = re.findall(r'server (\S+) "\$\{\w+-(\S+):(\d+)\}"', TEXT)
    assert {host for _, host, _ in addresses} == {"surface", "surface-2"} <= SERVICES.keys()
    for name, host, port in addresses:
        # The servers any-… are backups, for times when no instance is ready.
        assert name in (host, f"any-{host}")
        assert int(port) == DEFAULTS.port


def test_errors_of_the_proxy_itself_are_problem_documents() -> None:
    texts = re.findall(
        r"status (\d+) content-type application/problem\+json string '([^']*)'", TEXT
    )
    assert len(texts) == 6
    for status, text in texts:
        problem = json.loads(text)
        assert problem.keys() == {"type", "title", "status", "code", "detail"}
        assert problem["status"] == int(status)
