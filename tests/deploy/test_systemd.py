"""The systemd unit is valid, confines the service, and agrees with its settings."""

import re
import shutil
from pathlib import Path

import pytest

from tests.deploy.files import (
    DEPLOY,
    MEMORY_LIMIT,
    assert_within_limits,
    build_settings,
    read_variables,
    run_command,
)
from tools.programs import find_program

UNIT = DEPLOY / "systemd" / "surface-service.service"
PROGRAM = "/opt/surface-service/bin/surface"
LINES = [line.partition("=") for line in UNIT.read_text(encoding="utf-8").splitlines()]
SETTINGS = build_settings(read_variables(DEPLOY / "systemd" / "surface.env.example"))


def read_value(name: str) -> str:
    """The value of a directive that occurs once in the unit."""
    (value,) = (value for key, _, value in LINES if key == name)
    return value


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """A copy of the unit that starts a program that exists on this machine, `true`."""
    text = UNIT.read_text(encoding="utf-8")
    assert PROGRAM in text
    copy = tmp_path / UNIT.name
    copy.write_text(text.replace(PROGRAM, shutil.which("true") or ""), encoding="utf-8")
    return copy


def test_systemd_accepts_the_unit(unit: Path) -> None:
    run_command(find_program("systemd-analyze"), "verify", unit)


def test_the_unit_is_confined(unit: Path) -> None:
    """systemd rates the exposure of a unit from 0, confined, to 10, exposed."""
    # The threshold is in tenths: 15 is a rating of 1.5.
    report = run_command(
        find_program("systemd-analyze"), "security", "--offline=true", "--threshold=15", unit
    )
    (rating,) = re.findall(r"exposure level for \S+: ([\d.]+) OK", report)
    assert float(rating) <= 1.5


def test_the_settings_fit_into_the_limits_of_the_unit() -> None:
    assert read_value("MemoryMax") == "1G"
    assert_within_limits(SETTINGS, MEMORY_LIMIT, int(read_value("TimeoutStopSec")))
    assert SETTINGS.max_connections < int(read_value("LimitNOFILE"))


def test_the_store_is_in_a_directory_that_the_unit_may_write() -> None:
    assert f"SURFACE_STORE=%S/{read_value('StateDirectory')} " in read_value("Environment")
