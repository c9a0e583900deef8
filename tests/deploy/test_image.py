"""The Dockerfile passes a linter, and agrees with the files that run its image."""

from tests.deploy.files import DEPLOY, ROOT, USER, load_yaml, run_command
from tools.programs import find_program


def test_the_linter_reports_no_issues() -> None:
    assert run_command(find_program("hadolint"), ROOT / "Dockerfile") == ""


def test_the_store_of_the_image_is_a_volume_that_its_user_may_write() -> None:
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    lines = dockerfile.replace("\\\n", " ").splitlines()
    (folder,) = (line.split()[1] for line in lines if line.startswith("VOLUME"))
    assert f"USER {USER}:{USER}" in lines
    assert f"SURFACE_STORE={folder}" in dockerfile
    (command,) = (line for line in lines if line.startswith("RUN install"))
    assert {f"--owner={USER}", f"--group={USER}", folder} <= set(command.split())
    compose = load_yaml(DEPLOY / "compose.yaml")
    assert compose["services"]["surface"]["volumes"] == [f"surfaces:{folder}"]
    assert "surfaces" in compose["volumes"]
