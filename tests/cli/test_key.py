"""The command line sends the key in SURFACE_KEY to a service that requires a key."""

from collections.abc import Iterator

import pytest

from service.api.guard.keys import format_entry, make_key
from service.cli.main import main
from service.settings.values import Settings
from tools.live import run_service

KEY = make_key()
MESH = ["mesh", "saddle", "--resolution", "1", "-o", "-", "--format", "json"]


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    settings = Settings(api_keys=(format_entry("alice", KEY),), public_reads=False)
    with run_service(settings) as url:
        yield url


def test_with_the_key_in_the_environment_commands_succeed(
    server: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_KEY", KEY)
    assert main([*MESH, "--url", server]) == 0
    assert '"vertices"' in capsys.readouterr().out
    assert main(["store", "saddle", "--url", server]) == 0


# With 1 the service refused the request; with 2 the key cannot be in a header, so nothing was sent.
@pytest.mark.parametrize(("key", "code"), [("", 1), ("sfk_0", 1), ("sfk_0\n", 2), ("schlüssel", 2)])
def test_without_a_valid_key_the_error_names_the_variable(
    server: str,
    key: str,
    code: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("SURFACE_KEY", key)
    assert main([*MESH, "--url", server]) == code
    output = capsys.readouterr()
    assert "SURFACE_KEY" in output.err
    assert output.out == ""
    assert not key or key not in output.err
