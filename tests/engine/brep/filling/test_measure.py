"""Bounds of triangles of places, against exact points of surfaces and brute distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.filling import refine
from service.engine.brep.filling.measure import TriangleMeasure
from service.engine.brep.filling.refine import Refinement
from service.engine.brep.filling.triangles import Triangles, build_triangles, find_mates
from service.engine.vectors import NEXT
from service.errors import TooLarge
from tests.engine.brep.filled_faces import (
    BUMP,
    CYLINDER,
    PLANE,
    FilledFaces,
    build_table,
    draw_inner_places,
    fill,
)
from tests.engine.brep.filling.exact_distances import check_bounds
from tests.engine.trims.tables import find_surface_point

seeds = st.integers(0, 2**32 - 1)


def build_measure(filled: FilledFaces, tolerance: float) -> TriangleMeasure:
    return TriangleMeasure(
        filled.corners, np.full(3, tolerance), np.zeros(3), Goal(tolerance), MeshLimits()
    )


def measure(filled: FilledFaces, tolerance: float = 1.0) -> Triangles:
    """The triangles of all faces, with bounds."""
    measure, own = build_measure(filled, tolerance), filled.read()
    return measure.measure(measure.build(own), find_mates(own))


@pytest.mark.slow
@given(seeds)
def test_no_point_is_further_than_the_bound_of_its_triangle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, int(rng.integers(0, 12))))
    # Vertices of the mesh need not be on the surface.
    filled.corners.positions += rng.normal(0, 0.02, filled.corners.positions.shape)
    filled.corners.residuals[:] = 0.2
    triangles = measure(filled, float(rng.choice([1.0, 0.01])))
    assert np.isfinite(triangles.bounds).all()
    assert not triangles.is_changed.any()
    check_bounds(filled, triangles, rng)


@pytest.mark.slow
@given(seeds)
def test_flat_triangles_are_compared_with_those_beside_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, 10))
    # Some corners become one vertex with a neighbour.
    own = filled.read()
    for t in rng.integers(0, own.shape[1], 3):
        a, b = own[:2, t]
        filled.corners.points[a] = filled.corners.points[b]
    filled.corners.residuals[:] = 10.0
    triangles = measure(filled)
    points = filled.corners.points[own]
    flat = (points == points[NEXT]).any(axis=0)
    beyond = find_mates(own).beyond
    alone = [t for t in flat.nonzero()[0] if all(k < 0 or flat[k] for k in beyond[:, t])]
    assert np.isinf(triangles.bounds[alone]).all()
    rest = triangles.take(np.isfinite(triangles.bounds))
    check_bounds(filled, triangles.take(np.setdiff1d(np.arange(len(triangles)), alone)), rng)
    assert len(rest) == len(triangles) - len(alone)


def test_planes_are_as_far_as_their_corners() -> None:
    filled = fill()
    filled.corners.residuals[filled.corners.faces == PLANE] = 0.25
    triangles = measure(filled)
    on_plane = filled.corners.faces[triangles.corners[0]] == PLANE
    assert triangles.bounds[on_plane] == pytest.approx(0.25)
    # A quarter of a cylinder over one chord: 1 − cos 45°.
    on_cylinder = filled.corners.faces[triangles.corners[0]] == CYLINDER
    assert triangles.bounds[on_cylinder].max() >= 1 - 0.5**0.5


def test_only_what_changed_and_its_neighbours_are_measured() -> None:
    filled = fill()
    own = filled.read()
    measure_all, mates = build_measure(filled, 1.0), find_mates(own)
    triangles = build_triangles(own, np.ones(own.shape[1]))
    changed = int((filled.corners.faces[own[0]] == BUMP).nonzero()[0][2])
    triangles.bounds[:], triangles.is_changed[:] = 77.0, False
    triangles.is_changed[changed] = True
    after = measure_all.measure(triangles, mates)
    near = {changed, *mates.beyond[:, changed][mates.beyond[:, changed] >= 0].tolist()}
    assert set((after.bounds != 77.0).nonzero()[0].tolist()) == near
    # Bounds that rest on triangles at the corners are renewed with these and their neighbours.
    triangles.is_wide[:] = True
    wider = {changed}
    for _ in range(2):
        wider = set(np.flatnonzero(np.isin(own, own[:, [*wider]]).any(axis=0)).tolist())
    assert len(wider) < own.shape[1]
    after = measure_all.measure(triangles, mates)
    assert set((after.bounds != 77.0).nonzero()[0].tolist()) == wider


def test_edges_far_from_the_surface_do_not_refine_faces_for_ever() -> None:
    filled = fill()
    filled.corners.residuals[filled.corners.faces == CYLINDER] = 0.5
    built = build_measure(filled, 0.01).build(filled.read())
    on_cylinder = filled.corners.faces[built.corners[0]] == CYLINDER
    assert built.allowed[on_cylinder] == pytest.approx(1.1 * 0.5 + 0.8 * 0.01)
    assert built.allowed[~on_cylinder] == pytest.approx(0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("cutting", "tolerance"), [(8, 0.04), (8, 0.3), (1, 0.1)])
def test_all_triangles_are_refined_until_they_meet_the_tolerance(
    monkeypatch: pytest.MonkeyPatch, cutting: int, tolerance: float
) -> None:
    monkeypatch.setattr(refine, "CUTTING_ROUNDS", cutting)
    filled = fill()
    before = filled.measure_areas(filled.read())
    # Borders are not refined here, so they are on straight lines of places between corners.
    refinement = Refinement(build_measure(filled, tolerance), filled.triangulations)
    triangles = refinement.run()
    assert filled.measure_areas(triangles.corners).tolist() == before.tolist()
    alone = find_mates(triangles.corners).edges.reshape(3, -1) < 0
    assert np.array_equal(alone, filled.corners.find_fixed(triangles.corners))
    faces = filled.corners.faces[triangles.corners[0]]
    assert (np.diff(faces) >= 0).all()
    check_bounds(filled, triangles, np.random.default_rng(1))
    # Away from the borders, all triangles meet the tolerance.
    inner = (triangles.corners >= filled.corners.on_border).all(axis=0)
    assert (triangles.bounds[inner] <= tolerance).mean() > 0.9
    assert refinement.rounds > 1


def test_a_face_that_cannot_be_refined_keeps_a_measured_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(refine, "CUTTING_ROUNDS", 2)
    monkeypatch.setattr(refine, "LONGEST", 3)
    filled = fill()
    triangles = Refinement(build_measure(filled, 1e-6), filled.triangulations).run()
    assert not triangles.is_changed.any()
    faces = filled.corners.faces[triangles.corners[0]]
    for face in (BUMP, CYLINDER):
        assert triangles.bounds[faces == face].max() > 1e-3
    check_bounds(filled, triangles, np.random.default_rng(2))


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (MeshLimits(triangles=40), "too_many_triangles"),
        (MeshLimits(effort=Effort(limit=1e5)), "too_costly"),
    ],
)
def test_triangles_and_work_are_limited(limits: MeshLimits, code: str) -> None:
    filled = fill()
    measure = TriangleMeasure(filled.corners, np.full(3, 1e-3), np.zeros(3), Goal(1e-3), limits)
    with pytest.raises(TooLarge) as error:
        Refinement(measure, filled.triangulations).run()
    assert error.value.issues[0].code == code


def test_normals_turn_by_no_more_than_the_angle_along_inner_edges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Sides of polygons are halved before; here they turn by 1/16 of the quarter. All triangles of
    # the first triangulation meet at one corner.
    loop = [*((x, 0) for x in range(16)), *((x, 16) for x in range(16, -1, -1))]
    filled = fill([], [loop], [])
    count = len(loop)
    fan = np.array([np.zeros(count - 2), np.arange(1, count - 1), np.arange(2, count)], np.intp)
    proper = fan[:, (fan[1] > 15) | (fan[2] > 16)]  # the corner and the first row are in a line
    monkeypatch.setattr(filled.triangulations, "read", lambda _: (proper, None))
    goal = Goal(0.5, angle=0.15)
    measure = TriangleMeasure(filled.corners, np.full(3, 0.5), np.zeros(3), goal, MeshLimits())
    triangles = Refinement(measure, filled.triangulations).run()
    turns = []
    for own in (proper, triangles.corners):
        points = filled.corners.positions[filled.corners.points[own]]
        angles = np.arctan2(points[..., 1], points[..., 0])
        turns.append(np.abs(angles - angles[NEXT])[~filled.corners.find_fixed(own)].max())
    assert turns[0] > 1.0
    assert turns[1] <= 0.1501


@given(seeds)
def test_no_point_of_the_mesh_is_further_from_the_surface_than_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    faces, places = draw_inner_places(filled, rng, int(rng.integers(0, 12)))
    # Some places are so near to each other that triangles are thin.
    places[: len(places) // 2] = places[:1] + rng.integers(0, 200, (len(places) // 2, 2))
    rows = np.column_stack([faces, places])
    unique = np.unique(rows, axis=0)
    filled.insert(unique[:, 0], np.ascontiguousarray(unique[:, 1:]))
    corners = filled.corners
    corners.positions += rng.normal(0, 0.02, corners.positions.shape)
    corners.residuals[:] = 0.2
    own = filled.read()
    measure = TriangleMeasure(
        corners, np.ones(3), np.zeros(3), Goal(1.0, two_sided=True), MeshLimits()
    )
    triangles = measure.measure(measure.build(own), find_mates(own))
    assert np.isfinite(triangles.mesh_bounds).all()
    table, surface = build_table(), corners.surface
    for t in rng.permutation(own.shape[1])[:12]:
        shares = rng.random(3)
        shares /= shares.sum()
        face = corners.faces[own[:1, t]]
        point = shares @ corners.positions[corners.points[own[:, t]]]
        # The nearest of the surface's points over the triangle, by random places nearer and nearer.
        best, radius = shares, 1.0
        for _ in range(8):
            spread = best + radius * (rng.dirichlet(np.ones(3), 100) - best)
            spread = np.concatenate([best[np.newaxis], np.abs(spread)])
            spread /= spread.sum(axis=1, keepdims=True)
            at = surface.to_parameters(face.repeat(101), spread @ corners.places[own[:, t]])
            near = surface.surfaces.evaluate(face.repeat(101), at)
            nearest = np.argmin(((near - point) ** 2).sum(axis=1))
            best, radius = spread[nearest], radius / 2
        u, v = at[nearest].tolist()
        exact = np.array([float(x) for x in find_surface_point(table, int(face[0]), u, v)])
        assert np.linalg.norm(exact - point) <= triangles.mesh_bounds[t] + 0.005
    failing = triangles.take(np.zeros(1, np.intp))
    failing.bounds[:], failing.mesh_bounds[:] = 0.0, np.nan
    assert failing.fails.all()


def test_flat_triangles_beside_flat_ones_are_compared_with_others_at_their_points() -> None:
    # Two corners of the square become those beside them: the triangles there are flat, and so are
    # their neighbours.
    steps = [(0, 0), (1, 0), (2, 0), (3, 0), (16, 0), (16, 16), (0, 16)]
    filled = fill([steps], [], [])
    own = filled.read()
    filled.corners.points[1:4] = filled.corners.points[0]
    points = filled.corners.points[own]
    flat = (points == points[NEXT]).any(axis=0)
    beyond = find_mates(own).beyond
    surrounded = [t for t in flat.nonzero()[0] if all(k < 0 or flat[k] for k in beyond[:, t])]
    assert surrounded
    filled.corners.residuals[:] = 3.0
    triangles = measure(filled)
    assert np.isfinite(triangles.bounds).all()
    assert triangles.is_changed[surrounded].all()
    check_bounds(filled, triangles, np.random.default_rng(0))
