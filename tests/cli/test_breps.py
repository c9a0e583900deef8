"""`surface mesh part.json`: files of breps, flags, and errors that point into the file."""

import json
from pathlib import Path

import pytest

from oracles.gltf import read_glb
from oracles.solids import read_solid
from service.cli.main import main


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """The path of a file with a brep alone, without a request around it."""
    file = tmp_path / "part.json"
    file.write_text(json.dumps(read_solid("cone")), encoding="utf-8")
    return file


def test_a_file_of_a_brep_becomes_a_mesh(part: Path, tmp_path: Path) -> None:
    output = tmp_path / "part.glb"
    assert main(["mesh", str(part), "-o", str(output)]) == 0
    report = read_glb(output.read_bytes()).document["asset"]["extras"]["report"]
    assert report["watertight"]
    assert report["reached"]
    coarse = tmp_path / "coarse.stl"
    flags = ["--relative-tolerance", "0.02", "--overlays", "boundary"]
    assert main(["mesh", str(part), "-o", str(coarse), *flags[:2]]) == 0
    assert (coarse.stat().st_size - 84) // 50 < report["triangles"]
    assert main(["mesh", str(part), "-o", str(output), *flags]) == 0
    names = [node["name"] for node in read_glb(output.read_bytes()).document["nodes"]]
    assert names == ["cone", "cone", "boundary"]


def test_a_refused_option_is_named_and_no_file_is_written(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "part.glb"
    assert main(["mesh", str(part), "-o", str(output), "--resolution", "8"]) == 1
    error = capsys.readouterr().err
    assert "resolution" in error
    assert "relative_tolerance" in error
    assert not output.exists()


def test_an_estimate_of_a_part(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", str(part), "-o", "-"]) == 0
    estimate = json.loads(capsys.readouterr().out)
    assert estimate["accepted"]
    assert not estimate["certain"]
