"""The judge of CAD files finds what is wrong, and nothing else."""

import os
import signal
import time
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from tools.cad_files.apart import call_apart
from tools.cad_files.judge import find_faults, judge
from tools.processes import ROOT

FILE = ROOT / "tests" / "cad_files" / "faceted_cm.step"

TRUTH: dict[str, Any] = {
    "faces": 4,
    "volumes": [1e6 / 6],
    "metres_per_unit": 0.01,
    "instances": 1,
    "names": ["tetrahedron"],
    "box": [[0, 0, 0], [100, 100, 100]],
}


judge_file = cache(partial(judge, str(FILE)))


def test_a_file_that_is_read_rightly_has_no_faults() -> None:
    assert list(find_faults(judge_file(), TRUTH)) == []


@pytest.mark.parametrize(
    "change",
    [
        {"faces": 5},
        {"volumes": [1e6 / 6 * 1.001]},
        {"metres_per_unit": 0.001},
        {"instances": 2},
        {"names": ["cube"]},
        {"colors": [[1, 0, 0]]},
        {"box": [[0, 0, 0], [100, 100, 99]]},
    ],
)
def test_each_difference_is_a_fault(change: dict[str, Any]) -> None:
    assert len(list(find_faults(judge_file(), TRUTH | change))) == 1


def test_a_refusal_is_a_fault_if_the_file_has_faces(tmp_path: Path) -> None:
    file = tmp_path / "empty.step"
    file.write_bytes(FILE.read_bytes().replace(b"FACETED_BREP", b"NOTHING"))
    result = judge(str(file))
    assert len(list(find_faults(result, TRUTH))) == 1
    assert list(find_faults(result, {"faces": 0})) == []


def fail(path: str) -> dict[str, Any]:
    match path:
        case "raise":
            raise ValueError("a fault of the reader")
        case "hang":
            time.sleep(30)
        case "crash":
            os.kill(os.getpid(), signal.SIGKILL)
    return {"path": path}


@pytest.mark.parametrize(
    ("path", "reason"),
    [("raise", "ValueError"), ("hang", "status 14"), ("crash", f"status {int(signal.SIGKILL)}")],
)
def test_crashes_and_hangs_are_results(path: str, reason: str) -> None:
    assert reason in call_apart(fail, path, 1)["fault"]
    assert call_apart(fail, "good", 1) == {"path": "good"}
