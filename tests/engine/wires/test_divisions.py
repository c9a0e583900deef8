"""Isoparametric curves in meshes by tolerance: deviation, quantization and limits."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy, Camera
from service.engine.bounds.goal import Goal, View
from service.engine.connectivity.seams import find_seams
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.wires.divisions import count_goal_divisions
from service.engine.wires.draw import NAME
from service.engine.wires.isocurves import sample_divided_isocurves, sample_isocurves
from service.errors import TooLarge
from service.pipeline.limits import Limits
from service.pipeline.mesh import build_planned, plan_mesh
from service.pipeline.mesh_plan import build_plan
from service.surface.batches import TrianglePatches
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import build_mesh
from tests.strategies import Array, build_model, nets, triangle_nets, weighted_nets

COUNTS = (3, 2)
FINE = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-3), isocurves=COUNTS)


def measure_distances(points: Array, a: Array, b: Array) -> Array:
    """Distances of points (n, 3) to the nearest of the segments from a to b (m, 3)."""
    segment, offset = b - a, points[:, None] - a
    squared_length = np.maximum((segment * segment).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((offset * segment).sum(axis=2) / squared_length, 0, 1)
    distances: Array = np.linalg.norm(offset - share[..., None] * segment, axis=2).min(axis=1)
    return distances


def measure_deviation(model: PatchModel, goal: Goal) -> float:
    """The largest distance of points of the isoparametric curves from the lines of the mesh.

    Also checks that the predicted numbers of curves and samples are not exceeded.
    """
    seams = find_seams(model.batches)
    divisions = count_goal_divisions(model, seams, goal)
    lines = sample_divided_isocurves(model, seams, divisions, COUNTS)
    curves, samples = divisions.count_curves(seams, COUNTS)
    assert sum(len(run.points) for run in lines) <= curves
    assert sum(run.points[..., 0].size for run in lines) <= samples
    dense_points = [run.points.reshape(-1, 3) for run in sample_isocurves(model, (33, 33), COUNTS)]
    if not lines:  # all curves are points, which are not drawn
        assert not dense_points
        return 0.0
    a = np.concatenate([run.points[:, :-1].reshape(-1, 3) for run in lines])
    b = np.concatenate([run.points[:, 1:].reshape(-1, 3) for run in lines])
    return max(float(measure_distances(points, a, b).max()) for points in dense_points)


@given(weighted_nets(nets(limit=4)))
def test_lines_are_within_the_tolerance_of_their_curves(
    net_and_weights: tuple[Array, Array | None],
) -> None:
    net, weights = net_and_weights
    model = build_model([net], None if weights is None else [weights])
    assert measure_deviation(model, Goal(0.02)) <= 0.02


@settings(max_examples=10)
@given(triangle_nets())
def test_lines_on_a_triangle_are_within_the_tolerance(net: Array) -> None:
    batch = TrianglePatches(net[np.newaxis])
    model = PatchModel("one", (batch,), (Part("one", 0, 1),))
    assert measure_deviation(model, Goal(0.02)) <= 0.02


def test_finer_goals_and_nearer_eyes_need_more_samples() -> None:
    model = find("utah-teapot").surface().lower()
    assert isinstance(model, PatchModel)
    seams = find_seams(model.batches)

    def count_samples(goal: Goal) -> int:
        _, samples = count_goal_divisions(model, seams, goal).count_curves(seams, COUNTS)
        return samples

    fine, coarse = count_samples(Goal(1e-3)), count_samples(Goal(1e-2))
    with_angle = count_samples(Goal(1e-3, angle=0.05))
    assert coarse < fine < with_angle
    # The eye is at z = `height`; the allowed deviation is 1/1000 of the distance from it.
    far, near = (
        count_samples(Goal(1.0, view=View(np.array([0, 0, height]), rate=1e-3, near=1.0)))
        for height in (1e3, 10.0)
    )
    assert far < near


@pytest.mark.parametrize(
    ("name", "wires"),
    [("torus", "tubes"), ("octahedral-sphere", "ribbons"), ("tea-service", "lines")],
)
@pytest.mark.parametrize("has_faces", [True, False])
def test_lines_tubes_and_ribbons_are_drawn_with_and_without_faces(
    name: str, wires: Any, has_faces: bool
) -> None:
    """Only a mesh with faces of the surface has a bound of deviation."""
    mesh = build_mesh(
        name, accuracy=FINE.accuracy, isocurves=(2, 2), wires=wires, has_faces=has_faces
    )
    if wires == "lines":
        assert len(mesh.overlays[-1].segments) > 50
    else:
        assert len(mesh.triangles) > 1000
    assert bool(mesh.report.deviation_bound) == has_faces


@pytest.mark.parametrize("wires", ["lines", "tubes"])
def test_wires_lie_on_the_grid_of_a_compact_file(wires: Any) -> None:
    options = MeshOptions(accuracy=FINE.accuracy, isocurves=(2, 2), wires=wires)
    surface = find("torus").surface()
    request = (surface, options, BY_NAME["glb"], EncodeOptions(quantize=True))
    mesh = build_planned(build_plan(*request), surface.lower(), options)
    assert isinstance(mesh, Mesh)
    assert mesh.step
    rows = np.concatenate([mesh.positions, *(overlay.positions for overlay in mesh.overlays)])
    assert (rows / mesh.step == np.rint(rows / mesh.step)).all()
    assert plan_mesh(*request).run().content  # such a mesh can be encoded


@pytest.mark.parametrize("wires", ["lines", "tubes"])
@pytest.mark.parametrize("accuracy", [FINE.accuracy, Accuracy(max_triangles=400)])
def test_wires_above_the_limit_of_triangles_are_refused(wires: Any, accuracy: Accuracy) -> None:
    """The limit of triangles is twice that of vertices."""
    options = MeshOptions(accuracy=accuracy, isocurves=(900, 900), wires=wires)
    surface = find("torus").surface()
    with pytest.raises(TooLarge) as refused:
        plan_mesh(surface, options, BY_NAME["glb"], limits=Limits(max_vertices=10_000)).run()
    assert refused.value.issues[0].code == "too_many_triangles"


def test_every_copy_has_wires_with_a_camera() -> None:
    accuracy = Accuracy(camera=Camera((9, 0, 4), field_of_view=0.8, height=400), pixel_tolerance=1)
    mesh = build_mesh("tea-service", accuracy=accuracy, isocurves=(2, 2), wires="tubes")
    triangles = {part.name: part.triangles[1] - part.triangles[0] for part in mesh.parts}
    group = find("tea-service").surface()
    assert isinstance(group, GroupSurface)
    assert all(triangles[f"{member.name}/{NAME}"] for member in group.members)
