"""Meshes of tubes and ribbons by tolerance: their bounds, and what they do with singular sweeps."""

from math import inf, pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from oracles.topology import count_topology, weld_by_position
from service.engine.accuracy import Accuracy
from service.engine.bounds.goal import Goal
from service.engine.options import MeshOptions
from service.engine.round_sweeps.mesher import SweepMesher
from service.engine.stored_positions import Storage
from service.errors import InvalidRequest, TooLarge
from service.surface.sweeps import RibbonSurface, TubeSurface
from tests.engine.round_sweeps.sweeps import (
    CUBIC,
    RIBBONS,
    TUBES,
    bezier,
    bspline,
    build_mesh,
    list_corners,
    measure_to_mesh,
    ribbon,
    sample,
    tube,
)
from tools.certify.sweeps import SWEEPS as SWEPT_FAMILIES
from tools.certify.sweeps import judge_sweep

SWEEPS: dict[str, TubeSurface | RibbonSurface] = {**TUBES, **RIBBONS}
each_sweep = pytest.mark.parametrize("name", SWEEPS)


@pytest.mark.slow
@each_sweep
@pytest.mark.parametrize("tolerance", [0.2, 0.01])
def test_no_point_of_a_sweep_is_further_from_the_mesh_than_the_bound(
    name: str, tolerance: float
) -> None:
    mesh = build_mesh(SWEEPS[name], tolerance)
    bound = mesh.report.deviation_bound
    assert bound is not None
    assert bound <= tolerance
    deviation = measure_to_mesh(sample(SWEEPS[name]), mesh)
    assert deviation <= bound
    assert bound <= max(8 * deviation, 1e-12)
    assert mesh.parts[0].deviation_bound == bound


@pytest.mark.slow
@each_sweep
def test_no_point_of_the_mesh_is_further_from_the_sweep_than_the_bound(name: str) -> None:
    mesh = build_mesh(SWEEPS[name], 0.05, two_sided=True)
    bound = mesh.report.mesh_deviation_bound
    assert bound is not None
    points = sample(SWEEPS[name], 300)
    shares = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [1, 1, 0], [0, 1, 1]], float)
    shares /= shares.sum(axis=1, keepdims=True)
    on_mesh = np.einsum("sk,tkd->tsd", shares, list_corners(mesh)).reshape(-1, 3)
    distances = cKDTree(points).query(on_mesh)[0]
    spacing = np.quantile(cKDTree(points).query(points, k=2)[0][:, 1], 0.999)
    # The nearest sample is at most half a step along and half a step around from the nearest point.
    step = max(4 * spacing, 2 * pi * float(np.max(_spread(name))) / 64)
    assert (distances <= np.hypot(bound, step)).all()


def _spread(name: str) -> Any:
    surface = SWEEPS[name]
    return surface.radius if isinstance(surface, TubeSurface) else surface.width


@pytest.mark.parametrize("name", TUBES)
def test_tubes_have_neither_cracks_nor_triangles_without_area(name: str) -> None:
    mesh = build_mesh(TUBES[name], 0.02)
    corners = list_corners(mesh)
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert (areas > 0).all()
    assert mesh.report.watertight is (name != "open")
    topology = count_topology(weld_by_position(mesh.positions, mesh.triangles))
    assert topology.boundary == mesh.report.boundary_edges


@given(st.data())
def test_bounds_hold_for_any_curve(data: st.DataObject) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    degree, is_spline = int(rng.integers(1, 6)), bool(rng.integers(2))
    count = degree + 1 + 3 * is_spline
    points = rng.normal(size=(count, 3)) * 10.0 ** rng.integers(-3, 4)
    weights = 4.0 ** rng.uniform(-1, 1, count) if rng.integers(2) else None
    curve: Any = bspline(points, degree, weights=weights) if is_spline else bezier(points, weights)
    size = float(np.ptp(points, axis=0).max())
    radius = size * 10.0 ** rng.uniform(-3, 0) * rng.uniform(0, 1, int(rng.integers(1, 4)))
    surface = tube(curve, radius)
    mesh = build_mesh(surface, size * 0.05)
    bound = mesh.report.deviation_bound
    assert bound is not None
    assert bound <= size * 0.05
    assert mesh.report.watertight
    assert measure_to_mesh(sample(surface, 24), mesh) <= bound


def test_a_mesh_does_not_depend_on_the_sides_of_the_tube() -> None:
    coarse, fine = (build_mesh(tube(bezier(CUBIC), 0.3, sides=k), 0.01) for k in (3, 64))
    np.testing.assert_array_equal(coarse.positions, fine.positions)
    np.testing.assert_array_equal(coarse.triangles, fine.triangles)


def test_a_straight_tube_is_a_prism_of_as_few_sides_as_possible() -> None:
    mesh = build_mesh(TUBES["cylinder"], 0.01)
    sides = int(np.ceil(pi / np.arccos(1 - 0.01 / 0.3)))
    assert mesh.report.triangles <= 4 * (sides + 1)


def test_without_a_tolerance_the_mesh_is_coarse() -> None:
    mesh = build_mesh(TUBES["cubic"], inf)
    assert mesh.report.triangles <= 60


@pytest.mark.parametrize("name", ["cubic", "knot", "stairs", "sharp"])
def test_normals_turn_by_at_most_the_angle(name: str) -> None:
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=0.3))
    mesh = SweepMesher(TUBES[name].lower(), options, Storage()).build_mesh(
        Goal(inf, angle=0.3), 10**6
    )
    assert mesh.report.normal_angle is not None
    assert mesh.report.normal_angle <= 0.315


@pytest.mark.parametrize(
    "surface",
    [
        tube(bezier([[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0]]), 0.1),  # a cusp
        ribbon(bezier([[0, 0, 0], [1, 0, 1], [2, 0, 0]]), 0.1, facing=np.array([1.0, 0, 0])),
        ribbon(bspline(CUBIC, 1), 0.1, facing=np.array([1.0, 1, 1])),
    ],
)
def test_paths_without_a_bound_are_refused(surface: Any) -> None:
    with pytest.raises(InvalidRequest) as caught:
        build_mesh(surface, 0.01)
    assert caught.value.issues[0].code == "sharp_path"


def test_too_small_a_tolerance_is_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        build_mesh(TUBES["cubic"], 1e-16)
    assert caught.value.issues[0].code == "tolerance_too_small"


def test_a_mesh_that_would_be_too_large_is_refused_before_it_is_built() -> None:
    mesher = SweepMesher(TUBES["cubic"].lower(), MeshOptions(), Storage())
    with pytest.raises(TooLarge) as caught:
        mesher.build_mesh(Goal(1e-9), 10**6)
    assert caught.value.issues[0].code == "too_many_triangles"


@pytest.mark.slow
@pytest.mark.parametrize("kind", SWEPT_FAMILIES)
@pytest.mark.parametrize("seed", range(3))
def test_families_have_no_faults(kind: str, seed: int) -> None:
    finding = judge_sweep(kind, seed, 0.03)
    assert not finding.complaints()
    assert finding.refused or finding.triangles
