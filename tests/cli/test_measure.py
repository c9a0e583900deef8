"""`surface measure`: its flags and its errors."""

import json
from pathlib import Path

import pytest

from service.cli.main import main


def test_flags_set_the_tolerance(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    assert main(["measure", "heated-panel", "--tolerance", "1e-3", "-o", "-"]) == 0
    coarse = json.loads(capsysbinary.readouterr().out)["area"]
    flags = ["--tolerance", "1e-9", "--weld-tolerance", "0"]
    assert main(["measure", "heated-panel", *flags, "-o", "-"]) == 0
    fine = json.loads(capsysbinary.readouterr().out)["area"]
    assert coarse["low"] < fine["low"] < fine["high"] < coarse["high"]


def test_errors_name_the_flag(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "saddle", "--tolerance", "2", "-o", "-"]) == 1
    assert "--tolerance" in capsys.readouterr().err


def test_a_tolerance_that_takes_too_much_work_is_not_reached(
    capsysbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("service.pipeline.measure.BUDGET", 10_000)
    # A plane surface that folds along u = v + 0.1, where |S_u × S_v| has a kink: the bounds of its
    # integral, the area, converge slowly.
    path = tmp_path / "folded.json"
    path.write_text('{"control_net": [[[0, 0, 0], [1, 0, 0]], [[1, 0.1, 0], [2, 1.1, 0]]]}')
    assert main(["measure", str(path), "--tolerance", "1e-9", "-o", "-"]) == 0
    measures = json.loads(capsysbinary.readouterr().out)
    assert not measures["reached"]
    assert measures["area"]["low"] < measures["area"]["high"]
