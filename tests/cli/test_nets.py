"""Files of control points on the command line, read locally and by a service."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.main import main
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples import find

TEAPOT = "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with one file of every kind."""
    net = np.zeros((5, 6, 4))
    net[..., 0], net[..., 1] = np.indices((5, 6))
    net[..., 2], net[..., 3] = net[..., 0] * net[..., 1] % 3, 1 + net[..., 0] % 2
    np.save(tmp_path / "net.npy", net)
    np.save(tmp_path / "single.npy", np.asfortranarray(net[..., :3], dtype=">f4"))
    saddle = find("saddle").surface()
    patches = render(saddle, MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez"))
    for name in ("saddle.bez", "saddle.bbp", "saddle.oogl"):
        (tmp_path / name).write_bytes(patches)
    (tmp_path / "strip.teapot").write_text(TEAPOT, encoding="ascii")
    (tmp_path / "strip.txt").write_text(TEAPOT, encoding="ascii")
    fields = {"type": "bspline", "degree": [3, 2], "knots": ["clamped", "periodic"], "name": "n"}
    document = fields | {"control_net": net[..., :3].tolist(), "weights": net[..., 3].tolist()}
    (tmp_path / "net.json").write_text(json.dumps(document), encoding="utf-8")
    return tmp_path


SPLINE = ["--type", "bspline", "--degree", "3,2", "--knots", "clamped,periodic", "--name", "n"]
CASES: dict[str, list[str]] = {
    "net.npy": [],
    "single.npy": ["--up", "z", "--resolution", "2"],
    "saddle.bez": ["--tolerance", "0.1"],
    "saddle.bbp": [],
    "saddle.oogl": ["--name", "saddle"],
    "strip.teapot": ["--faces", "quads"],
    "strip.txt": ["--input-format", "teapot"],
}


@pytest.mark.parametrize("name", CASES)
def test_local_and_remote_meshes_are_equal(server: str, files: Path, name: str) -> None:
    ours, theirs = files / "ours.json", files / "theirs.json"
    command = ["mesh", str(files / name), *CASES[name]]
    assert main([*command, "-o", str(ours)]) == 0
    assert main([*command, "-o", str(theirs), "--url", server]) == 0
    assert ours.read_bytes() == theirs.read_bytes()


def test_an_array_with_flags_equals_the_json_document(files: Path) -> None:
    by_flags, by_json = files / "flags.glb", files / "json.glb"
    assert main(["mesh", str(files / "net.npy"), *SPLINE, "-o", str(by_flags)]) == 0
    assert main(["mesh", str(files / "net.json"), "-o", str(by_json)]) == 0
    assert by_flags.read_bytes() == by_json.read_bytes()


@pytest.mark.parametrize(
    "command",
    [["estimate"], ["convert", "--split", "u=0.5"], ["points", "--uv", "0.25,0.5"]],
    ids=lambda command: command[0],
)
def test_other_commands_read_them_too(server: str, files: Path, command: list[str]) -> None:
    answers: list[Any] = []
    for source in ([str(files / "net.npy"), *SPLINE], [str(files / "net.json")]):
        for there in ([], ["--url", server]):
            output = files / "answer.json"
            assert main([*command, *source, *there, "-o", str(output)]) == 0
            answers.append(json.loads(output.read_bytes()))
    assert all(response == answers[0] for response in answers)


REFUSED: list[tuple[list[str], int, str]] = [
    (["net.npy", "--type", "tube"], 1, "--type: "),
    (["net.npy", "--type", "bspline", "--degree", "99"], 1, "--degree: "),
    (["net.npy", "--type", "bspline", "--knots", "none"], 1, "--knots: "),
    (["net.npy", "--knots", "clamped"], 1, "--knots: No field has this name"),
    (["net.npy", "--up", "x"], 1, "--up: "),
    (["net.npy", "--input-format", "oogl"], 1, "The service reads OOGL as text"),
    (["net.npy", "--input-format", "json"], 1, "The text is not"),
    (["net.npy", "--input-format", "xyz"], 2, "--input-format: unknown"),
    (["net.npy", "--resolution", "0"], 1, "--resolution: "),
    (["strip.txt"], 1, "The text is not JSON at line 2"),
    (["saddle.bez", "--input-format", "teapot"], 1, "A number is needed here (line 1)."),
    (["net.json", "--degree", "3"], 2, "--degree: only for files of control points"),
    (["missing.npy"], 2, "no such file"),
]


@pytest.mark.parametrize("number", range(len(REFUSED)), ids=lambda k: str(REFUSED[k]))
def test_refusals_name_the_flag_or_the_line(
    server: str, files: Path, capsys: pytest.CaptureFixture[str], number: int
) -> None:
    (source, *flags), code, text = REFUSED[number]
    command = (["mesh", "--format", "off"], ["estimate"])[number % 2]
    for there in ([], ["--url", server]):
        assert main([*command, str(files / source), *flags, *there, "-o", "-"]) == code
        assert capsys.readouterr().err.startswith(f"surface: {text}")
