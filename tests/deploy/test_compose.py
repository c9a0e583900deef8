"""The compose file follows the specification, and agrees with the service and the documents."""

from ipaddress import ip_address, ip_network
from typing import Any

import pytest

from service import __version__
from service.settings.values import Settings
from tests.deploy.files import DEPLOY, ROOT, build_settings, check_limits, load, read_variables, run
from tests.programs import find_program

FILE = DEPLOY / "compose.yaml"
SERVICES: dict[str, dict[str, Any]] = load(FILE)["services"]
INSTANCES = ("surface", "surface-2")
every_service = pytest.mark.parametrize("name", SERVICES)
instances = pytest.mark.parametrize("name", INSTANCES)


def read_settings(name: str) -> Settings:
    return build_settings(SERVICES[name]["environment"])


def test_it_follows_the_specification() -> None:
    run(find_program("check-jsonschema"), "--builtin-schema", "vendor.compose-spec", FILE)


def test_a_laptop_starts_the_service_alone() -> None:
    alone = [name for name, each in SERVICES.items() if not each.get("profiles")]
    assert alone == ["surface"]
    assert SERVICES["surface"]["env_file"] == [{"path": "surface.env", "required": False}]
    assert SERVICES["surface"]["ports"] == ["127.0.0.1:8000:8000"]


@every_service
def test_container_may_not_write_nor_gain_rights(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"]
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert {"mem_limit", "cpus", "pids_limit", "stop_grace_period"} <= service.keys()
    for volume in service.get("volumes", []):
        if volume.startswith("."):
            assert volume.endswith(":ro")


@every_service
def test_image_is_pinned(name: str) -> None:
    image, _, tag = SERVICES[name]["image"].partition(":")
    assert tag not in ("", "latest")
    if name in INSTANCES:
        assert (image, tag) == ("surface-service", __version__)


@every_service
def test_nothing_is_open_to_the_world(name: str) -> None:
    assert all(port.startswith("127.0.0.1:") for port in SERVICES[name].get("ports", []))


@every_service
def test_no_secret_has_a_default(name: str) -> None:
    """Secrets come from files that git ignores; the examples beside them leave them empty."""
    words = ("PASSWORD", "SECRET", "KEYS", "ACCESS_KEY")
    for variable in SERVICES[name].get("environment", {}):
        assert not any(word in variable for word in words)
    for given in SERVICES[name].get("env_file", []):
        file = given if isinstance(given, str) else given["path"]
        example = read_variables(DEPLOY / f"{file}.example")
        secrets = {key for key in example if any(word in key for word in words)}
        assert secrets
        assert not any(example[key] for key in secrets)
    assert "deploy/*.env" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()


@instances
def test_limits_leave_room_for_the_settings(name: str) -> None:
    assert SERVICES[name]["mem_limit"] == "1g"
    patience = int(SERVICES[name]["stop_grace_period"].removesuffix("s"))
    check_limits(read_settings(name), 1 << 30, patience)
    assert read_settings(name).threads == SERVICES[name]["cpus"]


@instances
def test_only_the_proxy_is_trusted(name: str) -> None:
    (subnet,) = load(FILE)["networks"]["front"]["ipam"]["config"]
    url = ip_address(SERVICES["proxy"]["networks"]["front"]["ipv4_address"])
    assert read_settings(name).trusted_proxies == (str(url),)
    assert url in ip_network(subnet["subnet"])
    assert url not in ip_network(subnet["ip_range"]), "another container might have it"
    assert "front" in SERVICES[name]["networks"]


def test_both_instances_use_the_store_of_the_file() -> None:
    settings = read_variables(DEPLOY / "surface.env.example")
    assert build_settings(settings).store == "s3://surfaces"
    store = read_variables(DEPLOY / "store.env.example")
    assert store["GARAGE_DEFAULT_BUCKET"] == "surfaces"
    assert settings["AWS_ENDPOINT_URL"] == "http://store:3900"
    assert "s3_region = " + f'"{settings["AWS_REGION"]}"' in (
        DEPLOY / "garage" / "garage.toml"
    ).read_text(encoding="utf-8")
    assert SERVICES["surface-2"]["env_file"] == ["surface.env"], "none without it"


@pytest.mark.parametrize("name", ["store", "prometheus", "grafana"])
def test_health_requests_the_service(name: str) -> None:
    assert SERVICES[name]["healthcheck"]["test"][0] == "CMD"
