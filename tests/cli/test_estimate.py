"""`surface estimate`, here and at a service."""

import json
from pathlib import Path

import pytest

from service.cli.main import main

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}


def test_here_and_there_it_says_the_same(server: str, tmp_path: Path) -> None:
    ours, theirs, file = (tmp_path / name for name in ("ours.json", "theirs.json", "request.json"))
    file.write_text(json.dumps({"surface": SURFACE, "resolution": 7}), "utf-8")
    for source in ("tea-service", str(file)):
        command = ["estimate", source, "--resolution", "3,2", "--faces", "quads"]
        assert main([*command, "-o", str(ours)]) == 0
        assert main([*command, "-o", str(theirs), "--url", server]) == 0
        assert ours.read_bytes() == theirs.read_bytes()
    told = json.loads(ours.read_bytes())
    assert (told["vertices"], told["quads"], told["accepted"]) == (12, 6, True)


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--format", "fbx"], 2, "--format: unknown"),
        (["--resolution", "0"], 1, "--resolution: "),
        (["--tolerance", "0"], 1, "--tolerance: "),
        (["--resolution", "1", "--max-bytes", "9"], 1, "--resolution: "),
    ],
)
def test_refusals_name_the_flag(
    capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, text: str
) -> None:
    assert main(["estimate", "saddle", "-o", "-", *arguments]) == code
    assert capsys.readouterr().err.startswith(f"surface: {text}")
