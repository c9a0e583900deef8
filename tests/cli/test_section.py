"""`surface section`: planes from flags and from a file; the suffix of the output is the format."""

import json
from pathlib import Path

import pytest

from service.cli.main import main


def test_planes_from_flags_and_from_a_file(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """The planes z = 0 and z = 0.6, by offsets and by points.

    Offsets are distances, whatever the length of the normal. Without `--normal` it is 0, 0, 1.
    """
    flags = ["--relative-tolerance", "0.01", "-o", "-", "--format", "json"]
    assert main(["section", "sphere", "--normal", "0,0,2", "--offsets", "0,0.6", *flags]) == 0
    output = capsysbinary.readouterr().out
    assert main(["section", "sphere", "--point", "3,0,0", "--point", "0,0,0.6", *flags]) == 0
    assert capsysbinary.readouterr().out == output
    sections = json.loads(output)["sections"]
    assert [len(section["polylines"]) for section in sections] == [1, 1]
    request = tmp_path / "request.json"
    planes = {"normals": [[0, 0, 1]], "offsets": [0, 0.6]}
    surface = {"control_net": [[[0, 0, -1], [0, 1, -1]], [[0, 0, 1], [0, 1, 1]]]}
    request.write_text(json.dumps({"surface": surface, "planes": planes, "tolerance": 0.1}))
    assert main(["section", str(request), "-o", str(tmp_path / "section.svg")]) == 0
    assert (tmp_path / "section.svg").read_text().count("<path ") == 2


def test_flags_replace_planes_that_are_no_object(tmp_path: Path) -> None:
    request = tmp_path / "request.json"
    surface = {"control_net": [[[0, 0, -1], [0, 1, -1]], [[0, 0, 1], [0, 1, 1]]]}
    request.write_text(json.dumps({"surface": surface, "planes": 5}))
    output = tmp_path / "section.svg"
    assert main(["section", str(request), "-o", str(output)]) == 1
    assert main(["section", str(request), "--offsets", "0", "-o", str(output)]) == 0
    assert output.read_text().count("<path ") == 1


def test_a_surface_without_planes_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["section", "sphere", "-o", "section.svg"]) == 1
    assert "planes" in capsys.readouterr().err
