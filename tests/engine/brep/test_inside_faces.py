"""Parameters in the regions of prepared breps: solids, and faces on closed surfaces."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given

from oracles.regions import build_region, find_turn
from oracles.solids import INVALID, VALID, read_solid
from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED
from service.engine.trims.places import SIZE
from service.engine.trims.surfaces import FaceSurfaces
from tests.engine.brep.closed_faces import KINDS, LONG, WIDE, Loop, build_face
from tests.engine.brep.preparation.test_regions import draw_hole, draw_wave
from tests.engine.brep.solid_documents import lower, strip_seams
from tests.engine.trims.tables import seeds

FACES, POINTS = 4, 30
"""The most faces of a solid that are tested, and points on each of them."""


def ask(prepared: PreparedBrep, parameters: object, face: int = 0) -> list[int]:
    points = np.asarray(parameters, float).reshape(-1, 2)
    regions = prepared.regions
    answers: list[int] = regions.find_inside(np.full(len(points), face), points).inside.tolist()
    return answers


@pytest.mark.slow
@pytest.mark.parametrize("name", [*VALID, INVALID])
def test_solids_agree_with_winding_numbers_in_rationals(name: str) -> None:
    document = read_solid(name)
    prepared = prepare(lower(document))
    regions, whole = prepared.regions, FaceSurfaces.of(prepared.model.surfaces)
    rng = np.random.default_rng(5)
    skipped = {each.face for each in prepared.skipped_faces}
    count = len(document["faces"])
    for face in np.unique(np.linspace(0, count - 1, FACES).astype(int)).tolist():
        is_closed = regions.periods[face] > 0
        low = np.where(is_closed, whole.low[face], np.maximum(whole.low, regions.low)[face])
        high = np.where(is_closed, whole.high[face], np.minimum(whole.high, regions.high)[face])
        if face in skipped:
            assert ask(prepared, whole.low[face], face) == [UNDECIDED]
            continue
        points = low + rng.random((POINTS, 2)) * (high - low)
        answers = np.array(ask(prepared, points, face))
        assert (answers != UNDECIDED).all()
        oracle = build_region(document, face, flatness=3e-3)
        if oracle is None:
            assert (answers == INSIDE).all()
            continue
        is_inside, is_sure = oracle.find_inside(points)
        assert is_sure.mean() > 0.5
        np.testing.assert_array_equal((answers == INSIDE)[is_sure], is_inside[is_sure])


@pytest.mark.parametrize("name", ["tee", "sphere_hole", "torus_cut", "bolt", "cone", "nut"])
def test_edges_alone_give_the_same_regions(name: str) -> None:
    """Without parameter curves, poles and seams these are made; the regions stay."""
    given_curves = prepare(lower(read_solid(name)))
    made = prepare(lower(strip_seams(read_solid(name))))
    rng = np.random.default_rng(6)
    whole = FaceSurfaces.of(made.model.surfaces)
    face = np.repeat(np.arange(len(whole)), 200)
    low, high = whole.low, whole.high
    is_open = made.regions.periods == 0
    low = np.where(is_open, np.maximum(low, made.regions.low), low)
    high = np.where(is_open, np.minimum(high, made.regions.high), high)
    points = low[face] + rng.random((len(face), 2)) * (high - low)[face]
    first, second = (each.regions.find_inside(face, points).inside for each in (given_curves, made))
    differ = np.flatnonzero(first != second)
    assert INSIDE in first
    assert len(differ) <= 1e-3 * len(face)
    # Where they differ, a border is near.
    shift = np.array([[x, y] for x, y in product((-1, 1), repeat=2)]) * 5e-3
    for k in differ:
        near = points[k] + shift * (high - low)[face[k]]
        assert len({*ask(made, near, face[k]), second[k]}) > 1


def _wind(polygon: FloatArray, point: FloatArray) -> int:
    """The winding number of a closed polygon about a point, in rationals."""
    total = 0
    for a, b in pairwise(polygon):
        turn = find_turn(a, b, point)
        total += int(a[1] <= point[1] < b[1] and turn > 0)
        total -= int(b[1] <= point[1] < a[1] and turn < 0)
    return total


def _is_above(wave: FloatArray, point: FloatArray) -> bool:
    u = wave[0, 0] + (point[0] - wave[0, 0]) % WIDE
    return bool(point[1] > np.interp(u, *wave.T))


@pytest.mark.slow
@given(seeds)
@pytest.mark.parametrize("kind", KINDS)
def test_holes_and_bands_of_closed_surfaces(kind: str, seed: int) -> None:
    """Holes anywhere, over the seam too; loops around the surface below and above them."""
    rng = np.random.default_rng(seed)
    low, high = (0.15, LONG - 0.15) if kind != "ring" else (0.0, LONG)
    offset = np.array([rng.random() * WIDE, rng.random() * LONG if kind == "ring" else low])
    cells = rng.integers(1, 4, 2)
    room = np.array([WIDE, high - low]) / cells
    holes = [
        draw_hole(rng, offset + (np.array([i, j]) + 0.5) * room, 0.9 * room)
        for i, j in product(*map(range, cells.tolist()))
        if rng.random() < 0.6
    ]
    loops, waves = list(holes), []
    for height, sign in ((0.08, 1), (LONG - 0.08, -1)) if kind != "ring" else ():
        if kind == "tube" or rng.random() < 0.5:
            wave = draw_wave(rng, height, rng.random() * WIDE)
            waves.append((wave, sign))
            loops.append(wave[::sign])
    polygons: list[Loop] = [[(u, v) for u, v in loop.tolist()] for loop in loops]
    prepared = prepare(build_face(kind, polygons))
    points = rng.random((30, 2)) * [WIDE, LONG]
    shifts = np.array(list(product((-1, 0, 1), (-1, 0, 1) if kind == "ring" else (0,))))
    shifts = shifts * np.array([WIDE, LONG])
    expected = [
        not any(_wind(hole, point + shift) for hole in holes for shift in shifts)
        and all(_is_above(wave, point) == (sign > 0) for wave, sign in waves)
        for point in points
    ]
    assert ask(prepared, points) == [INSIDE if each else OUTSIDE for each in expected]


@pytest.mark.parametrize("kind", KINDS)
def test_seams_and_poles_of_a_whole_surface_are_inside(kind: str) -> None:
    prepared = prepare(build_face(kind, []))
    seam = [[u, v] for u in (0.0, WIDE) for v in (0.1, 0.5, 1.7)]
    assert set(ask(prepared, seam)) == {INSIDE}
    ends = [[u, v] for u in (0.0, 0.4, 2.0, WIDE) for v in (0.0, LONG)]
    assert set(ask(prepared, ends)) == {UNDECIDED if kind == "tube" else INSIDE}


def test_private_seams_are_inside_and_borders_are_not() -> None:
    band: list[Loop] = [[(0.5, 0.3), (0.5 + WIDE, 0.3)], [(1.2 + WIDE, 1.5), (1.2, 1.5)]]
    prepared = prepare(build_face("tube", band))
    seams = prepared.pcurves.evaluate(
        (~prepared.is_border).nonzero()[0], np.full((~prepared.is_border).sum(), 0.5)
    )
    assert len(seams) == 2
    places = prepared.places.to_parameters(np.zeros(2, np.intp), seams)
    u, v = places.T
    assert ask(prepared, np.stack([u % WIDE, v], axis=1)) == [INSIDE, INSIDE]
    for share in np.linspace(0, 1, 7):
        points = [[share * WIDE, v] for v in (0.2, 0.3, 0.4, 1.4, 1.5, 1.6)]
        assert ask(prepared, points) == [0, -1, 1, 1, -1, 0]


def test_a_point_beyond_a_border_is_not_inside_because_a_seam_is_near() -> None:
    """The seam ends at a border: the point is within the margin of the seam, but not of this."""
    low: Loop = [(0, 0.3), (WIDE, 0.3)]
    high: Loop = [(WIDE, 1.5), (0.75 * WIDE, 1.0), (0.5 * WIDE, 1.2), (0.25 * WIDE, 1.9), (0, 1.5)]
    prepared = prepare(build_face("tube", [low, high]))
    unit = prepared.places.extent[0] / SIZE * prepared.regions.margins[0]
    for share, expected in ((0.9, UNDECIDED), (2.0, OUTSIDE)):
        assert ask(prepared, [WIDE - share * unit[0], 1.5 + share * unit[1]]) == [expected]
    assert ask(prepared, [[WIDE - 0.9 * unit[0], 1.4], [WIDE, 1.4]]) == [INSIDE, INSIDE]
