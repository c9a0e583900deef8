"""`surface store`: stores a surface at a service, and prints its URLs."""

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
    return dict(line.split() for line in capsys.readouterr().out.splitlines())


def test_urls_are_printed_and_respond(
    server: str, net: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = tmp_path / "net.npy"
    np.save(files, NET.astype(np.float32))
    for arguments in ([net], [net], [str(files), "--name", "sail"]):
        assert main(["store", *arguments, "--url", server]) == 0
        result = read_output(capsys)
        assert result["id"] == ID
        assert result["self"] == f"{server}/v1/surfaces/{ID}"
        assert httpx.get(result["self"]).json()["surface"]["control_net"] == NET.tolist()


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
def test_commands_that_fail(
    server: str, capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, text: str
) -> None:
    assert main([part.format(server=server) for part in arguments]) == status
    assert text in capsys.readouterr().err


def test_a_service_is_needed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ending:
        main(["store", "saddle"])
    assert ending.value.code == 2
    assert "--url" in capsys.readouterr().err
