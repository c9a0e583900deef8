"""Plans are made once for each connectivity and resolution, and change no number."""

from threading import Barrier, Thread

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.cache import MESH_PLANS, Cache, derive_once
from service.encoders.registry import BY_NAME
from service.engine.mesh.connect import connect
from service.engine.mesh.edges import sample_edges
from service.engine.mesh.seams import find_seams
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples import EXAMPLES
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
def _room_for_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    """The default limit of plans, because applications of other tests set it."""
    monkeypatch.setattr(MESH_PLANS, "capacity", 64 << 20)


def forget_plans() -> None:
    """After the plans are cleared, the next mesh makes its plan again."""
    MESH_PLANS.clear()


def check_seams(model: PatchModel) -> None:
    """Seams from indices equal those from coordinates, bit for bit."""
    planned, result = connect(model), find_seams(model.batches)
    np.testing.assert_array_equal(planned.collapsed, result.collapsed)
    for one, other in ((planned.edge, result.edge), (planned.corner, result.corner)):
        pairs = np.unique(np.stack([one.ravel(), other.ravel()]), axis=1)
        assert pairs.shape[1] == one.max() + 1 == other.max() + 1
    np.testing.assert_array_equal(
        planned.corner_points[planned.corner], result.corner_points[result.corner]
    )
    sides = []
    for seams in (planned, result):
        samples = sample_edges(seams.curves, None, 5).swapaxes(0, 1)[seams.edge]
        sides.append(np.where(seams.backward[..., None, None], samples[:, :, ::-1], samples))
    np.testing.assert_array_equal(sides[0], sides[1])


@pytest.mark.parametrize("model", MODELS, ids=lambda model: str(model.name))
def test_a_pattern_tells_the_seams_of_every_example(model: PatchModel) -> None:
    check_seams(model)
    check_seams(model)


@given(split_models())
def test_a_pattern_tells_the_seams_of_pieces_of_a_surface(
    pieces: tuple[Array, list[Array]],
) -> None:
    check_seams(build_model(pieces[1]))


@pytest.mark.parametrize("name", ["utah-teapot", "sphere", "cone", "heated-panel"])
@pytest.mark.parametrize("form", ["glb", "json", "obj", "stl", "oogl"])
def test_a_file_is_the_same_with_a_plan_and_without(name: str, form: str) -> None:
    surface, options = EXAMPLES[name].surface(), MeshOptions(resolution=(5, 7))
    forget_plans()
    cold = render(surface, options, BY_NAME[form])
    assert render(surface, options, BY_NAME[form]) == cold


@given(st.integers(0, 2**32 - 1))
def test_moved_points_are_meshed_by_the_plan_of_the_pattern(seed: int) -> None:
    """Dragged, mirrored and scaled surfaces share a plan, and get the numbers that their own plan
    would give."""
    rng = np.random.default_rng(seed)
    left = rng.random((4, 4, 3))
    right = rng.random((4, 4, 3))
    right[0] = left[-1]
    build_mesh([left, right], resolution=(3, 3), crease_angle=np.pi)
    misses = MESH_PLANS.misses
    nets = [net * rng.choice([-2.0, 3.0], 3) + rng.random(3) for net in (left, right)]
    nets[1][0] = nets[0][-1]
    warm = build_mesh(nets, resolution=(3, 3), crease_angle=np.pi)
    assert MESH_PLANS.misses == misses
    forget_plans()
    cold = build_mesh(nets, resolution=(3, 3), crease_angle=np.pi)
    assert warm.report == cold.report
    for name in ("positions", "normals", "triangles"):
        np.testing.assert_array_equal(getattr(warm, name), getattr(cold, name))


def test_creases_are_a_pattern_of_their_own() -> None:
    """Two flat patches: one vertex along their edge where they are level, two where they bend."""
    x, y = np.meshgrid(np.arange(2.0), np.arange(2.0), indexing="ij")

    def build_nets(angle: float) -> list[Array]:
        flat = np.stack([x, y, 0 * x], axis=-1)
        return [flat, np.stack([1 + x * np.cos(angle), y, x * np.sin(angle)], axis=-1)]

    counts = [
        len(build_mesh(build_nets(angle), resolution=(2, 2)).positions) for angle in (0, 1, 0, 2)
    ]
    assert counts == [15, 18, 15, 18]


def test_many_connectivities_leave_the_plans_within_their_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(MESH_PLANS, "capacity", 1 << 20)
    for seed in range(40):
        nets = np.random.default_rng(seed).integers(0, 3, (4, 3, 3, 3)).astype(float)
        build_mesh(list(nets), resolution=(10, 10))
        assert 0 < MESH_PLANS.nbytes <= MESH_PLANS.capacity


def test_a_plan_that_two_threads_need_is_made_once() -> None:
    cache: Cache[Array] = Cache(1 << 20)
    begin, built = Barrier(2), []

    def build() -> Array:
        built.append(1)
        return np.zeros(3)

    def ask() -> None:
        begin.wait()
        for key in range(200):
            cache.get(key, build)

    threads = [Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(built) == 200


def test_results_are_kept_only_if_their_arrays_are_read_only() -> None:
    rows = np.arange(3)
    assert derive_once((rows,), "text", lambda: b"1") == b"1"
    assert derive_once((rows,), "text", lambda: b"2") == b"2"
    rows.flags.writeable = False
    assert derive_once((rows,), "text", lambda: b"3") == b"3"
    assert derive_once((rows,), "text", lambda: b"4") == b"3"
    assert derive_once((rows.copy(),), "text", lambda: b"5") == b"5"
