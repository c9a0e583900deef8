"""The judge of sections finds nothing wrong in a good solid, and says what is wrong in others."""

import pytest

from oracles.solids import MEASURES, read_solid
from tools.judge.sections import judge_solid, main


def test_a_good_solid_has_no_faults(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["4", "cone"]) == 0
    assert capsys.readouterr().out.endswith("Nothing is wrong.\n")


def test_open_lines_and_wrong_volumes_are_faults() -> None:
    volume = MEASURES["box"]["volume"]
    verdict = judge_solid("box", read_solid("box"), 3, 1.1 * volume)
    assert [fault.partition(" is")[0] for fault in verdict.faults] == ["box: the volume"]
    document = read_solid("box")
    document["shells"] = [{"faces": [0, 1, 2, 3, 4], "closed": False}]
    document["faces"] = document["faces"][:5]
    faults = judge_solid("box", document, 3, volume).faults
    assert any("not closed" in fault for fault in faults)
