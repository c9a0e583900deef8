"""`surface health`, which a container runs as its health check."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from urllib.parse import urlsplit

import pytest

from service.cli.main import main
from service.settings.listening import find_address
from service.settings.values import Settings
from tools.live import run_service
from tools.programs import run_python


@contextmanager
def serve_once(response: bytes) -> Iterator[str]:
    """The port of a server that accepts one connection and sends these bytes as the response."""

    def respond() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.recv(1 << 16)
            connection.sendall(response)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = Thread(target=respond)
        thread.start()
        yield str(listener.getsockname()[1])
        thread.join()


def test_a_ready_service_gives_exit_code_0(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with run_service() as url:
        monkeypatch.setenv("SURFACE_HOST", "0.0.0.0")
        monkeypatch.setenv("SURFACE_PORT", str(urlsplit(url).port))
        assert main(["health"]) == main(["health", "--live"]) == 0
    assert capsys.readouterr().out == "ready\nlive\n"


@pytest.mark.parametrize(
    ("response", "text"),
    [
        (b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n", "is 503"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "no response"),
        (b"", "no response"),
    ],
    ids=["draining", "another program", "silence"],
)
def test_a_service_that_is_not_ready_gives_exit_code_1(
    response: bytes, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with serve_once(response) as port:
        assert main(["health", "--port", port]) == 1
    output = capsys.readouterr()
    assert text in output.err
    assert output.out == ""


def test_the_health_check_connects_to_the_address_of_the_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The command reads the settings of the service; a wildcard becomes the loopback address."""
    assert find_address(None, None) == (Settings().host, Settings().port)
    assert find_address("10.1.2.3", "81") == ("10.1.2.3", 81)
    monkeypatch.setenv("SURFACE_HOST", "::")
    monkeypatch.setenv("SURFACE_PORT", " 82 ")
    assert find_address(None, None) == ("::1", 82)


def test_the_health_check_imports_no_slow_module() -> None:
    code = (
        "import sys; from service.cli.main import main; main(['health', '--port', '1'])\n"
        "print(*{'numpy', 'pydantic', 'fastapi', 'uvicorn', 'asyncio'} & sys.modules.keys())"
    )
    process = run_python("-c", code)
    assert "no response" in process.stderr
    assert process.stdout == "\n"
