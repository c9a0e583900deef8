"""`surface sign` signs URLs without a service; a service with the same secret accepts them."""

import pytest
from pydantic import SecretStr

from service.api.app import create_app
from service.cli.main import main
from service.settings.values import Settings
from tools.client import start_client

SECRET = "0123456789abcdef" * 2
MESH = "/v1/surfaces/saddle/mesh.json?resolution=1"


def test_the_service_accepts_the_signed_url(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_SIGNING_KEYS", SECRET)
    assert main(["sign", MESH, "--seconds", "60"]) == 0
    url = capsys.readouterr().out.strip()
    assert url.startswith(MESH + "&expires=")
    settings = Settings(public_reads=False, signing_keys=(SecretStr(SECRET),))
    with start_client(create_app(settings)) as client:
        assert client.get(url).status_code == 200
        assert client.get(MESH).status_code == 401


@pytest.mark.parametrize(
    ("secret", "arguments", "expected"),
    [
        ("", [MESH, "--seconds", "60"], (2, "SURFACE_SIGNING_KEYS")),
        ("short", [MESH, "--seconds", "60"], (2, "SURFACE_SIGNING_KEYS")),
        (SECRET, [MESH, "--seconds", "1e3"], (2, "--seconds")),
        (SECRET, [MESH, "--seconds", "700000"], (1, "/seconds")),
        (SECRET, [MESH, "--expires", "1"], (1, "/expires")),
        (SECRET, ["/etc/passwd", "--seconds", "1"], (1, "/url")),
    ],
)
def test_refused_arguments_give_an_error_that_does_not_repeat_the_url(
    secret: str,
    arguments: list[str],
    expected: tuple[int, str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("SURFACE_SIGNING_KEYS", secret)
    code, text = expected
    assert main(["sign", *arguments]) == code
    output = capsys.readouterr()
    assert text in output.err
    assert (output.out, "passwd" in output.err) == ("", False)
