"""The comparison of mesh makers: their requests, their failures, and the table."""

import sys
from pathlib import Path

import numpy as np
import pytest

from oracles.distance import Soup
from oracles.sheets import build_sheets
from service.surface.examples.catalogue import find
from service.surface.given_mesh import GivenMesh
from tools.judge_meshes.meshes import mesh_by_resolution
from tools.judge_peers import running
from tools.judge_peers.cases import Case, build_case, list_nets
from tools.judge_peers.rows import Row, judge, load, save
from tools.judge_peers.running import MAKERS, Maker, Runner
from tools.judge_peers.table import OURS, format_number, write_cell, write_section
from tools.judge_peers.wishes import (
    ask_grid_by_count,
    ask_grid_by_formula,
    ask_tolerance,
    ask_turns,
)

FAKE = """
import sys, time
from tools.judge_peers.makers.protocol import serve

def load(request):
    def mesh():
        if request["do"] == "fail":
            raise ValueError("no \\n luck")
        if request["do"] == "crash":
            raise SystemExit(3)
        while request["do"] == "wait":
            pass
        print("a message of the library")
        return [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]] if request["do"] == "mesh" else []
    return mesh

serve("fake 1.0", load)
"""
"""A maker that does what a request says."""


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runner:
    (tmp_path / "fake.py").write_text(FAKE)
    monkeypatch.setattr(running, "MAX_SECONDS", 0.2)
    monkeypatch.setattr(Runner, "command", [sys.executable, str(tmp_path / "fake.py")])
    return Runner(Maker("Fake", "fake", (), ask_tolerance, "nothing", "nothing"), tmp_path)


def test_a_maker_that_fails_crashes_or_takes_too_long_has_no_mesh_and_goes_on(
    runner: Runner,
) -> None:
    for case, do, error in (
        ("a", "fail", "no luck"),
        ("b", "crash", "the process ended with status 3"),
        ("c", "wait", running.TOO_SLOW),
        ("d", "empty", "no triangles"),
    ):
        assert runner.make(case, 1e-2, {"do": do}).error == error
    made = runner.make("e", 1e-2, {"do": "mesh"})
    assert made.error == ""
    assert made.faces is not None
    assert made.faces.tolist() == [[0, 1, 2]]
    assert runner.version == "fake 1.0"
    assert runner.make("c", 1e-3, {"do": "mesh"}).error == running.TOO_SLOW
    runner.close()


def test_meshes_that_are_kept_are_not_made_again(runner: Runner) -> None:
    runner.make("a", 1e-2, {"do": "mesh"})
    runner.close()
    again = Runner(runner.maker, runner.folder, keeps=True)
    made = again.make("a", 1e-2, {"do": "fail"})
    assert again.process is None
    assert made.faces is not None
    assert again.version == "fake 1.0"


@pytest.fixture
def saddle(tmp_path: Path) -> Case:
    return build_case("saddle", "examples", find("saddle").surface(), None, tmp_path)


def test_makers_are_asked_for_what_keeps_the_tolerance(saddle: Case) -> None:
    """A grid by the estimate is within the tolerance; a chord of a circle is at it."""
    tolerance = 1e-3 * saddle.diagonal
    grid = ask_grid_by_formula(saddle, tolerance, 0)
    assert grid is not None
    mesh = mesh_by_resolution(saddle.surface, grid.fields["divisions"])
    (sheet,) = build_sheets(saddle.surface)
    points = sheet.at(sheet.samples(2000)) + sheet.origin
    assert 0.5 * tolerance < Soup(mesh.corners).farthest(points)[1] <= tolerance
    turns = ask_turns(saddle, tolerance, 0)
    assert turns is not None
    n, radius = turns.fields["elements"], saddle.diagonal / 2
    assert radius * (1 - np.cos(np.pi / n)) <= tolerance < radius * (1 - np.cos(np.pi / (n - 1)))
    count = ask_grid_by_count(saddle, tolerance, 200)
    assert count is not None
    assert count.fields["divisions"] == 10


def test_surfaces_without_nets_or_without_a_file_are_not_asked_for(tmp_path: Path) -> None:
    assert list_nets(find("gear").surface()) == []
    assert list_nets(find("monkey-saddle").surface()) == []
    assert len(list_nets(find("utah-teapot").surface())) == 32
    tube = build_case("tube", "examples", find("trefoil-tube").surface(), None, tmp_path)
    assert [maker.ask(tube, 1.0, 100) for maker in MAKERS] == [None] * len(MAKERS)


def test_a_mesh_is_judged_in_multiples_of_the_tolerance() -> None:
    """A flat mesh of the saddle z = x² − y²: its middle and its corners are as far as 1."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    mesh = GivenMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    found = judge(find("saddle").surface(), np.array(mesh.positions), np.array(mesh.triangles), 0.5)
    low, high = found["to_mesh"]
    assert low <= 2 <= high
    assert found["open_edges"] == 4


def _build_rows() -> list[Row]:
    return [
        Row(
            "box", "parts", True, OURS, 1e-2, "the tolerance", triangles=10, seconds=0.1,
            to_mesh=(0.8, 0.9), to_surface=(1.4, 1.5),
        ),
        Row(
            "box", "parts", True, "arris", 1e-2, "", triangles=40, seconds=0.2,
            to_mesh=(1.5, 1.6), to_surface=(0.2, 0.3), open_edges=7,
        ),
        Row("box", "parts", True, "gmsh", 1e-2, "", error="more | than 10 s"),
    ]  # fmt: skip


def test_the_section_has_a_line_for_each_maker_and_each_surface(tmp_path: Path) -> None:
    rows, versions = _build_rows(), {OURS: "1", "arris": "arris 0", "gmsh": "gmsh 4"}
    text = write_section(rows, versions)
    assert "| arris | 1 | 0 | 1.6, 1.6 | 1 | 0.3, 0.3 | 1 of 1 | 0 | × 4 | × 2 |" in text
    assert "| box | 1.5 (10) | 1.6 (40), torn 7 | none: more / than 10 s |" in text
    save(rows, versions, tmp_path / "rows.json")
    assert load(tmp_path / "rows.json") == (rows, versions)


def test_numbers_and_cells() -> None:
    assert [format_number(x) for x in (0.0123, 0.96, 9.949, 9.96, 1234.5, float("inf"))] == [
        *("0.012", "0.96", "9.9", "10", "1234", "∞"),
    ]  # fmt: skip
    assert write_cell(_build_rows()[0]) == "1.5 (10)"
