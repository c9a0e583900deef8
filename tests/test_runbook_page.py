"""The figures of docs/runbook.md are those of the service, within the margins of the page."""

import re
import sys

import pytest

from tools.benchmarks.operation import measure_figures
from tools.processes import ROOT

PAGE = (ROOT / "docs" / "runbook.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (.+) \| ([\d.]+) (MB|s|ms) \|$", re.MULTILINE)
MAX_RATIOS = {"MB": 1.3, "s": 3.0, "ms": 3.0}
"""The largest ratio of a measured figure to that of the page, or the other way round."""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_figures_of_the_runbook_are_measured() -> None:
    assert "memory may\ndiffer by 30 %, processor time by a factor of 3" in PAGE
    rows = {text: (float(value), unit) for text, value, unit in ROW.findall(PAGE)}
    figures = {figure.text: figure for figure in measure_figures(share=0.25)}
    assert rows.keys() == figures.keys()
    for text, (value, unit) in rows.items():
        figure = figures[text]
        assert figure.unit == unit
        ratio = figure.value / value
        assert 1 / MAX_RATIOS[unit] <= ratio <= MAX_RATIOS[unit], (
            f"{text}: {figure.value:.3g} {unit}"
        )
