"""`surface measure`: flags and refusals."""

import json

import pytest

from service.cli.main import main


def test_flags_say_how_narrow(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    assert main(["measure", "heated-panel", "--tolerance", "1e-3", "-o", "-"]) == 0
    coarse = json.loads(capsysbinary.readouterr().out)["area"]
    flags = ["--tolerance", "1e-9", "--weld-tolerance", "0"]
    assert main(["measure", "heated-panel", *flags, "-o", "-"]) == 0
    fine = json.loads(capsysbinary.readouterr().out)["area"]
    assert coarse["low"] < fine["low"] < fine["high"] < coarse["high"]


def test_a_flag_that_is_wrong_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "saddle", "--tolerance", "2", "-o", "-"]) == 1
    assert "--tolerance" in capsys.readouterr().err
