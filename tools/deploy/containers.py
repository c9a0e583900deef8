"""Builds and runs containers without a Docker daemon, by Debian's packages buildah, podman, runc.

Needs root. Images and containers are stored in one folder, and no image is downloaded.
"""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

PROGRAMS = ("mmdebstrap", "buildah", "podman", "runc")

DEBIAN = "bookworm"
"""The Debian release of the base images; it has Python 3.11 and Node 18, which the build needs."""

PACKAGES = {"python": "python3-minimal,python3-venv", "node": "nodejs,npm"}
"""Packages of the base images of Debian that replace the official images."""


class CheckFailed(Exception):
    """A command failed, or a container does not respond."""


def run_command(*command: str | Path, timeout: float = 900, cwd: Path | None = None) -> str:
    """Runs a command; returns its standard output.

    Raises
    ------
    CheckFailed
        The command fails or takes too long. The message has the end of its output.
    """
    try:
        result = subprocess.run(
            command, capture_output=True, text=True, timeout=timeout, cwd=cwd, check=False
        )
    except subprocess.TimeoutExpired:
        raise CheckFailed(f"{command[0]}: no end after {timeout:.0f} s") from None
    if result.returncode:
        raise CheckFailed(
            f"{' '.join(map(str, command))}\n{(result.stdout + result.stderr)[-3000:]}"
        )
    return result.stdout


def find_missing() -> str:
    """The reason, in words, why this machine cannot build images; empty if it can."""
    missing = [name for name in PROGRAMS if not shutil.which(name)]
    if missing:
        return f"not installed: {', '.join(missing)} (Debian's packages of these names)"
    return "" if os.geteuid() == 0 else "only root may build and run images here"


class Engine:
    """Images and containers, stored in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._storage = ("--root", f"{folder}/storage", "--runroot", f"{folder}/run")
        options = ("--runtime", "runc", "--cgroup-manager", "cgroupfs")
        self._podman = ("podman", *self._storage, *options)

    def buildah(self, *arguments: str | Path) -> str:
        """Runs buildah; returns its output."""
        return run_command("buildah", *self._storage, *arguments)

    def podman(self, *arguments: str | Path, timeout: float = 120) -> str:
        """Runs podman with runc, which supports both versions of cgroups; returns its output."""
        # If memory runs out, podman writes a file into the working folder.
        return run_command(*self._podman, *arguments, timeout=timeout, cwd=self.folder)

    def build_base(self, kind: str) -> str:
        """The name of a base image of Debian with "python" or "node"; it is built only once."""
        name = f"localhost/debian-{kind}:{DEBIAN}"
        if not self.podman("images", "--quiet", name).strip():
            print(f"  building a base image of Debian with {kind} …", flush=True)
            archive = self.folder / f"{kind}.tar"
            packages = f"--include={PACKAGES[kind]},ca-certificates"
            run_command("mmdebstrap", "--quiet", "--variant=minbase", packages, DEBIAN, archive)
            self.podman("import", "--quiet", archive, name)
            archive.unlink()
        return name

    def build(self, source: Path, tag: str, arguments: dict[str, str]) -> None:
        """Builds the Dockerfile of a folder without cache; pip and npm use this machine's
        registries."""
        build_arguments = [
            text for pair in arguments.items() for text in ("--build-arg", "=".join(pair))
        ]
        # Only Docker's format has health checks. With timestamp 0, files do not depend on the time.
        self.buildah(
            "bud", "--quiet", "--no-cache", "--pull-never", "--isolation", "chroot",
            "--format", "docker", "--timestamp", "0", *build_arguments, *self._registries(),
            "--tag", tag, source,
        )  # fmt: skip

    def inspect(self, image: str) -> dict[str, Any]:
        """The description of an image by `podman image inspect`."""
        images: list[dict[str, Any]] = json.loads(self.podman("image", "inspect", image))
        return images[0]

    def state(self, container: str) -> dict[str, Any]:
        """The state of a container by `podman container inspect`: process id, start, exit code."""
        (description,) = json.loads(self.podman("container", "inspect", container))
        return dict(description["State"])

    def logs(self, container: str) -> str:
        """Standard output and standard error of a container, in one text."""
        return run_command("sh", "-c", '"$@" 2>&1', "sh", *self._podman, "logs", container)

    def _registries(self) -> list[str]:
        """Options of buildah with which pip and npm use this machine's registries.

        The settings are secrets; the files that the settings name are volumes.
        """
        # From each value to its option, so that none is given twice.
        options: dict[str, str] = {}
        for name, text in {"pip.conf": _read_pip_settings(), "npmrc": _read_npm_settings()}.items():
            file = self.folder / name
            file.write_text(text, encoding="utf-8")
            options[f"id={name},src={file}"] = "--secret"
            for path in map(Path, re.findall(r"(?:[\s='\"]|file://)(/[\w./-]+)", text)):
                if path.is_file():
                    options[f"{path}:{path}:ro"] = "--volume"
                elif path.is_dir() and name == "pip.conf" and path.parent != Path("/"):
                    # The index may be a folder of this machine, with the packages beside it.
                    options[f"{path.parent}:{path.parent}:ro"] = "--volume"
        return [text for value, option in options.items() for text in (option, value)]


def _read_pip_settings() -> str:
    """The settings of this machine's pip as one file; environment variables have priority."""
    settings: dict[str, str] = {}
    # Sorted, the lines `:env:.…`, which are variables, are before `global.…`.
    for line in sorted(run_command(sys.executable, "-m", "pip", "config", "list").splitlines()):
        key, _, value = line.partition("=")
        name = key.rpartition(".")[2]
        if key.startswith((":env:", "global.", "user.", "site.")) and name not in settings:
            settings[name] = str(ast.literal_eval(value)).replace("\n", "\n ")
    return "\n".join(["[global]", *(f"{name} = {value}" for name, value in settings.items()), ""])


def _read_npm_settings() -> str:
    """The settings of this machine's npm as one file."""
    files = (
        run_command("npm", "config", "get", f"{kind}config").strip() for kind in ("global", "user")
    )
    return "\n".join(Path(f).read_text(encoding="utf-8") for f in files if Path(f).is_file())
