"""`surface check`: its summary, its answer, its flags and exit codes, and a service at --url."""

import json
from pathlib import Path

import pytest

from service.cli.main import main
from tests.cad import TETRAHEDRON

SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
CORNERS = [[0, 0, 0.25], [1, 0, 0.25], [1, 1, 0.25], [0, 1, 0.25]]
LIFTED = {"vertices": CORNERS, "faces": [[0, 1, 2, 3]]}


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Goes to a folder with a square, and with meshes a quarter above it."""
    monkeypatch.chdir(tmp_path)
    Path("square.json").write_text(json.dumps(SQUARE))
    Path("lifted.json").write_text(json.dumps(LIFTED))
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    Path("lifted.off").write_text(f"OFF\n4 1 0\n{rows}4 0 1 2 3\n")


def test_a_summary_says_how_far_and_where(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    assert main(["check", "square.json", "lifted.json"]) == 0
    size, outward, inward, faults, angle = capsysbinary.readouterr().out.decode().splitlines()
    assert size == "2 triangles, 4 vertices"
    for line, name in ((outward, "surface to mesh"), (inward, "mesh to surface")):
        assert line.startswith(f"{name}: 0.2")
        assert ", triangle " in line
        assert ", uv (" in line
    counts = "4 open edges, 0 non-manifold edges, 0 flipped edges, 0 degenerate faces"
    assert faults == counts
    assert angle.startswith("largest angle between normals: ")


def test_the_answer_is_that_of_a_service(
    server: str, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    flags = ["--relative-tolerance", "0.05", "--quad-diagonal", "13", "--distances"]
    answers = []
    for mesh in ("lifted.json", "lifted.off"):
        for url in ([], ["--url", server]):
            assert main(["check", "square.json", mesh, *flags, *url, "-o", "-"]) == 0
            answers.append(json.loads(capsysbinary.readouterr().out))
    assert all(answer == answers[0] for answer in answers)
    assert answers[0]["mesh"]["faces"] == [[0, 1, 3], [1, 2, 3]]
    assert len(answers[0]["distances"]) == 4


def test_surfaces_are_examples_ids_and_files(
    server: str, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    Path("part.step").write_bytes(TETRAHEDRON)
    for source in ("saddle", "part.step"):
        assert main(["mesh", source, "-o", "mesh.stl", "--tolerance", "0.1"]) == 0
        for url in ([], ["--url", server]):
            output = ["-o", "answer.json"]
            assert main(["check", source, "mesh.stl", "--max", "0.2", *url, *output]) == 0
            answer = json.loads(Path("answer.json").read_bytes())
            assert answer["surface_to_mesh"]["low"] <= 0.1
            assert answer["flipped_edges"] == 0
    capsysbinary.readouterr()
    assert main(["store", "square.json", "--url", server]) == 0
    id = capsysbinary.readouterr().out.decode().split()[1]
    assert main(["check", id, "lifted.off", "--url", server, "-o", "-"]) == 0
    assert json.loads(capsysbinary.readouterr().out)["surface_to_mesh"]["low"] <= 0.25


def test_a_larger_deviation_than_the_largest_allowed_fails(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["check", "square.json", "lifted.off", "--max", "0.3", "-o", "out.json"]) == 0
    assert main(["check", "square.json", "lifted.off", "--max", "0.2", "-o", "out.json"]) == 1
    assert "more than --max 0.2" in capsys.readouterr().err
    assert Path("out.json").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["-", "-"], 2, "standard input has one file"),
        (["square.json", "missing.stl"], 2, "missing.stl: no such file"),
        (["missing.json", "lifted.off"], 2, "no such example"),
        (["square.json", "lifted.off", "--mesh-format", "step"], 2, "--mesh-format"),
        (["square.json", "square.json"], 1, "/mesh/control_net"),
        (["square.json", "lifted.off", "--mesh-format", "ply"], 1, "/mesh/file"),
        (["square.json", "lifted.off", "--max", "-1"], 2, "--max"),
        (["square.json", "lifted.off", "--max", "x"], 2, "--max"),
        (["square.json", "lifted.off", "--relative-tolerance", "2"], 1, "--relative-tolerance"),
        (["square.json", "lifted.off", "--quad-diagonal", "2"], 1, "--quad-diagonal"),
        (["square.json", "lifted.off", "-o", ""], 2, "--output"),
    ],
)
def test_wrong_commands_are_refused_with_the_reason(
    capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, text: str
) -> None:
    assert main(["check", *arguments]) == code
    assert text in capsys.readouterr().err
