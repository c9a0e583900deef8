"""The predicted memory is at least the memory that NumPy and Python use; for meshes of some
megabytes, at most three times that."""

from contextlib import suppress
from itertools import islice

import numpy as np
import pytest

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.closest.project import ProjectQuery
from service.engine.connectivity.connect import connect
from service.engine.measures.values import BudgetEnded, MeasureQuery
from service.engine.options import MeshOptions
from service.engine.plans.layout import Layout
from service.engine.points.places import PointsQuery
from service.engine.rays.intersect import RayQuery
from service.errors import TooLarge
from service.pipeline.cost import MEMORY_SHARE, Work, lowering_memory
from service.pipeline.documents import plan_definition
from service.pipeline.limits import Limits
from service.pipeline.measure import plan_measure, plan_trials
from service.pipeline.mesh import plan_mesh
from service.pipeline.queries import plan_intersect, plan_points, plan_project
from service.storage.canonical import plan_content
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sizes import SurfaceKind
from tools.memory import measure_memory

MAX_RATIO = 3
"""The largest ratio of predicted to used memory for a mesh of some megabytes."""


def build_hills(count: int, *, is_rational: bool = False) -> BsplineSurface:
    """A random cubic B-spline of `count` × `count` control points."""
    random = np.random.default_rng(3)
    net = random.normal(size=(count, count, 3))
    weights = random.uniform(1, 2, (count, count)) if is_rational else None
    return BsplineSurface(net, weights=weights)


TEAPOT, TORUS = find("utah-teapot").surface(), find("torus").surface()
FINE = MeshOptions(resolution=(32, 32))
CASES: dict[str, tuple[SurfaceKind, MeshOptions, EncodeOptions, str]] = {
    **{fmt.name: (TEAPOT, FINE, EncodeOptions(), fmt.name) for fmt in FORMATS},
    "quantized": (TEAPOT, FINE, EncodeOptions(quantize=True), "glb"),
    "patches": (build_hills(40), MeshOptions(resolution=(1, 1)), EncodeOptions(), "glb"),
    "stitched": (
        build_hills(20, is_rational=True), MeshOptions(resolution=(1, 5)), EncodeOptions(), "json",
    ),
    "group": (find("tea-service").surface(), MeshOptions((8, 8)), EncodeOptions(), "stl"),
    "curved": (TORUS, MeshOptions((20, 20), curvatures=True), EncodeOptions(), "ply"),
    # With one division along u, the mesh must remove faces with two equal vertices.
    "folded": (TORUS, MeshOptions((1, 200)), EncodeOptions(), "glb"),
    "exact": (build_hills(40), MeshOptions(), EncodeOptions(oogl="bez"), "oogl"),
    "de Casteljau": (
        BezierSurface(np.random.default_rng(5).normal(size=(24, 24, 3))),
        MeshOptions((40, 40), method="de_casteljau"),
        EncodeOptions(),
        "glb",
    ),
    "tolerance": (
        TEAPOT,
        MeshOptions(accuracy=Accuracy(relative_tolerance=0.003)),
        EncodeOptions(),
        "glb",
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_mesh_uses_no_more_memory_than_predicted(name: str) -> None:
    surface, options, encode, fmt = CASES[name]
    plan = plan_mesh(surface, options, BY_NAME[fmt], encode)
    plan.run()  # fills the caches of bases and plans, which are not part of the cost
    memory = measure_memory(plan.run)
    assert memory <= plan.cost.memory
    # Predictions for small meshes and for meshes by tolerance may be larger.
    if memory > 8e6 and options.accuracy is None:
        assert plan.cost.memory <= MAX_RATIO * memory


@pytest.mark.parametrize("surface", [build_hills(60), build_hills(40, is_rational=True)])
def test_lowering_uses_no_more_memory_than_predicted(surface: BsplineSurface) -> None:
    """The prediction includes the search for shared edges, and a layout of few divisions."""
    memory = measure_memory(lambda: Layout.plan(connect(surface.lower()).connectivity, (1, 2)))
    assert memory <= lowering_memory(surface.size()) <= MAX_RATIO * memory


FOLDED = np.array([[[0, 0, 0], [1, 0, 0]], [[1, 0.1, 0], [2, 1.1, 0]]])
"""A net whose area needs very many cells: the length of du × dv has a kink."""
MEASURED: dict[str, SurfaceKind] = {
    "folded": BezierSurface(FOLDED, np.array([[1, 2], [1.5, 3]])),
    "goblet": find("nurbs-goblet").surface(),
    "triangle": TriangleSurface(np.random.default_rng(4).normal(size=(10, 3))),
    "part": find("crossed-holes").surface(),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURED)
def test_measures_use_no_more_memory_than_predicted_in_every_trial(name: str) -> None:
    """The first trials measure with few cells; most of them end without a result."""
    for plan in islice(plan_trials(MEASURED[name], MeasureQuery(1e-6)), 3):

        def run(plan: Work[bytes] = plan) -> None:
            with suppress(BudgetEnded):
                plan.run()

        assert measure_memory(run) <= plan.cost.memory


@pytest.mark.parametrize("name", ["saddle", "cone", "ship-hull"])
def test_a_trial_that_ends_with_a_result_has_the_result_of_the_whole_budget(name: str) -> None:
    surface = find(name).surface()
    for plan in plan_trials(surface, MeasureQuery(1e-6)):
        try:
            result = plan.run()
        except BudgetEnded:
            continue
        assert result == plan_measure(surface, MeasureQuery(1e-6)).run()
        break
    # The saddle, one patch, is measured in the first trial, which takes little memory.
    if name == "saddle":
        assert plan.cost.memory < 16e6


def test_questions_to_many_copies_use_no_more_memory_than_predicted() -> None:
    """Closest points and rays place every copy; points place only the patches that are asked."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 8), indexing="ij")
    patch = BezierSurface(np.stack([x, y, x * y], axis=-1))
    matrices = np.tile(np.eye(4), (500, 1, 1))
    matrices[:, :3, 3] = 30 * rng.normal(size=(500, 3))
    group = GroupSurface(tuple(Member(patch, matrix=matrix) for matrix in matrices))
    ends = rng.normal(size=(2, 1, 3))
    places = PointsQuery(rng.random((400, 2)), rng.integers(0, 500, 400), 0)
    for plan in (
        plan_project(group, ProjectQuery(ends[0])),
        plan_intersect(group, RayQuery(*ends)),
        plan_points(group, places),
    ):
        assert measure_memory(plan.run) <= plan.cost.memory < 20e6


def test_documents_of_copies_use_no_more_memory_than_predicted() -> None:
    """A document has each member of a group, also if the members are equal."""
    group = GroupSurface((Member(build_hills(40)),) * 20)
    for plan in (plan_definition(group), plan_content(group)):
        assert measure_memory(plan.run) <= plan.cost.memory


def test_large_meshes_are_refused_before_the_work_or_if_by_tolerance_during_it() -> None:
    surface = TEAPOT
    plan = plan_mesh(surface, FINE, BY_NAME["glb"])
    plan_mesh(surface, FINE, BY_NAME["glb"], limits=Limits(max_memory=plan.cost.memory))
    with pytest.raises(TooLarge) as refused:
        plan_mesh(surface, FINE, BY_NAME["glb"], limits=Limits(max_memory=plan.cost.memory - 1))
    assert [issue.code for issue in refused.value.issues] == ["too_much_memory"]
    # The plan of a mesh by tolerance reserves a share of the limit; here the mesh needs more.
    options, limits = (
        MeshOptions(accuracy=Accuracy(relative_tolerance=0.0001)),
        Limits(max_memory=60_000_000),
    )
    plan = plan_mesh(surface, options, BY_NAME["glb"], limits=limits)
    assert plan.cost.memory <= limits.max_memory // MEMORY_SHARE
    with pytest.raises(TooLarge) as refused:
        plan.run()
    assert refused.value.issues[0].code == "too_much_memory"
    assert refused.value.issues[0].pointer == "/relative_tolerance"


@pytest.mark.parametrize("options", [
    MeshOptions(resolution=(1, 1)), MeshOptions(accuracy=Accuracy(relative_tolerance=0.5)),
])  # fmt: skip
def test_a_surface_that_is_accepted_can_be_meshed_within_the_memory(options: MeshOptions) -> None:
    """If the limit is too small for the coarsest mesh, the surface is refused before lowering."""
    x, y = np.meshgrid(np.arange(80.0), np.arange(60.0), indexing="ij")
    surface = BsplineSurface(np.stack([x, y, np.sin(x / 9)], axis=-1))
    coarsest_memory = plan_mesh(surface, MeshOptions((1, 1)), BY_NAME["glb"]).cost.memory
    refused_shares = []
    for share in (0.2, 0.6, 0.8, 1.0, 1.2, 1.6, 2.4, 4.0):
        limits = Limits(max_memory=int(coarsest_memory * share))
        try:
            plan = plan_mesh(surface, options, BY_NAME["glb"], limits=limits)
        except TooLarge:
            refused_shares.append(share)
        else:
            assert plan.cost.memory <= limits.max_memory
            plan.run()
    assert refused_shares
    # The refusals are not too cautious: 2.4 times the memory of the coarsest mesh is enough.
    assert max(refused_shares) < 2.4


def test_too_many_patches_are_refused_before_they_are_computed() -> None:
    with pytest.raises(TooLarge) as refused:
        plan_mesh(build_hills(40), FINE, BY_NAME["glb"], limits=Limits(max_patches=37 * 37 - 1))
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer, issue.got) == (
        "too_many_patches",
        "/surface",
        "1369 patches",
    )
