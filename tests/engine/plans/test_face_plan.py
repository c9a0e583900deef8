"""Plans are made once for each connectivity and resolution, and do not change numbers."""

from threading import Barrier, Thread

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.cache import MESH_PLANS, Cache, derive_once
from service.encoders.registry import BY_NAME
from service.engine.connectivity.connect import connect
from service.engine.connectivity.edges import sample_edges
from service.engine.connectivity.seams import find_seams
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples.catalogue import EXAMPLES
from service.surface.lowered import GroupModel, PatchModel
from tests.engine.meshing import build_mesh
from tests.strategies import Array, build_model, split_models

MODELS = [
    model
    for example in EXAMPLES.values()
    for lowered in [example.surface().lower()]
    for model in (lowered.models if isinstance(lowered, GroupModel) else [lowered])
    if isinstance(model, PatchModel)
]


@pytest.fixture(autouse=True)
def _set_capacity(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sets a capacity that holds the plans of a test: apps that other tests create change it."""
    monkeypatch.setattr(MESH_PLANS, "capacity", 64 << 20)


def forget_plans() -> None:
    """Clears the cache, so that the next mesh makes its plan again."""
    MESH_PLANS.clear()


def check_seams(model: PatchModel) -> None:
    """Compares two ways to find seams: from the pattern of equal points, and from coordinates.

    Edges and corners must be the same up to their numbers, and samples of sides bit for bit.
    """
    by_pattern, by_coordinates = connect(model), find_seams(model.batches)
    np.testing.assert_array_equal(by_pattern.collapsed, by_coordinates.collapsed)
    for first, second in (
        (by_pattern.edge, by_coordinates.edge),
        (by_pattern.corner, by_coordinates.corner),
    ):
        pairs = np.unique(np.stack([first.ravel(), second.ravel()]), axis=1)
        assert pairs.shape[1] == first.max() + 1 == second.max() + 1
    np.testing.assert_array_equal(
        by_pattern.corner_points[by_pattern.corner],
        by_coordinates.corner_points[by_coordinates.corner],
    )
    sides = []
    for seams in (by_pattern, by_coordinates):
        edge_samples = sample_edges(seams.curves, is_chosen=None, divisions=5)
        edge_samples = edge_samples.swapaxes(0, 1)  # one row for each edge
        samples = edge_samples[seams.edge]
        sides.append(np.where(seams.backward[..., None, None], samples[:, :, ::-1], samples))
    np.testing.assert_array_equal(sides[0], sides[1])


@pytest.mark.parametrize("model", MODELS, ids=lambda model: str(model.name))
def test_the_pattern_determines_the_seams_of_every_example(model: PatchModel) -> None:
    check_seams(model)
    check_seams(model)  # now from the cache


@given(split_models())
def test_the_pattern_determines_the_seams_of_pieces_of_a_surface(
    net_and_pieces: tuple[Array, list[Array]],
) -> None:
    _, pieces = net_and_pieces
    check_seams(build_model(pieces))


@pytest.mark.parametrize("name", ["utah-teapot", "sphere", "cone", "heated-panel"])
@pytest.mark.parametrize("format_name", ["glb", "json", "obj", "stl", "oogl"])
def test_a_file_is_equal_with_a_new_plan_and_with_a_cached_plan(
    name: str, format_name: str
) -> None:
    surface, options = EXAMPLES[name].surface(), MeshOptions(resolution=(5, 7))
    forget_plans()
    from_new_plan = render(surface, options, BY_NAME[format_name])
    assert render(surface, options, BY_NAME[format_name]) == from_new_plan


@given(st.integers(0, 2**32 - 1))
def test_moved_points_are_meshed_with_the_plan_of_their_pattern(seed: int) -> None:
    """Translated, mirrored and scaled surfaces share a plan; a new plan gives the same numbers.

    At a crease angle of π no edge is a crease: creases, which depend on shapes, would need a plan
    of their own.
    """
    rng = np.random.default_rng(seed)
    left = rng.random((4, 4, 3))
    right = rng.random((4, 4, 3))
    right[0] = left[-1]
    build_mesh([left, right], resolution=(3, 3), crease_angle=np.pi)
    misses = MESH_PLANS.misses
    nets = [net * rng.choice([-2.0, 3.0], 3) + rng.random(3) for net in (left, right)]
    nets[1][0] = nets[0][-1]  # the patches share this edge again
    from_cached_plan = build_mesh(nets, resolution=(3, 3), crease_angle=np.pi)
    assert MESH_PLANS.misses == misses
    forget_plans()
    from_new_plan = build_mesh(nets, resolution=(3, 3), crease_angle=np.pi)
    assert from_cached_plan.report == from_new_plan.report
    for name in ("positions", "normals", "triangles"):
        np.testing.assert_array_equal(getattr(from_cached_plan, name), getattr(from_new_plan, name))


def test_creases_have_plans_of_their_own() -> None:
    """Positions on the edge of two flat patches have one vertex at angle 0, else two."""
    x, y = np.meshgrid(np.arange(2.0), np.arange(2.0), indexing="ij")

    def build_nets(angle: float) -> list[Array]:
        flat = np.stack([x, y, 0 * x], axis=-1)
        return [flat, np.stack([1 + x * np.cos(angle), y, x * np.sin(angle)], axis=-1)]

    counts = [
        len(build_mesh(build_nets(angle), resolution=(2, 2)).positions) for angle in (0, 1, 0, 2)
    ]
    assert counts == [15, 18, 15, 18]


def test_plans_of_many_connectivities_stay_within_the_capacity(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(MESH_PLANS, "capacity", 1 << 20)
    for seed in range(40):
        nets = np.random.default_rng(seed).integers(0, 3, (4, 3, 3, 3)).astype(float)
        build_mesh(list(nets), resolution=(10, 10))
        assert 0 < MESH_PLANS.nbytes <= MESH_PLANS.capacity


def test_a_plan_that_two_threads_request_is_made_once() -> None:
    cache: Cache[Array] = Cache(1 << 20)
    begin, built = Barrier(2), []

    def build() -> Array:
        built.append(1)
        return np.zeros(3)

    def request_all() -> None:
        begin.wait()
        for key in range(200):
            cache.get(key, build)

    threads = [Thread(target=request_all) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(built) == 200


def test_results_are_kept_only_if_their_source_arrays_are_read_only() -> None:
    """A copy of an array is another source, and is writeable."""
    rows = np.arange(3)
    assert derive_once((rows,), "text", lambda: b"1") == b"1"
    assert derive_once((rows,), "text", lambda: b"2") == b"2"
    rows.flags.writeable = False
    assert derive_once((rows,), "text", lambda: b"3") == b"3"
    assert derive_once((rows,), "text", lambda: b"4") == b"3"
    assert derive_once((rows.copy(),), "text", lambda: b"5") == b"5"
