"""Meshes by a budget: the smallest deviation with at most N triangles or N bytes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from service.encoders.registry import FORMATS
from service.engine.accuracy import Accuracy
from service.engine.adaptive.limits import Effort
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline import adaptive
from service.pipeline.limits import Limits
from service.pipeline.mesh import MeshFile, plan_mesh
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import EXAMPLES

FORMAT = {fmt.name: fmt for fmt in FORMATS}


def render_within(example: str, accuracy: Accuracy, name: str = "glb") -> MeshFile:
    """The file of a built-in surface with this accuracy, in the format with this name."""
    return plan_mesh(
        EXAMPLES[example].surface(), MeshOptions(accuracy=accuracy), FORMAT[name]
    ).run()


def get_deviation_bound(response: MeshFile) -> float:
    """The deviation bound in the report of a mesh, which must have one."""
    assert response.report is not None
    assert response.report.deviation_bound is not None
    return response.report.deviation_bound


@pytest.mark.parametrize(
    ("example", "budget"), [("utah-teapot", 900), ("sphere", 300), ("tea-service", 1500)]
)
def test_a_mesh_uses_between_80_and_100_percent_of_its_triangles(example: str, budget: int) -> None:
    result = render_within(example, Accuracy(max_triangles=budget))
    assert result.report is not None
    assert 0.8 * budget < result.report.triangles <= budget


def test_a_mesh_by_a_smaller_tolerance_needs_more_triangles_than_the_budget() -> None:
    budget = 400
    bound = get_deviation_bound(render_within("saddle", Accuracy(max_triangles=budget)))
    for factor in (0.98, 0.9, 0.7):
        finer_file = render_within("saddle", Accuracy(tolerance=bound * factor))
        assert finer_file.report is not None
        assert finer_file.report.triangles > budget


@pytest.mark.slow
@pytest.mark.parametrize("name", ["glb", "stl", "obj", "json"])
def test_a_file_uses_between_80_and_100_percent_of_its_bytes(name: str) -> None:
    budget = 60_000
    result = render_within("saddle", Accuracy(max_bytes=budget), name)
    assert 0.8 * budget < len(result.content) <= budget


def test_a_mesh_with_two_budgets_keeps_to_both() -> None:
    by_triangles = render_within("saddle", Accuracy(max_triangles=100, max_bytes=60_000))
    assert by_triangles.report is not None
    assert by_triangles.report.triangles <= 100
    by_bytes = render_within("saddle", Accuracy(max_triangles=10_000, max_bytes=6_000))
    assert len(by_bytes.content) <= 6_000


@pytest.mark.parametrize("option", ["max_triangles", "max_bytes"])
def test_the_issue_names_the_least_budget_that_is_accepted(option: str) -> None:
    def build_accuracy(budget: int) -> Accuracy:
        if option == "max_bytes":
            return Accuracy(max_bytes=budget)
        return Accuracy(max_triangles=budget)

    with pytest.raises(InvalidRequest) as refused:
        render_within("utah-teapot", build_accuracy(1))
    (issue,) = refused.value.issues
    assert issue.got == f"1 {option.removeprefix('max_').removesuffix('s')}"
    assert (issue.code, issue.pointer) == ("budget_too_small", f"/{option}")
    numbers = re.search(r"\d+", issue.needed or "")
    assert numbers is not None
    least_budget = int(numbers.group())
    result = render_within("utah-teapot", build_accuracy(least_budget))
    assert result.report is not None
    assert (
        result.report.triangles if option == "max_triangles" else len(result.content)
    ) == least_budget
    with pytest.raises(InvalidRequest):
        render_within("utah-teapot", build_accuracy(least_budget - 1))


def test_a_flat_surface_has_two_triangles_with_any_budget() -> None:
    """More triangles would not reduce the deviation."""
    plane = BezierSurface(np.array([[[0.0, 0, 0], [0, 2, 1]], [[1, 0, 0], [1, 2, 1]]]))
    options = MeshOptions(accuracy=Accuracy(max_triangles=100_000))
    report = plan_mesh(plane, options, FORMAT["json"]).run().report
    assert report is not None
    assert report.triangles == 2


def test_the_same_budget_gives_the_same_bytes() -> None:
    accuracy = Accuracy(max_triangles=700)
    assert render_within("torus", accuracy).content == render_within("torus", accuracy).content


@pytest.mark.slow
@pytest.mark.parametrize("example", ["trefoil-tube", "ribbon", "hair"])
def test_a_budget_for_a_sweep_is_used_up(example: str) -> None:
    bounds = []
    for most in (1000, 4000):
        report = render_within(example, Accuracy(max_triangles=most)).report
        assert report is not None
        assert most / 4 < report.triangles <= most
        bounds.append(report.deviation_bound or 0.0)
    assert bounds[0] > 2 * bounds[1] > 0


@pytest.mark.parametrize("budget", [Accuracy(max_triangles=500), Accuracy(max_bytes=30_000)])
def test_a_budget_can_bound_the_deviation_in_both_directions(budget: Accuracy) -> None:
    report = render_within("saddle", replace(budget, two_sided=True)).report
    assert report is not None
    assert report.deviation_bound is not None
    assert report.mesh_deviation_bound is not None
    assert report.mesh_deviation_bound < 0.1


def test_a_search_ends_when_the_work_of_a_request_is_spent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a very large budget, the result is the best mesh before the limit of work is reached."""
    efforts: list[Effort] = []

    def record_effort(limit: float) -> Effort:
        efforts.append(Effort(limit))
        return efforts[-1]

    monkeypatch.setattr(adaptive, "Effort", record_effort)
    surface, accuracy = EXAMPLES["saddle"].surface(), Accuracy(max_triangles=1_000_000)
    limits = Limits(max_multiplications=50_000_000)
    options = MeshOptions(accuracy=accuracy)
    report = plan_mesh(surface, options, FORMAT["json"], limits=limits).run().report
    assert report is not None
    # This work suffices for about 4000 triangles.
    assert 300 < report.triangles < 5000
    # A mesh may take a third of the limit. Its triangles are counted only when it is complete, so
    # the last mesh may exceed the limit a little.
    assert max(effort.limit for effort in efforts) == 1e8
    assert 3e7 < max(effort.spent for effort in efforts) < 1.2e8
