"""`surface points`: parameters from flags and from files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.main import main
from service.engine.points.places import PointsQuery
from service.pipeline.queries import plan_points
from service.surface.examples.catalogue import find

SADDLE = {"control_net": [[[-1, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]]}


def run_points(*arguments: str, capsysbinary: pytest.CaptureFixture[bytes]) -> dict[str, Any]:
    """The output of `surface points` with these arguments: lists of points, normals and others."""
    assert main(["points", *arguments, "-o", "-"]) == 0
    columns: dict[str, Any] = json.loads(capsysbinary.readouterr().out)
    return columns


def test_points_of_an_example_at_parameters_from_flags(
    capsysbinary: pytest.CaptureFixture[bytes],
) -> None:
    flags = ("--uv", "0.5,0.5", "--uv", "0,1", "--derivatives", "2")
    result = run_points("saddle", *flags, capsysbinary=capsysbinary)
    assert result["positions"] == [[0, 0, 0], [-1, 1, -1]]
    assert result["gaussian_curvature"] == [-1, pytest.approx(-1 / 9)]
    query = PointsQuery(np.array([[0.5, 0.5], [0.0, 1.0]]), None, 2)
    assert result == json.loads(plan_points(find("saddle").surface(), query).run())


def test_points_of_a_face_of_a_cad_file(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    file = str(Path(__file__).parents[1] / "cad_files" / "faceted_cm.step")
    flags = ("--patch", "0", "--uv", "0.5,0.5", "--uv", "0.5,0", "--derivatives", "0")
    result = run_points(file, *flags, capsysbinary=capsysbinary)
    assert result == {"positions": [[0.5, 0.5, 0], [0, 0.5, 0]], "inside": [True, None]}


def test_flags_replace_fields_of_the_file(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"surface": SADDLE, "uv": [[0, 0]], "derivatives": 0}), "utf-8")
    assert run_points(str(file), capsysbinary=capsysbinary) == {"positions": [[-1, -1, 1]]}
    result = run_points(str(file), "--uv", "1,1", capsysbinary=capsysbinary)
    assert result == {"positions": [[1, 1, 1]]}


def test_a_triangle_at_barycentric_coordinates(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    flags = ("--barycentric", "0.25,0.25,0.5", "--derivatives", "0")
    assert len(run_points("monkey-saddle", *flags, capsysbinary=capsysbinary)["positions"]) == 1


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (("--uv", "2,0.5"), "--uv: "),
        (("--uv", "a,0.5"), "--uv: "),
        (("--uv", "nan,0.5"), "--uv: "),
        (("--uv", "1"), "--uv: "),
        (("--uv", "0,0", "--derivatives", "3"), "--derivatives: "),
        (("--derivatives", "1"), "uv"),
    ],
)
def test_errors_name_the_flag(
    flags: tuple[str, ...], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["points", "saddle", "-o", "-", *flags]) == 1
    assert text in capsys.readouterr().err
