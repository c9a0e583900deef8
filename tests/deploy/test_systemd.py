"""The systemd unit is valid, is confined, and agrees with the service."""

import re
import shutil
from pathlib import Path

import pytest

from tests.deploy.files import DEPLOY, build_settings, check_limits, read_variables, run
from tests.programs import find_program

UNIT = DEPLOY / "systemd" / "surface-service.service"
PROGRAM = "/opt/surface-service/bin/surface"
LINES = [line.partition("=") for line in UNIT.read_text(encoding="utf-8").splitlines()]
SETTINGS = build_settings(read_variables(DEPLOY / "systemd" / "surface.env.example"))


def read_value(name: str) -> str:
    (value,) = (value for key, _, value in LINES if key == name)
    return value


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """A copy of the unit with a program that exists on this machine."""
    text = UNIT.read_text(encoding="utf-8")
    assert PROGRAM in text
    copy = tmp_path / UNIT.name
    copy.write_text(text.replace(PROGRAM, shutil.which("true") or ""), encoding="utf-8")
    return copy


def test_systemd_accepts_the_unit(unit: Path) -> None:
    run(find_program("systemd-analyze"), "verify", unit)


def test_it_is_confined(unit: Path) -> None:
    """systemd's own rating is from 0, confined, to 10, exposed."""
    reported = run(
        find_program("systemd-analyze"), "security", "--offline=true", "--threshold=15", unit
    )
    (rating,) = re.findall(r"exposure level for \S+: ([\d.]+) OK", reported)
    assert float(rating) <= 1.5


def test_limits_leave_room_for_the_settings() -> None:
    assert read_value("MemoryMax") == "1G"
    check_limits(SETTINGS, 1 << 30, int(read_value("TimeoutStopSec")))
    assert SETTINGS.max_connections < int(read_value("LimitNOFILE"))


def test_the_store_is_in_a_directory_that_it_may_write() -> None:
    assert f"SURFACE_STORE=%S/{read_value('StateDirectory')} " in read_value("Environment")
