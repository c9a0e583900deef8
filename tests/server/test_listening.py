"""Limits that the process asks of the system, and messages to its supervisor."""

import resource
import socket
from pathlib import Path

import pytest

from service.cli.serve import _warn_if_open
from service.server.run import notify, raise_file_limit
from service.settings.values import Settings


def test_a_supervisor_is_notified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        notify("READY=1")
        assert sock.recv(100) == b"READY=1"


def test_a_supervisor_that_is_away_is_no_reason_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", "@surface-service-test-closed")
    notify("READY=1")


class Limit:
    """The system's limit of open files."""

    def __init__(self, soft: int, hard: int, most: int) -> None:
        self.now, self.hard, self.most = soft, hard, most

    def get(self, _: int) -> tuple[int, int]:
        return self.now, self.hard

    def set(self, _: int, limits: tuple[int, int]) -> None:
        if limits[0] == -1 or limits[0] > self.most:
            raise ValueError
        self.now = limits[0]


@pytest.mark.parametrize(
    ("limit", "becomes"),
    [
        (Limit(256, 4096, 4096), 1000),
        (Limit(256, -1, 10240), 1000),  # macOS
        (Limit(256, 512, 512), 512),
        (Limit(5000, 5000, 5000), 5000),
        (Limit(-1, -1, 0), -1),
    ],
)
def test_file_descriptors(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, limit: Limit, becomes: int
) -> None:
    monkeypatch.setattr(resource, "getrlimit", limit.get)
    monkeypatch.setattr(resource, "setrlimit", limit.set)
    raise_file_limit(1000)
    assert limit.now == becomes
    assert ("the system allows 512" in caplog.text) is (becomes == 512)


@pytest.mark.parametrize(
    ("settings", "is_warned"),
    [
        (Settings(host="127.0.0.2"), False),
        (Settings(host="localhost"), False),
        (Settings(host="::1"), False),
        (Settings(host="0.0.0.0"), True),
        (Settings(host="0.0.0.0", api_keys_file="keys"), False),
    ],
)
def test_a_service_that_is_open_to_all_warns(
    caplog: pytest.LogCaptureFixture, settings: Settings, is_warned: bool
) -> None:
    _warn_if_open(settings)
    assert ("it has no API keys" in caplog.text) is is_warned
