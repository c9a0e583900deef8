"""`surface store` stores a surface in a service, and prints its URLs."""

import json
from pathlib import Path

import httpx
import numpy as np
import pytest

from service.cli.main import main
from service.storage.canonical import canonical_content, surface_id
from service.surface.bezier import BezierSurface

NET = np.array([[[0.0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]])
SURFACE = {"control_net": NET.tolist(), "name": "sail"}
ID = surface_id(canonical_content(BezierSurface(NET, name="sail")))


@pytest.fixture
def net(tmp_path: Path) -> str:
    file = tmp_path / "net.json"
    file.write_text(json.dumps(SURFACE), encoding="utf-8")
    return str(file)


def read_output(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """The printed lines, such as `id 5f…`, as a dictionary."""
    return dict(line.split() for line in capsys.readouterr().out.splitlines())


def test_the_printed_urls_serve_the_surface(
    server: str, net: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The id is the same if the surface is stored already, and for float32 with equal numbers."""
    array = tmp_path / "net.npy"
    np.save(array, NET.astype(np.float32))
    for arguments in ([net], [net], [str(array), "--name", "sail"]):
        assert main(["store", *arguments, "--url", server]) == 0
        lines = read_output(capsys)
        assert lines["id"] == ID
        assert lines["self"] == f"{server}/v1/surfaces/{ID}"
        assert httpx.get(lines["self"]).json()["surface"]["control_net"] == NET.tolist()


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["mesh", "0" * 64, "-o", "x.glb", "--url", "{server}"], 1, "No surface is stored"),
        (["mesh", "0" * 64, "-o", "x.glb", "--url", "{server}", "--name", "x"], 2, "--name"),
        (["mesh", ID, "-o", "x.glb"], 2, "no such file"),
        (["store", "teapot", "--url", "{server}"], 2, "no such file"),
        (["store", "saddle", "--url", "{server}/foo"], 3, "not a surface service"),
        (["store", "saddle", "--url", "ftp://host"], 2, "--url"),
        (["store", "saddle", "--name", "x", "--url", "{server}"], 2, "--name"),
    ],
)
def test_commands_that_fail_have_an_exit_code_and_an_error(
    server: str, capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, text: str
) -> None:
    assert main([argument.format(server=server) for argument in arguments]) == status
    assert text in capsys.readouterr().err


def test_store_requires_the_url_of_a_service(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as error:
        main(["store", "saddle"])
    assert error.value.code == 2
    assert "--url" in capsys.readouterr().err
