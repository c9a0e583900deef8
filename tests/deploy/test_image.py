"""The Dockerfile passes a linter, and agrees with the files that run its image."""

from tests.deploy.files import DEPLOY, ROOT, USER, load, run
from tests.programs import find_program


def test_dockerfile_is_clean() -> None:
    assert run(find_program("hadolint"), ROOT / "Dockerfile") == ""


def test_image_keeps_surfaces_where_its_user_may_write() -> None:
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    lines = dockerfile.replace("\\\n", " ").splitlines()
    (folder,) = (line.split()[1] for line in lines if line.startswith("VOLUME"))
    assert f"USER {USER}:{USER}" in lines
    assert f"SURFACE_STORE={folder}" in dockerfile
    (built,) = (line for line in lines if line.startswith("RUN install"))
    assert {f"--owner={USER}", f"--group={USER}", folder} <= set(built.split())
    compose = load(DEPLOY / "compose.yaml")
    assert compose["services"]["surface"]["volumes"] == [f"surfaces:{folder}"]
    assert "surfaces" in compose["volumes"]
