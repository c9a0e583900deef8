"""Triangles of whole breps: closed, within their bounds, and with normals within an angle."""

from functools import cache
from itertools import pairwise, permutations
from math import inf
from typing import Any

import numpy as np
import pytest

from oracles.breps import count_cracks, measure_to_mesh, sample_face
from oracles.distance import Soup
from oracles.solids import INVALID, MEASURES, VALID, read_solid
from oracles.topology import volume
from service.bases.arrays import FloatArray
from service.cancellation import Cancellation, Cancelled, cancelled_by
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep import border_sampling, meshing
from service.engine.brep.borders.border import Border
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.settling import LoopFaults, settle_border
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.filling import refine
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.errors import InvalidRequest, TooLarge
from service.schemas.brep import BrepDefinition


@cache
def read_prepared(name: str) -> PreparedBrep:
    return prepare(BrepDefinition.model_validate(read_solid(name)).to_surface().lower())


def build(name: str, share: float, angle: float = inf) -> BrepTriangulation:
    """The triangles of a solid, with a tolerance relative to its diagonal."""
    prepared = read_prepared(name)
    return triangulate_brep(prepared, Goal(share * prepared.diagonal, angle), MeshLimits())


def list_points(mesh: BrepTriangulation) -> FloatArray:
    """The vertices (T, 3, 3) of triangles."""
    vertices: FloatArray = mesh.positions[mesh.points[mesh.triangles]]
    return vertices


@pytest.mark.slow
@pytest.mark.parametrize("name", VALID)
def test_solids_are_closed_and_within_the_tolerance(name: str) -> None:
    mesh, prepared = build(name, 0.01), read_prepared(name)
    triangles = mesh.points[mesh.triangles]
    assert not count_cracks(mesh.positions, triangles)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len(np.unique(ends, axis=0)) == len(ends)  # no edge twice
    tolerance = 0.01 * prepared.diagonal
    assert mesh.bound <= tolerance
    expected = MEASURES[name]
    assert (
        abs(volume(mesh.positions, triangles) - expected["volume"]) < tolerance * expected["area"]
    )
    assert (np.diff(mesh.faces) >= 0).all()
    assert (mesh.corner_faces[mesh.triangles] == mesh.faces[:, np.newaxis]).all()
    # Away from borders, points are those of the surface.
    inner = np.unique(mesh.triangles)
    inner = inner[mesh.points[inner] >= mesh.edge_points.max() + 1]
    points = prepared.places.evaluate(mesh.corner_faces[inner], mesh.places[inner])
    assert np.array_equal(points, mesh.positions[mesh.points[inner]])


@pytest.mark.slow
@pytest.mark.parametrize(("share", "most"), [(1.29e-4, 12_500), (1.5e-4, 11_300)])
def test_a_tube_with_uneven_parameters_takes_few_triangles(share: float, most: int) -> None:
    # Its speed along the tube jumps at knots, so that the surface runs ahead of the mesh by more
    # than the tolerance. Triangles that were cut for this reason became ever thinner.
    mesh = build("pipe", share)
    assert mesh.bound <= share * read_prepared("pipe").diagonal
    assert len(mesh.triangles) <= most
    assert mesh.rounds <= 4


@pytest.mark.parametrize("name", ["cone", "loft", "torus_cut"])
def test_points_of_faces_are_within_their_bounds(name: str) -> None:
    mesh, brep, rng = build(name, 0.003), read_solid(name), np.random.default_rng(3)
    gap = float(read_prepared(name).gaps.max())
    for face in range(0, len(brep["faces"]), 3):
        bound = float(mesh.face_bounds[face])
        soup = Soup(list_points(mesh)[mesh.faces == face])
        distance, _ = measure_to_mesh(soup, sample_face(brep, face, 20, rng).points, bound + gap)
        assert distance <= bound + gap


@pytest.mark.parametrize("share", [0.01, 1e-4, 1e-6])
def test_a_cone_takes_one_round_and_few_triangles(share: float) -> None:
    mesh = build("cone", share)
    assert mesh.rounds == 1
    assert mesh.bound <= share * read_prepared("cone").diagonal
    # A chord of an arc with the angle t is 1 − cos(t / 2) from it: t is about √(8 share).
    assert len(mesh.triangles) < 30 / share**0.5


def test_faces_in_which_few_triangles_fail_are_cut_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(refine, "CUTTING_ROUNDS", 3)
    monkeypatch.delattr(refine.Refinement, "_insert")
    mesh = build("wavy", 1e-3)  # four of a thousand triangles fail after three rounds
    assert 3 < mesh.rounds < 30
    assert mesh.face_bounds.max() <= 1e-3 * read_prepared("wavy").diagonal


def test_edges_are_chains_of_vertices_between_their_ends() -> None:
    prepared, mesh = read_prepared("plate"), build("plate", 0.01)
    sides = mesh.points[mesh.triangles]
    pairs = {frozenset(pair) for row in sides.tolist() for pair in permutations(row, 2)}
    for edge, (first, last) in enumerate(prepared.edge_vertices.tolist()):
        if prepared.is_degenerate[edge]:
            continue
        chain = mesh.edge_points[mesh.edge_starts[edge] : mesh.edge_starts[edge + 1]].tolist()
        assert (chain[0], chain[-1]) == (first, last)
        assert all(frozenset(pair) in pairs for pair in pairwise(chain))
    assert mesh.edge_bounds.max() <= 0.01 * prepared.diagonal


def test_the_mesh_is_near_the_faces_if_the_goal_is_two_sided() -> None:
    for name in ("bolt", "wavy"):
        prepared = read_prepared(name)
        goal = Goal(0.01 * prepared.diagonal, two_sided=True)
        mesh = triangulate_brep(prepared, goal, MeshLimits())
        assert mesh.mesh_bounds is not None
        assert mesh.bound <= goal.tolerance
        assert mesh.mesh_bounds.max() <= 2 * goal.tolerance
    assert build("bolt", 0.01).mesh_bounds is None


@pytest.mark.parametrize("name", ["torus", "torus_cut"])
def test_normals_turn_by_at_most_the_angle_along_edges(name: str) -> None:
    prepared, angle = read_prepared(name), 0.25
    mesh = build(name, 0.02, angle)
    partials = prepared.places.evaluate_partials(mesh.corner_faces, mesh.places)
    normals = np.cross(partials[1], partials[2])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0, lengths, 1)  # 0 at poles
    own, regular = normals[mesh.triangles], (lengths > 0)[mesh.triangles, 0]
    cosines = np.clip((own * own[:, [1, 2, 0]]).sum(axis=2), -1, 1)
    turns = np.arccos(cosines)[regular & regular[:, [1, 2, 0]]]
    assert turns.max() <= 1.001 * angle
    assert len(mesh.triangles) > 4 * len(build(name, 0.02).triangles)


def test_faces_whose_loops_touch_are_left_out_and_have_no_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def find_fault(*arguments: Any) -> tuple[EdgeSamples, Border, LoopFaults]:
        samples, border, _ = settle_border(*arguments)
        loops, places = np.array([2]), np.array([[0], [1 << 30]])
        return samples, border, LoopFaults(loops, np.array(["loops_touch"]), loops, loops, places)

    monkeypatch.setattr(border_sampling, "settle_border", find_fault)
    mesh = build("box", 0.01)
    assert mesh.faces.tolist() == [0, 0, 1, 1, 3, 3, 4, 4, 5, 5]
    assert np.isinf(mesh.face_bounds).tolist() == [False, False, True, False, False, False]
    (skipped,) = mesh.skipped_faces
    assert (skipped.face, skipped.issue.code) == (2, "loops_touch")
    assert skipped.issue.pointer == "/faces/2/loops/0"
    assert skipped.issue.got.startswith("a loop that touches itself near (")


def test_skipped_faces_have_no_triangles() -> None:
    brep = {**read_solid(INVALID), "invalid_faces": "skip"}
    prepared = prepare(BrepDefinition.model_validate(brep).to_surface().lower())
    goal = Goal(0.01 * prepared.diagonal)
    mesh = triangulate_brep(prepared, goal, MeshLimits())
    missing = np.setdiff1d(np.arange(len(mesh.face_bounds)), mesh.faces)
    assert missing.tolist() == [face.face for face in prepared.skipped_faces] == [26]
    assert mesh.bound <= goal.tolerance


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (MeshLimits(triangles=100), "too_many_triangles"),
        (MeshLimits(effort=Effort(limit=1e6)), "too_costly"),
    ],
)
def test_triangles_and_work_are_limited(limits: MeshLimits, code: str) -> None:
    prepared = read_prepared("gear")
    with pytest.raises(TooLarge) as error:
        triangulate_brep(prepared, Goal(1e-3 * prepared.diagonal), limits)
    assert error.value.issues[0].code == code


@pytest.mark.parametrize("share", [1e-9, 1e-15, 1e-300])
def test_tolerances_below_the_rounding_of_places_are_refused(share: float) -> None:
    with pytest.raises(InvalidRequest) as error:
        build("plate", share)
    assert error.value.issues[0].code == "tolerance_too_small"


def test_edges_are_not_sampled_further_than_triangles_are_allowed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The error comes while edges are divided, so no polygon is built.
    monkeypatch.delattr(border_sampling, "build_border")
    prepared = read_prepared("plate")
    with pytest.raises(TooLarge) as error:
        triangulate_brep(prepared, Goal(1e-8 * prepared.diagonal), MeshLimits(5000))
    assert error.value.issues[0].code == "too_many_triangles"


@pytest.mark.parametrize("step", ["sample_borders", "FaceTriangulations", "Refinement"])
def test_work_ends_soon_after_it_is_cancelled(monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    cancellation, prepared = Cancellation(), read_prepared("plate")
    call = getattr(meshing, step)

    def cancel(*arguments: object) -> object:
        cancellation.cancel()
        return call(*arguments)

    monkeypatch.setattr(meshing, step, cancel)
    with cancelled_by(cancellation), pytest.raises(Cancelled):
        triangulate_brep(prepared, Goal(0.01 * prepared.diagonal), MeshLimits())
