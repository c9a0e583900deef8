"""`surface project`: points from flags and from a file, projected onto a surface or a curve."""

import json
from pathlib import Path

import numpy as np
import pytest

from service.cli.main import main


def test_points_from_flags_and_from_a_file(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    points = tmp_path / "points.npy"
    np.save(points, np.array([[0.0, 0, 5], [1, 2, 3]]))
    flags = ["--relative-tolerance", "1e-6", "--sign", "-o", "-"]
    assert main(["project", "sphere", "--point", "0,0,5", "--point", "1,2,3", *flags]) == 0
    output = capsysbinary.readouterr().out
    assert main(["project", "sphere", "--points", str(points), *flags]) == 0
    assert capsysbinary.readouterr().out == output
    assert json.loads(output)["distances"] == pytest.approx([4, 14**0.5 - 1])
    assert json.loads(output)["signs"] == [1, 1]


def test_a_request_with_a_curve(tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    request = tmp_path / "request.json"
    curve = {"control_points": [[0, 0], [1, 0]]}
    request.write_text(json.dumps({"curve": curve, "points": [[0.25, 1]]}))
    assert main(["project", str(request), "-o", "-"]) == 0
    assert json.loads(capsysbinary.readouterr().out)["positions"] == [[0.25, 0]]


def test_a_file_that_is_not_an_array_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "points.npy").write_bytes(b"points")
    assert main(["project", "sphere", "--points", str(tmp_path / "points.npy"), "-o", "-"]) == 1
    assert "--points: " in capsys.readouterr().err
