"""Checks of meshes: intervals against samples of the surface, and the memory that they take."""

import json
import tracemalloc
from io import BytesIO
from math import pi
from typing import Any

import numpy as np
import pytest

from oracles.distance import Soup
from service.bases.arrays import FloatArray, Ints
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.mesh_checks.query import CheckQuery
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.check import plan_check
from service.pipeline.limits import Limits
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind

KINDS = ("saddle", "octahedral-sphere", "trefoil-tube", "ribbon", "tea-service", "pipe-tee")
"""Patches, triangles, a tube, a ribbon, a group, and a brep."""


def make_mesh(surface: SurfaceKind, tolerance: float) -> tuple[FloatArray, Ints]:
    """Vertices and triangles of a mesh of the service, in double precision."""
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=tolerance))
    arrays = np.load(BytesIO(render(surface, options, BY_NAME["npz"])))
    return arrays["vertices"], arrays["faces"].astype(np.intp)


def check(surface: SurfaceKind, mesh: GivenMesh, **options: Any) -> dict[str, Any]:
    """The answer to a check."""
    answer: dict[str, Any] = json.loads(plan_check(surface, mesh, CheckQuery(**options)).run())
    return answer


@pytest.mark.parametrize("name", KINDS)
def test_intervals_hold_the_distances_of_samples(name: str) -> None:
    """Vertices of a fine mesh are points of the surface, and vertices are points of the mesh."""
    surface = find(name).surface()
    vertices, triangles = make_mesh(surface, 0.03)
    vertices = vertices + np.random.default_rng(1).normal(0, 0.01, vertices.shape)
    answer = check(surface, GivenMesh(vertices, triangles))
    assert answer["reached"]
    there, back = answer["surface_to_mesh"], answer["mesh_to_surface"]
    for deviation in (there, back):
        assert 0.9 * deviation["high"] <= deviation["low"] <= deviation["high"]
    # No sample is further away than the upper end; the sample that was found is so far away.
    mesh, fine = Soup(vertices[triangles]), make_mesh(surface, 5e-4)
    assert mesh.distances(fine[0]).max() <= there["high"] * (1 + 1e-9)
    found = float(mesh.distances(np.array([there["point"]]))[0])
    assert there["low"] <= found * (1 + 1e-9)
    assert found <= there["high"]
    # A mesh is usually within twice its tolerance from the surface.
    slack = 2 * 5e-4 * surface.lower().diagonal
    near = Soup(fine[0][fine[1]])
    assert near.distances(vertices).max() <= back["high"] + slack
    assert near.distances(np.array([back["point"]]))[0] >= back["low"] - slack
    assert ("uv" in there) == (name not in {"ribbon", "trefoil-tube"})


def test_faults_and_sizes_are_in_the_answer() -> None:
    surface = find("sphere").surface()
    vertices, triangles = make_mesh(surface, 0.02)
    triangles[5] = triangles[5, ::-1]
    answer = check(surface, GivenMesh(vertices, np.delete(triangles, 9, axis=0)))
    assert (answer["vertices"], answer["triangles"]) == (len(vertices), len(triangles) - 1)
    assert answer["open_edges"] == answer["flipped_edges"] == 3
    assert answer["non_manifold_edges"] == answer["degenerate_faces"] == 0
    assert answer["max_normal_angle"] == pytest.approx(pi, abs=0.3)
    assert answer["max_normal_angle_triangle"] == 5
    assert not {"limit", "mesh", "distances", "skipped_faces"} & answer.keys()


def test_distances_of_vertices_are_listed_if_requested() -> None:
    surface = find("saddle").surface()
    vertices, triangles = make_mesh(surface, 0.02)
    vertices[7, 2] += 0.3
    answer = check(surface, GivenMesh(vertices, triangles), distances=True)
    assert answer["mesh"] == {"vertices": vertices.tolist(), "faces": triangles.tolist()}
    distances = np.array(answer["distances"])
    assert distances.argmax() == 7
    assert distances.max() <= answer["mesh_to_surface"]["high"] * (1 + 1e-9)


def test_a_check_has_the_same_bytes_again() -> None:
    surface = find("torus").surface()
    mesh = GivenMesh(*make_mesh(surface, 0.02))
    first, second = (plan_check(surface, mesh, CheckQuery()).run() for _ in range(2))
    assert first == second


def test_a_narrower_interval_is_inside_of_a_wider_one() -> None:
    surface = find("saddle").surface()
    mesh = GivenMesh(*make_mesh(surface, 0.02))
    wide, narrow = (check(surface, mesh, relative_tolerance=w) for w in (0.5, 0.02))
    for name in ("surface_to_mesh", "mesh_to_surface"):
        assert wide[name]["low"] <= narrow[name]["high"]
        assert narrow[name]["low"] <= wide[name]["high"]
        width = narrow[name]["high"] - narrow[name]["low"]
        assert width <= 0.02 * narrow[name]["high"]


def test_checks_above_the_limits_are_refused() -> None:
    surface = find("saddle").surface()
    mesh = GivenMesh(*make_mesh(surface, 0.02))
    with pytest.raises(TooLarge):
        plan_check(surface, mesh, CheckQuery(), Limits(max_memory=1 << 16))
    with pytest.raises(TooLarge):
        plan_check(surface, mesh, CheckQuery(distances=True), Limits(max_bytes=5000))


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_memory_stays_below_its_prediction(name: str) -> None:
    surface = find(name).surface()
    mesh = GivenMesh(*make_mesh(surface, 0.01))
    work = plan_check(surface, mesh, CheckQuery(distances=True))
    tracemalloc.start()
    try:
        work.run()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak <= work.cost.memory


def test_with_little_memory_the_intervals_are_wider() -> None:
    """The reference mesh gets the memory that is left."""
    surface = find("saddle").surface()
    mesh = GivenMesh(*make_mesh(surface, 2e-3))
    limits = Limits(max_memory=112 << 20)
    assert plan_check(surface, mesh, CheckQuery()).cost.memory > limits.max_memory
    less = plan_check(surface, mesh, CheckQuery(), limits)
    assert less.cost.memory <= limits.max_memory
    answer = json.loads(less.run())
    assert (answer["reached"], answer["limit"]) == (False, "work")
    assert answer["surface_to_mesh"]["low"] <= 2e-3 * surface.lower().diagonal
