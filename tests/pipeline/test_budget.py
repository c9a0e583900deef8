"""Meshes by a budget: the nearest with a number of triangles or bytes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from service.encoders.registry import FORMATS
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.adaptive import AdaptiveMesher, search_budget
from service.pipeline.mesh import MeshFile, plan_mesh
from service.surface.bezier import BezierSurface
from service.surface.examples import EXAMPLES

FORMAT = {fmt.name: fmt for fmt in FORMATS}


def render_within(example: str, accuracy: Accuracy, name: str = "glb") -> MeshFile:
    return plan_mesh(
        EXAMPLES[example].surface(), MeshOptions(accuracy=accuracy), FORMAT[name]
    ).run()


def bound_of(response: MeshFile) -> float:
    assert response.report is not None
    assert response.report.deviation_bound is not None
    return response.report.deviation_bound


@pytest.mark.parametrize(
    ("example", "most"), [("utah-teapot", 900), ("sphere", 300), ("tea-service", 1500)]
)
def test_the_mesh_keeps_to_its_triangles_and_uses_most_of_them(example: str, most: int) -> None:
    result = render_within(example, Accuracy(max_triangles=most))
    assert result.report is not None
    assert 0.8 * most < result.report.triangles <= most


def test_no_mesh_by_tolerance_is_nearer_with_as_many_triangles() -> None:
    most = 400
    result = bound_of(render_within("saddle", Accuracy(max_triangles=most)))
    for factor in (0.98, 0.9, 0.7):
        other = render_within("saddle", Accuracy(tolerance=result * factor))
        assert other.report is not None
        assert other.report.triangles > most


@pytest.mark.parametrize("name", ["glb", "stl", "obj", "json"])
def test_the_file_keeps_to_its_bytes(name: str) -> None:
    most = 60_000
    result = render_within("saddle", Accuracy(max_bytes=most), name)
    assert 0.8 * most < len(result.content) <= most


def test_of_two_budgets_both_are_kept() -> None:
    few = render_within("saddle", Accuracy(max_triangles=100, max_bytes=60_000))
    assert few.report is not None
    assert few.report.triangles <= 100
    small = render_within("saddle", Accuracy(max_triangles=10_000, max_bytes=6_000))
    assert len(small.content) <= 6_000


@pytest.mark.parametrize("option", ["max_triangles", "max_bytes"])
def test_the_issue_names_the_least_budget_that_is_enough(option: str) -> None:
    def limit_triangles(most: int) -> Accuracy:
        if option == "max_bytes":
            return Accuracy(max_bytes=most)
        return Accuracy(max_triangles=most)

    with pytest.raises(InvalidRequest) as refused:
        render_within("utah-teapot", limit_triangles(1))
    (issue,) = refused.value.issues
    assert issue.got == f"1 {option.removeprefix('max_').removesuffix('s')}"
    assert (issue.code, issue.pointer) == ("budget_too_small", f"/{option}")
    numbers = re.search(r"\d+", issue.needed or "")
    assert numbers is not None
    least = int(numbers.group())
    result = render_within("utah-teapot", limit_triangles(least))
    assert result.report is not None
    assert (result.report.triangles if option == "max_triangles" else len(result.content)) == least
    with pytest.raises(InvalidRequest):
        render_within("utah-teapot", limit_triangles(least - 1))


def test_a_flat_surface_is_met_by_its_fewest_triangles() -> None:
    """More triangles would not make the deviation less."""
    plane = BezierSurface(np.array([[[0.0, 0, 0], [0, 2, 1]], [[1, 0, 0], [1, 2, 1]]]))
    options = MeshOptions(accuracy=Accuracy(max_triangles=100_000))
    report = plan_mesh(plane, options, FORMAT["json"]).run().report
    assert report is not None
    assert report.triangles == 2


def test_the_same_budget_gives_the_same_bytes() -> None:
    accuracy = Accuracy(max_triangles=700)
    assert render_within("torus", accuracy).content == render_within("torus", accuracy).content


def test_sweeps_have_no_budget() -> None:
    with pytest.raises(InvalidRequest) as refused:
        render_within("trefoil-tube", Accuracy(max_triangles=1000))
    assert refused.value.issues[0].code == "not_parametric"
    assert refused.value.issues[0].pointer == "/max_triangles"


@pytest.mark.parametrize("budget", [Accuracy(max_triangles=500), Accuracy(max_bytes=30_000)])
def test_a_budget_may_be_bounded_from_both_sides(budget: Accuracy) -> None:
    report = render_within("saddle", replace(budget, two_sided=True)).report
    assert report is not None
    assert report.deviation_bound is not None
    assert report.mesh_deviation_bound is not None
    assert report.mesh_deviation_bound < 0.1


def test_a_search_takes_at_most_the_work_of_a_request() -> None:
    """With a very large budget, the result is the nearest mesh that the work allows."""
    fmt, accuracy = FORMAT["json"], Accuracy(max_triangles=1_000_000)
    effort = Effort(limit=1e8)
    work = plan_mesh(EXAMPLES["saddle"].surface(), MeshOptions(accuracy=accuracy), fmt)
    build = AdaptiveMesher(work, *work.lower(), effort).build
    built, _ = search_budget(build, work.encode_mesh, accuracy, 1e-12, effort)
    assert 300 < built.report.triangles < 5000
    # A mesh that is begun before the work runs out is completed; no other is begun.
    assert 3e7 < effort.spent < 1.2e8
