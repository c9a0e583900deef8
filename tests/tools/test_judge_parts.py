"""The judge of questions to parts runs, and finds answers that are wrong."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tools.certify.part_documents import Document
from tools.client import Client, start_client
from tools.judge.findings import Findings
from tools.judge.judged_part import JudgedPart, open_case
from tools.judge.part_cases import build_case, list_names
from tools.judge.part_closest import check_places, compare_distances, compare_signs, find_signs
from tools.judge.part_measures import compare, compare_others, judge_case
from tools.judge.part_points import judge_points
from tools.judge.part_rays import Rays, check_first, check_hits, find_missed
from tools.judge.parts import main


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings())) as client:
        yield client


@pytest.fixture(scope="module")
def box(client: Client) -> JudgedPart:
    return open_case(build_case("solid box"), client, samples=1000)


def test_nothing_is_wrong_with_two_small_parts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--quick"]) == 0
    assert capsys.readouterr().out.endswith("Nothing is wrong.\n")


def test_cases_have_families_and_groups() -> None:
    names = list_names(2)
    assert len(set(names)) == len(names)
    assert {"solid gear", "form hollow box", "thin parts 9001", "group 9000"} <= set(names)
    # Without angles that are kept there is no closed form, but a patch without trims.
    cases = [build_case(name) for name in names if name.startswith("group")]
    assert any(case.form is None and len(case.document["definitions"]) == 4 for case in cases)


def test_answers_about_the_inside_that_are_not_true_are_found(box: JudgedPart) -> None:
    class Turned:
        def ask(self, path: str, **fields: Any) -> Document:
            answer = box.ask(path, **fields)
            answer["inside"][:20] = [each is False for each in answer["inside"][:20]]
            return answer

    honest = judge_points(box, 60, 1)
    assert honest.counts["wrong"] == 0
    lying = JudgedPart(box.case, box.part, box.search, box.client)
    object.__setattr__(lying, "ask", Turned().ask)
    assert judge_points(lying, 60, 1).counts["wrong"] > 10


def test_closest_points_that_are_not_nearest_are_found(box: JudgedPart) -> None:
    """The box is 10 × 20 × 30: the nearest point of (1, 9, 14) is on the side x = 0."""
    points = np.array([[1.0, 9, 14], [-2.0, 9, 14]])
    nearest = box.search.find_nearest(points)
    answer = {
        "positions": [[0.0, 9, 14]] * 2, "distances": [1.0, 2.0], "reached": [True] * 2,
        "distance_bounds": [[1.0, 1.0], [2.0, 2.0]], "patch": nearest.faces.tolist(),
        "uv": nearest.places.tolist(), "near_edge": [False] * 2, "signs": [-1, 1],
    }  # fmt: skip
    changes: dict[str, Any] = {
        "distance_bounds": [[1.1, 1.2], [2.0, 2.0]], "distances": [1.0, 1.9],
        "positions": [[0.0, 9, 14], [0.0, 9.001, 14]], "patch": [(nearest.faces[0] + 1) % 6] * 2,
        "signs": [1, 1], "near_edge": [True, False],
    }  # fmt: skip
    for name, value in [("", None), *changes.items()]:
        findings = Findings("box", 1)
        changed = answer | ({name: value} if name else {})
        compare_distances(box, points, changed, findings)
        check_places(box, points, changed, findings)
        compare_signs(box, points, changed, findings)
        assert bool(findings.counts["wrong"]) == bool(name), name
    without_form = replace(box, case=replace(box.case, form=None))
    assert find_signs(without_form, points, 1).tolist() == [-1, 1]


def test_hits_that_are_missed_or_invented_are_found(box: JudgedPart) -> None:
    """A ray along x through the box, from x = −2: it enters at t = 2, and leaves at t = 12."""
    origins, directions = np.array([[-2.0, 9, 14]]), np.array([[1.0, 0, 0]])
    hits = box.search.find_hits(origins, directions, 1000)
    order = np.argsort(hits.t)
    assert hits.t[order].tolist() == [2.0, 12.0]
    columns: dict[str, Any] = {
        "ray": np.zeros(2, int), "t": np.array([2.0, 12]), "reached": np.array([True]),
        "t_bounds": np.array([[2.0, 2], [12.0, 12]]), "patch": hits.face[order],
        "positions": np.array([[0.0, 9, 14], [10.0, 9, 14]]), "uv": hits.places[order],
        "kind": np.array(["crossing"] * 2), "near_edge": np.zeros(2, bool),
    }  # fmt: skip
    first = {name: values[:1] for name, values in columns.items()}
    one = {name: values if name == "reached" else values[:1] for name, values in columns.items()}
    changes: dict[str, Any] = {
        "t_bounds": np.array([[2.0, 2], [11.0, 11]]), "t": np.array([2.0, 11]),
        "uv": hits.places[order[::-1]] + 1, "near_edge": np.array([True, False]),
    }  # fmt: skip
    cases = [columns, one, *({**columns, name: value} for name, value in changes.items())]
    for number, changed in enumerate(cases):
        findings = Findings("box", 1)
        rays = Rays(origins, directions, changed, np.array([30.0]))
        find_missed(box, rays, findings)
        check_hits(box, rays, findings)
        check_first(rays, first, findings)
        assert bool(findings.counts["wrong"]) == (number > 0), number


@pytest.mark.slow
def test_measures_that_are_not_true_are_found(box: JudgedPart) -> None:
    """The box has the area 2200 and the volume 6000."""
    row = judge_case("solid box")
    assert not row.faults
    assert set(row.intervals) == {"area", "volume"}

    def enclose(value: float) -> dict[str, float]:
        return {"value": value, "low": value - 1e-6, "high": value + 1e-6}

    right = {
        "area": enclose(2200), "volume": enclose(6000), "centroid": [*map(enclose, (5, 10, 15))]
    }  # fmt: skip
    assert not compare(box, right).faults
    for wrong in (
        right | {"area": enclose(2200.1)},
        right | {"volume": enclose(-6000)},
        right | {"centroid": [*map(enclose, (5, 10, 15.1))]},
        {"area": enclose(2200)},
    ):
        assert len(compare(box, wrong).faults) == 1
    values = {"area": [2200.0], "volume": [6000.1, 6000.0]}
    assert compare_others(row, {"file": values})[1:] == ([], [])
    # The judge says that the interval is right, so a value beyond it is disputed.
    _, faults, disputed = compare_others(row, {"file": values | {"area": [2200.1]}})
    assert (len(faults), len(disputed)) == (0, 1)
