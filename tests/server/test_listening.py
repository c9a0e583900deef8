"""Sockets that listen, and what a supervisor hears."""

import resource
import socket
from pathlib import Path

import pytest

from service.server import descriptors
from service.server.listening import CannotListen, is_private, listen, urls
from service.server.run import warn_if_open
from service.server.supervisor import notify
from service.settings.values import Settings


def test_a_free_port_is_taken_and_named() -> None:
    (sock,) = listen("127.0.0.1", 0)
    with sock:
        port = sock.getsockname()[1]
        assert urls([sock]) == [f"http://127.0.0.1:{port}"]
        assert is_private([sock])
        with pytest.raises(CannotListen, match="taken by another process"):
            listen("127.0.0.1", port)


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6")
def test_two_colons_are_all_addresses_of_both_kinds() -> None:
    (sock,) = listen("::", 0)
    with sock:
        port = sock.getsockname()[1]
        assert urls([sock]) == [f"http://[::]:{port}"]
        assert not is_private([sock])
        for host in ("127.0.0.1", "::1"):
            socket.create_connection((host, port)).close()


@pytest.mark.parametrize("host", ["192.0.2.1", "no such host", "name.invalid"])
def test_an_address_that_is_none_of_ours(host: str) -> None:
    with pytest.raises(CannotListen, match="no such address"):
        listen(host, 0)


def test_a_supervisor_that_asked_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        notify("READY=1")
        assert sock.recv(100) == b"READY=1"


def test_nobody_listens(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", "@surface-service-test-nobody")
    notify("READY=1")
    assert "could not be told READY=1" in caplog.text
    caplog.clear()
    monkeypatch.delenv("NOTIFY_SOCKET")
    notify("READY=1")
    assert caplog.text == ""


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
        (Limit(256, 4096, 4096), 4096),
        (Limit(256, -1, 10240), 1000 + descriptors.OTHERS),  # macOS
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
    descriptors.raise_limit(1000)
    assert limit.now == becomes
    assert ("the system allows 512" in caplog.text) is (becomes == 512)


@pytest.mark.parametrize(
    ("settings", "warned"),
    [
        (Settings(host="127.0.0.1"), False),
        (Settings(host="0.0.0.0"), True),
        (Settings(host="0.0.0.0", api_keys_file="keys"), False),
    ],
)
def test_who_is_open_to_all_is_warned(
    caplog: pytest.LogCaptureFixture, settings: Settings, warned: bool
) -> None:
    sockets = listen(settings.host, 0)
    warn_if_open(sockets, settings)
    for sock in sockets:
        sock.close()
    assert ("it has no API keys" in caplog.text) is warned
