"""The judge's answers hold for meshes of all kinds, and find planted faults."""

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from service.engine.mesh_checks.query import CheckQuery
from service.surface.examples.catalogue import find
from tools.judge_meshes.__main__ import judge_case
from tools.judge_meshes.cases import Case, find_truth, list_cases
from tools.judge_meshes.compare import check, find_faults
from tools.judge_meshes.faults import FAULTS, list_surfaces, try_fault
from tools.judge_meshes.meshes import CHANGES, mesh_by_tolerance

QUERY = CheckQuery()


def test_there_are_more_than_a_thousand_meshes_of_all_kinds() -> None:
    cases = list(list_cases())
    assert len(cases) > 1000
    assert len(set(cases)) == len(cases)
    assert {case.kind for case in cases} == {"surfaces", "parts", "sweeps", "groups", "examples"}


def _shift(name: str, field: str, factor: float) -> Any:
    def change(answer: dict[str, Any]) -> None:
        answer[name][field] *= factor

    return change


def _move(name: str) -> Any:
    def change(answer: dict[str, Any]) -> None:
        answer[name]["point"][2] += 0.01

    return change


def _count(name: str) -> Any:
    def change(answer: dict[str, Any]) -> None:
        answer[name] += 1

    return change


def _point_elsewhere(answer: dict[str, Any]) -> None:
    answer["surface_to_mesh"]["triangle"] += 1


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (_shift("surface_to_mesh", "high", 0.9), "surface to mesh: sampled"),
        (_shift("mesh_to_surface", "high", 0.9), "mesh to surface: sampled"),
        (_shift("surface_to_mesh", "low", 1.04), "surface to mesh: "),
        (_shift("mesh_to_surface", "low", 1.04), "mesh to surface: "),
        (_shift("surface_to_mesh", "high", 1.4), "wider than asked"),
        (_move("surface_to_mesh"), "from the surface"),
        (_move("mesh_to_surface"), "from its triangle"),
        (_point_elsewhere, "the nearest"),
        (_count("open_edges"), "open_edges"),
        (_count("flipped_edges"), "flipped_edges"),
        (_count("non_manifold_edges"), "non_manifold_edges"),
    ],
)
def test_wrong_answers_are_seen(change: Any, fault: str) -> None:
    surface = find("saddle").surface()
    mesh = mesh_by_tolerance(surface, 1e-2)
    answer, truth = check(surface, mesh, QUERY), find_truth(surface)
    assert list(find_faults(answer, mesh, truth, QUERY)) == []
    wrong = deepcopy(answer)
    change(wrong)
    assert any(fault in text for text in find_faults(wrong, mesh, truth, QUERY))


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_meshes_are_meshes_of_other_triangles(name: str) -> None:
    mesh = mesh_by_tolerance(find("sphere").surface(), 1e-2)
    changed = CHANGES[name](mesh, np.random.default_rng(1))
    assert len(changed.triangles)
    assert not np.array_equal(changed.corners, mesh.corners)


@pytest.mark.parametrize(
    "case",
    [
        Case("surfaces", "rational", 9001, 2),
        Case("surfaces", "triangles", 9000, 4),
        Case("parts", "cut cylinders", 9000, 0),
        pytest.param(Case("sweeps", "tubes", 9001, 0), marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_intervals_hold_against_dense_samples(case: Case) -> None:
    assert judge_case(case).faults == ()


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4))
def test_intervals_of_more_meshes_hold(first: int) -> None:
    """`make judge-meshes` judges all of them."""
    cases = list(list_cases())[7 * first :: 211]
    assert [finding for case in cases for finding in judge_case(case).faults] == []


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found(name: str) -> None:
    for seed, case in enumerate(list_surfaces()[:2]):
        assert try_fault(case, name, seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(3))
def test_planted_faults_are_found_on_more_surfaces(first: int) -> None:
    """`make judge-meshes` plants 200."""
    cases, names = list_surfaces(), list(FAULTS)
    for seed in range(32 * first, 32 * first + 8):
        case, name = cases[seed // len(names) % len(cases)], names[seed % len(names)]
        assert try_fault(case, name, seed) == [], (case, name, seed)
