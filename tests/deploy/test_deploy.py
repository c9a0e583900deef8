"""Dockerfile, compose file and Kubernetes manifests are valid, and keep the promises we make."""

import subprocess
from pathlib import Path
from typing import Any

import httpx
import kubernetes_validate
import pytest
import yaml

from service import __version__
from service.settings.environment import with_flags
from service.settings.values import Settings
from service.storage.address import open_store
from tests.tools import program

ROOT = Path(__file__).parents[2]
COMPOSE = ROOT / "deploy" / "compose.yaml"
BASE = ROOT / "deploy" / "kubernetes" / "base"
BUCKET = BASE.with_name("bucket")
MANIFESTS = ["deployment.yaml", "service.yaml", "volume.yaml"]
USER = 10001


def load(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def run(*command: str | Path) -> str:
    """What the command prints; a command that fails fails the test, with what it complained of."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_dockerfile_is_clean() -> None:
    assert run(program("hadolint"), ROOT / "Dockerfile") == ""


def test_compose_file_follows_the_specification() -> None:
    run(program("check-jsonschema"), "--builtin-schema", "vendor.compose-spec", COMPOSE)


def test_compose_container_may_not_write_nor_gain_rights() -> None:
    service = load(COMPOSE)["services"]["surface"]
    assert service["read_only"]
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]


@pytest.mark.parametrize("name", MANIFESTS)
def test_manifest_is_valid(name: str) -> None:
    kubernetes_validate.validate(load(BASE / name), "1.37", strict=True)


def test_misspelled_manifest_is_refused() -> None:
    deployment = load(BASE / "deployment.yaml")
    deployment["spec"]["template"]["spec"]["automountServiceAcountToken"] = False
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(deployment, "1.37", strict=True)


def built(folder: Path) -> dict[str, Any]:
    """What kustomize makes of a folder, by kind: valid manifests of this version."""
    manifests = list(yaml.safe_load_all(run(program("kubectl"), "kustomize", folder)))
    for manifest in manifests:
        kubernetes_validate.validate(manifest, "1.37", strict=True)
    by_kind = {manifest["kind"]: manifest for manifest in manifests}
    assert len(by_kind) == len(manifests)
    container = by_kind["Deployment"]["spec"]["template"]["spec"]["containers"][0]
    assert container["image"] == f"surface-service:{__version__}"
    return by_kind


def test_on_a_volume_there_is_one_replica() -> None:
    """Two would not see each other's surfaces, or could not both mount the volume."""
    manifests = built(BASE)
    claim = manifests["PersistentVolumeClaim"]
    assert claim["spec"]["accessModes"] == ["ReadWriteOnce"]
    deployment = manifests["Deployment"]["spec"]
    assert deployment["replicas"] == 1
    assert deployment["strategy"] == {"type": "Recreate"}
    pod = deployment["template"]["spec"]
    assert pod["securityContext"]["fsGroup"] == USER
    (volume,) = pod["volumes"]
    assert volume["persistentVolumeClaim"]["claimName"] == claim["metadata"]["name"]
    (container,) = pod["containers"]
    variables = {each["name"]: each["value"] for each in container["env"]}
    mount = {"name": volume["name"], "mountPath": variables["SURFACE_STORE"]}
    assert container["volumeMounts"] == [mount]
    assert claim["spec"]["resources"]["requests"]["storage"] == "10Gi"
    quota = with_flags(Settings(), {"store_quota": variables["SURFACE_STORE_QUOTA"]}).store_quota
    assert quota < 10 << 30


def test_in_a_bucket_there_may_be_more() -> None:
    manifests = built(BUCKET)
    assert manifests.keys() == {"Deployment", "Service"}
    deployment = manifests["Deployment"]["spec"]
    assert deployment["replicas"] == 2
    assert deployment["strategy"]["type"] == "RollingUpdate"
    pod = deployment["template"]["spec"]
    assert not pod.get("volumes")
    (container,) = pod["containers"]
    assert not container.get("volumeMounts")
    assert container["securityContext"]["readOnlyRootFilesystem"]
    variables = {each["name"]: each["value"] for each in container["env"]}
    assert variables["SURFACE_STORE"].startswith("s3://")
    open_store(variables["SURFACE_STORE"], 0)
    assert container["envFrom"] == [{"secretRef": {"name": "surface-bucket"}}]


def test_image_keeps_surfaces_where_its_user_may_write() -> None:
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    lines = dockerfile.replace("\\\n", " ").splitlines()
    (folder,) = (line.split()[1] for line in lines if line.startswith("VOLUME"))
    assert f"USER {USER}:{USER}" in lines
    assert f"SURFACE_STORE={folder}" in dockerfile
    (made,) = (line for line in lines if line.startswith("RUN install"))
    assert {f"--owner={USER}", f"--group={USER}", folder} <= set(made.split())
    assert load(COMPOSE)["services"]["surface"]["volumes"] == [f"surfaces:{folder}"]
    assert "surfaces" in load(COMPOSE)["volumes"]


def test_kustomization_and_compose_name_this_version() -> None:
    assert load(BASE / "kustomization.yaml")["images"][0]["newTag"] == __version__
    assert load(COMPOSE)["services"]["surface"]["image"] == f"surface-service:{__version__}"


def test_pod_may_not_write_nor_gain_rights() -> None:
    pod = load(BASE / "deployment.yaml")["spec"]["template"]["spec"]
    assert pod["automountServiceAccountToken"] is False
    assert pod["securityContext"]["runAsNonRoot"]
    assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    (container,) = pod["containers"]
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }
    assert {"startupProbe", "livenessProbe", "readinessProbe"} <= container.keys()


def test_service_finds_the_pods() -> None:
    template = load(BASE / "deployment.yaml")["spec"]["template"]
    service = load(BASE / "service.yaml")["spec"]
    assert service["selector"].items() <= template["metadata"]["labels"].items()
    names = {port["name"] for port in template["spec"]["containers"][0]["ports"]}
    assert {port["targetPort"] for port in service["ports"]} <= names


@pytest.mark.parametrize("probe", ["startupProbe", "livenessProbe", "readinessProbe"])
def test_probed_path_answers(probe: str, server: str) -> None:
    container = load(BASE / "deployment.yaml")["spec"]["template"]["spec"]["containers"][0]
    assert httpx.get(server + container[probe]["httpGet"]["path"]).status_code == 200
