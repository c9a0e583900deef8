"""Bounds by the nearest triangles of a mesh that is on the surface, but not at its own places."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.filling import nearest
from service.engine.brep.filling.measure import TriangleMeasure
from service.engine.brep.filling.nearest import NearestMeasure
from service.engine.brep.filling.neighbours import Neighbours
from service.engine.brep.filling.triangles import build_triangles, find_mates
from service.engine.trims.places import SIZE
from service.errors import TooLarge
from tests.engine.brep.filled_faces import (
    CYLINDER,
    UNIT,
    FilledFaces,
    draw_inner_places,
    fill,
)
from tests.engine.brep.filling.exact_distances import check_bounds

seeds = st.integers(0, 2**32 - 1)


def shift(filled: FilledFaces, rng: np.random.Generator, most: int) -> None:
    """Move the points inside along the surface, by up to `most` places."""
    corners = filled.corners
    inner = np.arange(corners.on_border, len(corners.places))
    moved = corners.places[inner] + rng.integers(-most, most + 1, (len(inner), 2))
    points = corners.surface.evaluate(corners.faces[inner], np.clip(moved, 0, SIZE))
    corners.positions[corners.points[inner]] = points


def build_neighbours(filled: FilledFaces, own: Ints) -> Neighbours:
    mates, fixed = find_mates(own), filled.corners.find_fixed(own)
    return Neighbours(filled.corners.points, own, np.where(fixed, -1, mates.beyond))


def bound(
    filled: FilledFaces, own: Ints, allowed: float, limits: MeshLimits | None = None
) -> FloatArray:
    """The bounds of all triangles."""
    measure = NearestMeasure(
        filled.corners, build_neighbours(filled, own), Goal(allowed), limits or MeshLimits()
    )
    return measure.bound(np.arange(own.shape[1]), np.full(own.shape[1], allowed))


def grid() -> FilledFaces:
    """Squares without holes on three faces, with points in rows inside."""
    side = [(0, 0), (16, 0), (16, 16), (0, 16)]
    filled = fill([side], [side], [side])
    steps = np.arange(2, 16, 2) * UNIT
    places = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    filled.insert(np.arange(3).repeat(len(places)), np.tile(places, (3, 1)))
    return filled


@pytest.mark.slow
@given(seeds)
def test_no_point_is_further_than_the_bound_by_the_nearest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, int(rng.integers(0, 12))))
    shift(filled, rng, 2 * UNIT)
    own, allowed = filled.read(), float(rng.choice([0.05, 0.3, 1.5]))
    bounds = bound(filled, own, allowed)
    assert (bounds[np.isfinite(bounds)] <= allowed).all()
    triangles = replace(build_triangles(own, bounds), bounds=bounds)
    check_bounds(filled, triangles, rng)


def test_a_mesh_on_the_surface_is_near_it_whatever_its_places() -> None:
    filled = grid()
    shift(filled, np.random.default_rng(3), UNIT // 2)
    own, allowed = filled.read(), 0.03
    near = bound(filled, own, allowed)
    inside = ~filled.corners.find_fixed(own).any(axis=0)
    inside &= filled.corners.faces[own[0]] == CYLINDER
    assert (near[inside] <= allowed).mean() > 0.9
    # Their own triangles and the neighbours are too far from many.
    measure = TriangleMeasure(
        filled.corners, np.full(3, 1e-9), np.zeros(3), Goal(1e-9), MeshLimits()
    )
    alone = measure.measure(measure.build(own), find_mates(own)).bounds
    assert (alone[inside] > allowed).mean() > 0.2
    # The measurement of all triangles takes the lesser bound.
    measure = TriangleMeasure(
        filled.corners, np.full(3, allowed), np.zeros(3), Goal(allowed), MeshLimits()
    )
    both = measure.measure(measure.build(own), find_mates(own))
    assert both.bounds[inside] == pytest.approx(np.minimum(alone, near)[inside])
    assert both.is_wide[inside & (alone > allowed) & (near <= allowed)].all()


def test_a_mesh_far_from_the_surface_is_given_up_after_one_look(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    filled = grid()
    filled.corners.positions[:, 2] += 10.0
    # The middles of pieces are tried first, so nothing is measured.
    monkeypatch.setattr(nearest, "PieceMeasure", None)
    assert np.isinf(bound(filled, filled.read(), 0.5)).all()


def test_pieces_are_not_divided_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    filled = grid()
    own = filled.read()
    enough = bound(filled, own, 0.02)
    monkeypatch.setattr(nearest, "HALVINGS", 0)
    at_once = bound(filled, own, 0.02)
    assert np.isinf(at_once[np.isinf(enough)]).all()
    monkeypatch.setattr(nearest, "HALVINGS", 12)
    monkeypatch.setattr(nearest, "MOST", 0)
    again = bound(filled, own, 0.02)
    assert np.array_equal(np.isinf(again), np.isinf(at_once))


def test_the_work_is_limited() -> None:
    with pytest.raises(TooLarge):
        bound(grid(), grid().read(), 0.05, MeshLimits(effort=Effort(limit=1e4)))


def test_triangles_at_the_corners_are_listed_once() -> None:
    filled = fill()
    filled.insert(*draw_inner_places(filled, np.random.default_rng(5), 9))
    own = filled.read()
    # Flat triangles are not in the mesh.
    filled.corners.points[own[0, 4]] = filled.corners.points[own[1, 4]]
    points = filled.corners.points[own]
    flat = np.array([len(set(points[:, t].tolist())) < 3 for t in range(own.shape[1])])
    assert flat[4]
    rows = np.array([7, 2, 4])
    starts, triangles = build_neighbours(filled, own).list_around(rows)
    for i, row in enumerate(rows):
        shares = np.isin(own, own[:, row]).any(axis=0) & ~flat
        assert triangles[starts[i] : starts[i + 1]].tolist() == shares.nonzero()[0].tolist()
