"""At its start the server raises the limit of open files, notifies systemd, and may warn."""

import resource
import socket
from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.services import _warn_if_open
from service.server import run
from service.server.run import make_server, notify
from service.server.sockets import raise_file_limit
from service.settings.values import Settings
from service.storage.watch import CHECK_INTERVAL
from tests.clock import Clock

pytestmark = pytest.mark.anyio


def test_systemd_is_notified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        notify("READY=1")
        assert sock.recv(100) == b"READY=1"


async def test_systemd_is_notified_once_when_the_store_has_answered(
    tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "store").mkdir()
    settings = Settings(store=str(tmp_path / "store"))
    app = create_app(settings)
    (tmp_path / "store").rename(tmp_path / "elsewhere")
    store = app.state.services.store
    server = make_server(app, settings, app.state)
    states: list[str] = []
    monkeypatch.setattr(run, "notify", states.append)
    await server.on_tick(1)
    assert not await store.is_ready()
    await server.on_tick(2)
    assert states == []
    (tmp_path / "elsewhere").rename(tmp_path / "store")
    clock.now += CHECK_INTERVAL
    assert await store.is_ready()
    for counter in range(3, 6):
        await server.on_tick(counter)
    assert states == ["READY=1"]


def test_a_supervisor_that_does_not_listen_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    # "@" means a name outside the file system (Linux); nothing listens at this name.
    monkeypatch.setenv("NOTIFY_SOCKET", "@surface-service-test-closed")
    notify("READY=1")


class FileLimit:
    """Stands in for the system's limit of open files; -1 means no limit.

    The system accepts at most `maximum`, which may be less than the hard limit (as on macOS).
    """

    def __init__(self, soft: int, hard: int, maximum: int) -> None:
        self.soft, self.hard, self.maximum = soft, hard, maximum

    def getrlimit(self, _: int) -> tuple[int, int]:
        return self.soft, self.hard

    def setrlimit(self, _: int, limits: tuple[int, int]) -> None:
        if limits[0] == -1 or limits[0] > self.maximum:
            raise ValueError
        self.soft = limits[0]


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (FileLimit(256, 4096, 4096), 1000),
        (FileLimit(256, -1, 10240), 1000),  # macOS
        (FileLimit(256, 512, 512), 512),
        (FileLimit(5000, 5000, 5000), 5000),
        (FileLimit(-1, -1, 0), -1),
    ],
)
def test_the_soft_limit_of_open_files_is_raised(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    limit: FileLimit,
    expected: int,
) -> None:
    monkeypatch.setattr(resource, "getrlimit", limit.getrlimit)
    monkeypatch.setattr(resource, "setrlimit", limit.setrlimit)
    raise_file_limit(1000)
    assert limit.soft == expected
    assert ("the system allows 512" in caplog.text) is (expected == 512)


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
def test_a_service_on_all_addresses_without_keys_warns(
    caplog: pytest.LogCaptureFixture, settings: Settings, is_warned: bool
) -> None:
    _warn_if_open(settings)
    assert ("it has no API keys" in caplog.text) is is_warned
