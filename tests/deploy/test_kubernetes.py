"""The Kubernetes manifests are valid, and agree with the service."""

from functools import cache
from typing import Any
from urllib.parse import urlsplit

import kubernetes_validate
import pytest
import yaml
from fastapi.routing import iter_route_contexts

from service import __version__
from service.api.app import create_app
from service.api.observing.health import DEADLINE
from service.settings.values import Settings
from service.storage.address import open_store
from service.storage.watch import CHECK_INTERVAL, MAX_FAILURES
from service.storage.watch import DEADLINE as CHECK_DEADLINE
from tests.deploy.files import (
    DEPLOY,
    MEMORY_LIMIT,
    USER,
    assert_within_limits,
    build_settings,
    load_yaml,
    run_command,
)
from tools.programs import find_program

KUBERNETES_VERSION = "1.37"
"""The version against whose schemas the manifests are validated."""

FOLDER = DEPLOY / "kubernetes"
OVERLAYS = sorted(path.name for path in (FOLDER / "overlays").iterdir())
OPERATOR_KINDS = {"ServiceMonitor", "PrometheusRule"}
"""Kinds of the Prometheus Operator, which Kubernetes itself does not define."""

SERVICE = "surface-service"
CLUSTER = ("surface-scheduler", "surface-worker")
"""Names of deployments: that of the service, and those of a Dask cluster."""

CERTIFICATES = "/etc/surface-service/cluster"
"""The folder of the certificate of the Dask cluster."""

ROLES = ("CLIENT", "SCHEDULER", "WORKER")

NAME = "app.kubernetes.io/name"
"""The label that selects pods."""

Manifest = dict[str, Any]
overlays = pytest.mark.parametrize("overlay", OVERLAYS)


@cache
def build_overlay(overlay: str) -> dict[tuple[str, str], Manifest]:
    """The manifests of an overlay, by kind and name, after validation."""
    text = run_command(find_program("kubectl"), "kustomize", FOLDER / "overlays" / overlay)
    manifests = list(yaml.safe_load_all(text))
    for each in manifests:
        if each["kind"] not in OPERATOR_KINDS:
            kubernetes_validate.validate(each, KUBERNETES_VERSION, strict=True)
    by_name = {(each["kind"], each["metadata"]["name"]): each for each in manifests}
    assert len(by_name) == len(manifests)
    return by_name


def select_kind(overlay: str, kind: str) -> list[Manifest]:
    """All manifests of this kind."""
    return [each for each in build_overlay(overlay).values() if each["kind"] == kind]


def find_only(overlay: str, kind: str) -> Manifest:
    """The only manifest of this kind; of deployments and services, that of the service itself."""
    manifests = select_kind(overlay, kind)
    if kind in ("Deployment", "Service"):
        return find_named(manifests, SERVICE)
    (manifest,) = manifests
    return manifest


def find_named(manifests: list[Manifest], name: str) -> Manifest:
    """The manifest of this name."""
    (manifest,) = (each for each in manifests if each["metadata"]["name"] == name)
    return manifest


def find_pod(overlay: str, name: str = SERVICE) -> Any:
    """The specification of the pods of a deployment."""
    deployment = find_named(select_kind(overlay, "Deployment"), name)
    return deployment["spec"]["template"]["spec"]


def find_container(overlay: str, name: str = SERVICE) -> Any:
    """The specification of the only container in the pods of a deployment."""
    (container,) = find_pod(overlay, name)["containers"]
    return container


def read_variables(overlay: str, config_map: str, name: str = SERVICE) -> dict[str, str]:
    """The variables that the container of a deployment gets from a map of configuration."""
    names = [each["configMapRef"]["name"] for each in find_container(overlay, name)["envFrom"]
             if "configMapRef" in each]  # fmt: skip
    (full_name,) = (each for each in names if each.startswith(f"{config_map}-"))
    variables: dict[str, str] = find_named(select_kind(overlay, "ConfigMap"), full_name)["data"]
    return variables


def read_settings(overlay: str) -> Settings:
    """The settings of the service from the environment variables of its container."""
    return build_settings(read_variables(overlay, "surface-settings"))


@overlays
def test_all_objects_are_in_one_namespace_with_restricted_pods(overlay: str) -> None:
    namespace = find_only(overlay, "Namespace")
    assert namespace["metadata"]["labels"]["pod-security.kubernetes.io/enforce"] == "restricted"
    for (kind, _), each in build_overlay(overlay).items():
        if kind != "Namespace":
            assert each["metadata"]["namespace"] == namespace["metadata"]["name"]


@overlays
def test_image_is_of_this_version(overlay: str) -> None:
    assert find_container(overlay)["image"] == f"surface-service:{__version__}"


@overlays
def test_pods_cannot_write_to_their_image_or_gain_privileges(overlay: str) -> None:
    pod = find_pod(overlay)
    account = find_only(overlay, "ServiceAccount")
    assert pod["serviceAccountName"] == account["metadata"]["name"]
    assert account["automountServiceAccountToken"] is False
    assert pod["automountServiceAccountToken"] is False
    assert pod["securityContext"]["runAsNonRoot"]
    assert pod["securityContext"]["runAsUser"] == pod["securityContext"]["fsGroup"] == USER
    assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    assert find_container(overlay)["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }


@overlays
def test_the_settings_fit_into_the_limits_of_the_container(overlay: str) -> None:
    settings = read_settings(overlay)
    limit = find_container(overlay)["resources"]["limits"]["memory"]
    assert limit == "1Gi"
    assert_within_limits(settings, MEMORY_LIMIT, find_pod(overlay)["terminationGracePeriodSeconds"])
    # With 0 the service would start one thread for each processor of the node.
    assert settings.threads > 0
    if select_kind(overlay, "Ingress"):
        # During `drain_delay`, the load balancer notices that the pod is not ready.
        assert settings.drain_delay >= 5
    # A `preStop` hook that waits is not necessary, because the service itself waits.
    assert "lifecycle" not in find_container(overlay)


@overlays
def test_the_service_selects_the_pods_and_their_port(overlay: str) -> None:
    template = find_only(overlay, "Deployment")["spec"]["template"]
    service = find_only(overlay, "Service")["spec"]
    assert service["selector"].items() <= template["metadata"]["labels"].items()
    assert (
        find_only(overlay, "Deployment")["spec"]["selector"]["matchLabels"] == service["selector"]
    )
    ports = {each["name"]: each["containerPort"] for each in find_container(overlay)["ports"]}
    assert {port["targetPort"] for port in service["ports"]} <= ports.keys()
    assert ports["http"] == read_settings(overlay).port


@overlays
def test_probes_request_routes_of_the_service(overlay: str) -> None:
    container = find_container(overlay)
    probes = ("startupProbe", "livenessProbe", "readinessProbe")
    for probe in probes:
        assert container[probe]["httpGet"]["port"] == "http"
    assert container["readinessProbe"]["timeoutSeconds"] > DEADLINE + CHECK_DEADLINE
    assert container["readinessProbe"]["failureThreshold"] == 2
    paths = [container[probe]["httpGet"]["path"] for probe in probes]
    assert paths == ["/health/live", "/health/live", "/health/ready"]
    routes = {route.path for route in iter_route_contexts(create_app(Settings()).routes)}
    assert set(paths) <= routes


@overlays
def test_an_update_goes_on_only_after_the_store_could_have_failed(overlay: str) -> None:
    spec = find_only(overlay, "Deployment")["spec"]
    # Until readiness shows it: the checks of the store, and the failed probes.
    probe = find_container(overlay)["readinessProbe"]
    detection_time = (MAX_FAILURES - 1) * CHECK_INTERVAL + CHECK_DEADLINE
    detection_time += probe["failureThreshold"] * probe["periodSeconds"]
    assert detection_time < spec["minReadySeconds"] < spec["progressDeadlineSeconds"]


@overlays
def test_network_policies_allow_only_needed_traffic(overlay: str) -> None:
    """Clients reach the port of the service; if the store is a bucket, pods reach DNS and HTTPS."""
    policies = {
        each["metadata"]["name"]: each["spec"] for each in select_kind(overlay, "NetworkPolicy")
    }
    default_policy = policies.pop("nothing")
    assert default_policy == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}
    labels = find_only(overlay, "Service")["spec"]["selector"]
    own = [each for each in policies.values() if each["podSelector"]["matchLabels"] == labels]
    for spec in own:
        for rule in spec.get("ingress", []):
            assert rule["from"], "a rule without `from` allows all addresses"
            assert rule["ports"] == [{"port": "http", "protocol": "TCP"}]
    egress_ports = {
        port["port"] for spec in own for rule in spec.get("egress", []) for port in rule["ports"]
    }
    settings = read_settings(overlay)
    uses_bucket = settings.store.startswith("s3://")
    scheduler = {urlsplit(settings.dask).port} if settings.dask else set()
    assert egress_ports == ({53, 443} if uses_bucket else set()) | scheduler
    others = {each["podSelector"]["matchLabels"][NAME] for each in policies.values()} - {SERVICE}
    assert others == (set(CLUSTER) if settings.dask else set())


def test_with_a_volume_one_replica_runs() -> None:
    """Two replicas with a volume each would store different surfaces; one volume has one pod."""
    claim = find_only("local", "PersistentVolumeClaim")
    assert claim["spec"]["accessModes"] == ["ReadWriteOnce"]
    deployment = find_only("local", "Deployment")["spec"]
    assert deployment["replicas"] == 1
    assert deployment["strategy"] == {"type": "Recreate"}
    (volume,) = find_pod("local")["volumes"]
    assert volume["persistentVolumeClaim"]["claimName"] == claim["metadata"]["name"]
    settings = read_settings("local")
    mount = {"name": volume["name"], "mountPath": settings.store}
    assert find_container("local")["volumeMounts"] == [mount]
    assert claim["spec"]["resources"]["requests"]["storage"] == "10Gi"
    assert settings.store_quota < 10 << 30


def test_in_production_replicas_share_a_bucket_and_one_may_stop() -> None:
    deployment = find_only("production", "Deployment")
    scaling = find_only("production", "HorizontalPodAutoscaler")["spec"]
    assert "replicas" not in deployment["spec"], "the autoscaler sets the number"
    target = scaling["scaleTargetRef"]
    assert (target["kind"], target["name"]) == ("Deployment", deployment["metadata"]["name"])
    assert scaling["minReplicas"] >= 2
    assert deployment["spec"]["strategy"]["rollingUpdate"] == {"maxUnavailable": 0, "maxSurge": 1}
    budget = find_only("production", "PodDisruptionBudget")["spec"]
    assert budget["maxUnavailable"] < scaling["minReplicas"]
    assert budget["selector"] == deployment["spec"]["selector"]
    settings = read_settings("production")
    assert settings.store.startswith("s3://")
    # Opening a bucket checks its address, and sends no request.
    open_store(settings.store, settings.store_quota)
    assert {"secretRef": {"name": "surface-bucket"}} in find_container("production")["envFrom"]
    for each in find_pod("production")["topologySpreadConstraints"]:
        assert each["labelSelector"] == deployment["spec"]["selector"]


def test_in_production_keys_are_in_a_file_that_may_change() -> None:
    (volume,) = find_pod("production")["volumes"]
    assert volume["secret"]["secretName"] == "surface-keys"
    assert not volume["secret"].get("optional"), "without keys every client may compute and store"
    (mount,) = find_container("production")["volumeMounts"]
    assert mount["readOnly"]
    assert "subPath" not in mount, "a file mounted by subPath does not change with its secret"
    folder, _, _ = read_settings("production").api_keys_file.rpartition("/")
    assert (mount["name"], mount["mountPath"]) == (volume["name"], folder)


def test_the_ingress_leads_to_all_routes_except_those_for_operators() -> None:
    ingress = find_only("production", "Ingress")["spec"]
    (rule,) = ingress["rules"]
    assert ingress["tls"][0]["hosts"] == [rule["host"]]
    paths = rule["http"]["paths"]
    service = {"name": "surface-service", "port": {"name": "http"}}
    assert all(each["backend"] == {"service": service} for each in paths)
    exact_paths = {each["path"] for each in paths if each["pathType"] == "Exact"}
    path_prefixes = {each["path"] for each in paths if each["pathType"] == "Prefix"}

    def is_reached(path: str) -> bool:
        return path in exact_paths or any(
            f"{path}/".startswith(f"{each}/") for each in path_prefixes
        )

    routes = {route.path for route in iter_route_contexts(create_app(Settings()).routes)}
    operator_paths = {"/health/live", "/health/ready", "/metrics"}
    # By its type, a route may have no path.
    assert {path for path in routes if path and not is_reached(path)} == operator_paths
    annotations = find_only("production", "Ingress")["metadata"]["annotations"]
    seconds = int(annotations["haproxy.org/timeout-server"].removesuffix("s"))
    assert seconds > read_settings("production").request_timeout


def test_prometheus_gives_the_service_the_job_name_that_alerts_use() -> None:
    service = find_only("monitored", "Service")
    monitor = find_only("monitored", "ServiceMonitor")["spec"]
    assert monitor["selector"]["matchLabels"].items() <= service["metadata"]["labels"].items()
    assert service["metadata"]["labels"][monitor["jobLabel"]] == "surface-service"
    (endpoint,) = monitor["endpoints"]
    assert endpoint["port"] in {port["name"] for port in service["spec"]["ports"]}
    assert endpoint["path"] == "/metrics"


def test_the_alerts_equal_those_in_the_folder_of_prometheus() -> None:
    alerts = load_yaml(DEPLOY / "prometheus" / "alerts.yaml")
    assert find_only("monitored", "PrometheusRule")["spec"] == alerts


def list_allowed(direction: str, name: str) -> set[tuple[str, int]]:
    """Names of pods and ports that policies of the cluster allow to pods of this name, or from."""
    peer = "from" if direction == "ingress" else "to"
    return {
        (selector["podSelector"]["matchLabels"][NAME], port["port"])
        for policy in select_kind("cluster", "NetworkPolicy")
        if policy["spec"]["podSelector"].get("matchLabels") == {NAME: name}
        for rule in policy["spec"].get(direction, [])
        for selector in rule[peer]
        if NAME in selector.get("podSelector", {}).get("matchLabels", {})
        and "namespaceSelector" not in selector
        for port in rule["ports"]
    }


def test_only_the_service_and_workers_reach_the_scheduler() -> None:
    """Programs that reach it can run code."""
    service, scheduler, worker = SERVICE, *CLUSTER
    assert list_allowed("ingress", scheduler) == {(service, 8786), (worker, 8786)}
    assert list_allowed("egress", service) == {(scheduler, 8786)}
    assert list_allowed("ingress", worker) == {(scheduler, 8788), (scheduler, 8789)}
    assert list_allowed("egress", scheduler) == {(worker, 8788), (worker, 8789)}
    arguments = find_container("cluster", worker)["args"]
    for option, port in (("--worker-port", "8788"), ("--nanny-port", "8789")):
        assert arguments[arguments.index(option) + 1] == port
    # Dask's web pages have no password.
    for name in CLUSTER:
        arguments = find_container("cluster", name)["args"]
        assert arguments[arguments.index("--dashboard-address") + 1] == "127.0.0.1:8787"


def test_all_members_of_the_cluster_have_its_certificate_and_demand_tls() -> None:
    expected = {
        f"DASK_DISTRIBUTED__COMM__{name}": value
        for name, value in {
            "REQUIRE_ENCRYPTION": "true",
            "DEFAULT_SCHEME": "tls",
            "TLS__CA_FILE": f"{CERTIFICATES}/ca.crt",
            **{f"TLS__{role}__CERT": f"{CERTIFICATES}/tls.crt" for role in ROLES},
            **{f"TLS__{role}__KEY": f"{CERTIFICATES}/tls.key" for role in ROLES},
        }.items()
    }
    for name in (SERVICE, *CLUSTER):
        assert read_variables("cluster", "surface-cluster", name) == expected
        mounts = {
            each["mountPath"]: each for each in find_container("cluster", name)["volumeMounts"]
        }
        assert mounts[CERTIFICATES]["readOnly"]
        (volume,) = (
            each
            for each in find_pod("cluster", name)["volumes"]
            if each["name"] == mounts[CERTIFICATES]["name"]
        )
        assert volume["secret"]["secretName"] == "surface-cluster"
        assert not volume["secret"].get("optional")
    address = urlsplit(read_settings("cluster").dask)
    (port,) = find_named(select_kind("cluster", "Service"), address.hostname or "")["spec"]["ports"]
    assert (address.scheme, address.port) == ("tls", port["port"])
    assert find_container("cluster", "surface-worker")["args"][1] == address.geturl()


@pytest.mark.parametrize("name", CLUSTER)
def test_pods_of_the_cluster_are_confined_as_those_of_the_service(name: str) -> None:
    pod, own = find_pod("cluster", name), find_pod("cluster")
    container, own_container = find_container("cluster", name), find_container("cluster")
    for field in ("serviceAccountName", "automountServiceAccountToken", "securityContext"):
        assert pod[field] == own[field]
    for field in ("image", "securityContext"):
        assert container[field] == own_container[field]
    assert {"cpu", "memory"} <= container["resources"]["requests"].keys()
    assert "memory" in container["resources"]["limits"]
    assert {"startupProbe", "livenessProbe", "readinessProbe"} <= container.keys()


def test_workers_get_the_keys_of_the_bucket_and_no_other_secret() -> None:
    """Code that runs on workers must not sign URLs."""
    container = find_container("cluster", "surface-worker")
    names = {each["valueFrom"]["secretKeyRef"]["key"] for each in container["env"]}
    assert names >= {"AWS_REGION", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"}
    assert all(name.startswith("AWS_") for name in names)
    assert not any("secretRef" in each for each in container["envFrom"])
