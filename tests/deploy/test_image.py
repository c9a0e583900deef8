"""The Dockerfile passes a linter, and agrees with the files that run its image."""

import re

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
    assert f"surfaces:{folder}" in compose["services"]["surface"]["volumes"]
    assert "surfaces" in compose["volumes"]


def test_the_image_has_the_programs_that_the_files_of_deploy_run() -> None:
    """A step of the build removes all other programs of `/app/bin`."""
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    (kept,) = (line for line in dockerfile.splitlines() if "-path '/app/bin/*'" in line)
    for name in ("surface", "dask"):
        assert f"! -name {name}" in kept
    assert "cluster" in re.findall(r"^ARG EXTRAS=(.*)$", dockerfile, re.MULTILINE)[0].split(",")
