"""The compose file follows the specification of Compose, and agrees with the service."""

from ipaddress import ip_address, ip_network
from typing import Any

import pytest

from service import __version__
from service.settings.values import Settings
from tests.deploy.files import (
    DEPLOY,
    MEMORY_LIMIT,
    ROOT,
    assert_within_limits,
    build_settings,
    load_yaml,
    read_variables,
    run_command,
)
from tools.programs import find_program

FILE = DEPLOY / "compose.yaml"
SERVICES: dict[str, dict[str, Any]] = load_yaml(FILE)["services"]
INSTANCES = ("surface", "surface-2")
CLUSTER = ("scheduler", "worker")
every_service = pytest.mark.parametrize("name", SERVICES)
instances = pytest.mark.parametrize("name", INSTANCES)


def read_settings(name: str) -> Settings:
    return build_settings(SERVICES[name]["environment"])


def test_the_file_follows_the_specification() -> None:
    run_command(find_program("check-jsonschema"), "--builtin-schema", "vendor.compose-spec", FILE)


def test_without_a_profile_only_one_instance_of_the_service_starts() -> None:
    without_profile = [name for name, each in SERVICES.items() if not each.get("profiles")]
    assert without_profile == ["surface"]
    assert SERVICES["surface"]["env_file"] == [{"path": "surface.env", "required": False}]
    assert SERVICES["surface"]["ports"] == ["127.0.0.1:8000:8000"]


@every_service
def test_containers_are_limited_and_cannot_write_to_their_image_or_gain_privileges(
    name: str,
) -> None:
    service = SERVICES[name]
    assert service["read_only"]
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert {"mem_limit", "cpus", "pids_limit", "stop_grace_period"} <= service.keys()
    for volume in service.get("volumes", []):
        if volume.startswith("."):  # a path in this repository
            assert volume.endswith(":ro")


@every_service
def test_images_are_pinned_to_a_version(name: str) -> None:
    image, _, tag = SERVICES[name]["image"].partition(":")
    assert tag not in ("", "latest")
    if name in (*INSTANCES, *CLUSTER):
        assert (image, tag) == ("surface-service", __version__)


@every_service
def test_ports_are_published_on_the_loopback_address_only(name: str) -> None:
    assert all(port.startswith("127.0.0.1:") for port in SERVICES[name].get("ports", []))


@every_service
def test_secrets_have_no_defaults(name: str) -> None:
    """Secrets stand in files that git ignores. For each there is an example, without secrets."""
    words = ("PASSWORD", "SECRET", "KEYS", "ACCESS_KEY")
    for variable in SERVICES[name].get("environment", {}):
        assert not any(word in variable for word in words)
    for entry in SERVICES[name].get("env_file", []):
        file = entry if isinstance(entry, str) else entry["path"]
        example = read_variables(DEPLOY / f"{file}.example")
        secrets = {key for key in example if any(word in key for word in words)}
        assert secrets
        assert not any(example[key] for key in secrets)
    assert "deploy/*.env" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()


@instances
def test_the_settings_fit_into_the_limits_of_the_container(name: str) -> None:
    assert SERVICES[name]["mem_limit"] == "1g"
    stop_seconds = int(SERVICES[name]["stop_grace_period"].removesuffix("s"))
    assert_within_limits(read_settings(name), MEMORY_LIMIT, stop_seconds)
    assert read_settings(name).threads == SERVICES[name]["cpus"]


@instances
def test_only_the_proxy_is_trusted(name: str) -> None:
    (subnet,) = load_yaml(FILE)["networks"]["front"]["ipam"]["config"]
    proxy_address = ip_address(SERVICES["proxy"]["networks"]["front"]["ipv4_address"])
    assert read_settings(name).trusted_proxies == (str(proxy_address),)
    assert proxy_address in ip_network(subnet["subnet"])
    # Docker gives addresses of `ip_range` to other containers.
    assert proxy_address not in ip_network(subnet["ip_range"])
    assert "front" in SERVICES[name]["networks"]


def test_both_instances_use_the_store_in_surface_env() -> None:
    settings = read_variables(DEPLOY / "surface.env.example")
    assert build_settings(settings).store == "s3://surfaces"
    store = read_variables(DEPLOY / "store.env.example")
    assert store["GARAGE_DEFAULT_BUCKET"] == "surfaces"
    assert settings["AWS_ENDPOINT_URL"] == "http://store:3900"
    assert "s3_region = " + f'"{settings["AWS_REGION"]}"' in (
        DEPLOY / "garage" / "garage.toml"
    ).read_text(encoding="utf-8")
    # Two instances need a common store, so the second does not start without surface.env.
    assert SERVICES["surface-2"]["env_file"] == ["surface.env"]


@pytest.mark.parametrize("name", ["store", "prometheus", "grafana"])
def test_the_store_and_the_monitoring_have_health_checks(name: str) -> None:
    assert SERVICES[name]["healthcheck"]["test"][0] == "CMD"


@pytest.mark.parametrize("name", CLUSTER)
def test_the_dask_cluster_is_a_profile_and_starts_again(name: str) -> None:
    service = SERVICES[name]
    assert service["profiles"] == ["cluster"]
    assert service["restart"] == "always"  # workers end with code 0 when the scheduler is lost
    assert service["entrypoint"] == ["/app/bin/dask"]
    assert "ports" not in service, "programs that reach the scheduler can run code"
    assert "127.0.0.1:8787" in service["command"], "Dask's web pages have no password"
    assert service["healthcheck"]["test"][0] == "CMD"


def test_all_members_of_the_cluster_have_its_certificate_and_demand_tls() -> None:
    folder = "/etc/surface-service/cluster"
    for name in (*INSTANCES, *CLUSTER):
        variables = {
            key.removeprefix("DASK_DISTRIBUTED__COMM__"): value
            for key, value in SERVICES[name]["environment"].items()
            if key.startswith("DASK_")
        }
        assert variables.pop("REQUIRE_ENCRYPTION") == "true"
        assert variables.pop("DEFAULT_SCHEME") == "tls"
        assert variables == {"TLS__CA_FILE": f"{folder}/tls.crt"} | {
            f"TLS__{role}__{kind}": f"{folder}/tls.{suffix}"
            for role in ("CLIENT", "SCHEDULER", "WORKER")
            for kind, suffix in (("CERT", "crt"), ("KEY", "key"))
        }
        assert f"./cluster:{folder}:ro" in SERVICES[name]["volumes"]
        assert "cluster" in SERVICES[name]["networks"]
    ignored = (DEPLOY / "cluster" / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert "*" in ignored


def test_only_members_of_the_cluster_reach_its_scheduler() -> None:
    assert SERVICES["scheduler"]["networks"] == ["cluster"]
    members = {name for name, each in SERVICES.items() if "cluster" in each["networks"]}
    assert members == {*INSTANCES, *CLUSTER}
    assert load_yaml(FILE)["networks"]["cluster"] == {"internal": True}


def test_workers_get_the_keys_of_the_bucket_and_no_other_secret() -> None:
    assert SERVICES["worker"]["env_file"] == ["cluster.env"]
    variables = read_variables(DEPLOY / "cluster.env.example")
    own = read_variables(DEPLOY / "surface.env.example")
    assert variables == {key: value for key, value in own.items() if key.startswith("AWS_")}
