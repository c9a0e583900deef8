"""Reads the files in `deploy/`, and checks the limits of memory and time that they set."""

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from service.settings.environment import apply_flags
from service.settings.listening import PREFIX
from service.settings.values import Settings

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
USER = 10001
"""Id of the user and of the group that the processes of the image run as."""


def load_yaml(path: Path) -> Any:
    """The value of a YAML file."""
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def run_command(*command: str | Path, stdin: str = "") -> str:
    """The standard output of a command; if the command fails, the test fails with its output."""
    process = subprocess.run(
        command, input=stdin, capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    return process.stdout


def read_variables(path: Path) -> dict[str, str]:
    """The variables of a file of lines `NAME=value`, without comments."""
    lines = path.read_text(encoding="utf-8").splitlines()
    pairs = (line.partition("=") for line in lines if line and not line.startswith("#"))
    return {name: value for name, _, value in pairs}


MEMORY_LIMIT = 1 << 30
"""Bytes of memory that a container may take."""

PROCESS_BYTES = 200_000_000
"""Bytes that the process takes at most in addition to SURFACE_MEMORY_BYTES (docs/runbook.md)."""


def build_settings(environment: Mapping[str, str]) -> Settings:
    """The settings from the variables `SURFACE_…`; with an unknown one the test fails.

    The default of `memory_bytes` is what it is in a container: half of the container's memory.
    """
    texts = {
        name.removeprefix(PREFIX).lower(): value
        for name, value in environment.items()
        if name.startswith(PREFIX)
    }
    assert texts.keys() <= Settings.model_fields.keys()
    return apply_flags(Settings(memory_bytes=MEMORY_LIMIT // 2), texts)


def assert_within_limits(settings: Settings, memory_limit: int, stop_seconds: int) -> None:
    """Checks that the service fits into its limits of memory and of time to stop.

    Requests and the process must leave a reserve of 30 % of `memory_limit`, in bytes. The service
    must end in the `stop_seconds` between SIGTERM and SIGKILL, with a reserve of 5 seconds.
    """
    assert settings.memory_bytes + PROCESS_BYTES < 0.7 * memory_limit
    assert settings.drain_timeout >= settings.request_timeout, "the longest request must end"
    assert stop_seconds >= settings.drain_delay + settings.drain_timeout + 5
