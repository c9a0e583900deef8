"""Readers of the files in `deploy/`."""

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from service.settings.environment import with_flags
from service.settings.listening import PREFIX
from service.settings.values import Settings

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
USER = 10001
"""The user of the image."""


def load(path: Path) -> Any:
    """A YAML file."""
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def run(*command: str | Path, stdin: str = "") -> str:
    """The output of a command; its failure fails the test, with its error output."""
    done = subprocess.run(
        command, input=stdin, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def read_variables(path: Path) -> dict[str, str]:
    """The variables of a file with one variable on each line."""
    lines = path.read_text(encoding="utf-8").splitlines()
    pairs = (line.partition("=") for line in lines if line and not line.startswith("#"))
    return {name: value for name, _, value in pairs}


LIMIT = 1 << 30
"""Bytes that a container may take."""


def build_settings(environment: Mapping[str, str]) -> Settings:
    """The settings from these variables; an unknown variable fails the test."""
    ours = {
        name.removeprefix(PREFIX).lower(): value
        for name, value in environment.items()
        if name.startswith(PREFIX)
    }
    assert ours.keys() <= Settings.model_fields.keys()
    return with_flags(Settings(memory_bytes=LIMIT // 2), ours)


def check_limits(settings: Settings, limit: int, patience: int) -> None:
    """Checks that running requests and the process fit into a limit of memory, with a reserve, and
    that the longest request and the drain end between SIGTERM and SIGKILL.
    """
    assert settings.memory_bytes + PROCESS < 0.7 * limit
    assert settings.drain_timeout >= settings.request_timeout, "the longest request ends"
    assert patience >= settings.drain_delay + settings.drain_timeout + 5


PROCESS = 200_000_000
"""Bytes that a process may take beside SURFACE_MEMORY_BYTES: together less than 600 MB."""
