"""Regions of faces on closed surfaces, by their areas in the parameters."""

from collections.abc import Sequence
from dataclasses import replace
from math import tau

import numpy as np
import pytest
from hypothesis import given

from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.preparation.topology import SEAM
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE
from service.errors import InvalidRequest
from service.surface.spline_tables import CurveTable
from tests.engine.brep.closed_faces import KINDS, LONG, WIDE, Loop, build_face
from tests.engine.trims.tables import seeds

WHOLE = WIDE * LONG


def find_ends(prepared: PreparedBrep) -> tuple[FloatArray, FloatArray]:
    """The parameters (C, 2) at which coedges begin and end, along their loops."""
    every = np.arange(len(prepared.coedge_edges))
    start, end = prepared.edge_ranges[prepared.coedge_edges].T
    scale = (prepared.places.extent / SIZE)[prepared.coedge_faces]
    first, last = (prepared.pcurves.evaluate(every, t) * scale for t in (start, end))
    turn = prepared.coedge_reversed[:, np.newaxis]
    return np.where(turn, last, first), np.where(turn, first, last)


def measure(prepared: PreparedBrep) -> float:
    """The area of the region in the parameters, whose sides are straight; loops are closed."""
    begin, end = find_ends(prepared)
    starts = np.cumsum(prepared.loop_counts) - prepared.loop_counts
    following = np.arange(1, len(begin) + 1)
    following[starts + prepared.loop_counts - 1] = starts
    np.testing.assert_allclose(begin[following], end, rtol=0, atol=1e-9)
    return float((begin[:, 0] * end[:, 1] - begin[:, 1] * end[:, 0]).sum() / 2)


def draw_hole(rng: np.random.Generator, center: FloatArray, room: FloatArray) -> FloatArray:
    """A clockwise polygon, closed, in a box of the size `room`."""
    corners = int(rng.integers(3, 7))
    angles = rng.random() - np.arange(corners + 1) * tau / corners
    radii = room * (0.1 + 0.3 * rng.random(2))
    return center + np.stack([np.cos(angles), np.sin(angles)], axis=1) * radii


def find_area(polygon: FloatArray) -> float:
    """The area of a closed polygon, negative if it is clockwise."""
    x, y = polygon.T
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2)


def draw_wave(rng: np.random.Generator, height: float, begin: float) -> FloatArray:
    """A polygon that runs once around, along +u, near a height."""
    steps = int(rng.integers(1, 5))
    u = begin + np.arange(steps + 1) * WIDE / steps
    v = height + 0.1 * (rng.random(steps + 1) - 0.5)
    v[-1] = v[0]
    return np.stack([u, v], axis=1)


def find_integral(wave: FloatArray) -> float:
    """The area between a wave and v = 0."""
    u, v = wave.T
    return float((np.diff(u) * (v[1:] + v[:-1]) / 2).sum())


@given(seeds)
@pytest.mark.parametrize("kind", KINDS)
def test_holes_and_bands_have_their_areas(kind: str, seed: int) -> None:
    """Holes anywhere, over the seam too; loops around the surface below and above them."""
    rng = np.random.default_rng(seed)
    cells = rng.integers(1, 4, 2)
    offset = np.array([rng.choice([0.0, rng.random() * WIDE]), 0.0])
    low, high = (0.15, LONG - 0.15) if kind != "ring" else (0.0, LONG)
    if kind == "ring":
        offset[1] = rng.random() * LONG
    room = np.array([WIDE, high - low]) / cells
    loops, expected = [], WHOLE
    for i in range(cells[0]):
        for j in range(cells[1]):
            if rng.random() < 0.6:
                center = offset + [0.0, low] + (np.array([i, j]) + 0.5) * room
                loops.append(draw_hole(rng, center, 0.9 * room))
                expected += find_area(loops[-1])
    bands = {"tube": 3, "lens": int(rng.integers(0, 4)), "ring": 0}[kind]
    if bands & 1:
        loops.append(draw_wave(rng, 0.08, rng.random() * WIDE))
        expected -= find_integral(loops[-1])
    if bands & 2:
        wave = draw_wave(rng, LONG - 0.08, rng.random() * WIDE)
        loops.append(wave[::-1])
        expected -= WHOLE - find_integral(wave)
    order = rng.permutation(len(loops))
    polygons: list[Loop] = [[(u, v) for u, v in loops[k].tolist()] for k in order]
    prepared = prepare(build_face(kind, polygons))
    assert measure(prepared) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("middle", [0.0, WIDE / 3, WIDE])
def test_a_hole_whose_sides_have_their_middles_on_the_seam(middle: float) -> None:
    """Sides of degree 2: points at which they are sampled are exactly on the line of the cut."""
    hole = [(-0.5, 0.5), (-0.5, 1.5), (0.5, 1.5), (0.5, 0.5), (-0.5, 0.5)]
    around: list[Loop] = [[(0, 0), (WIDE, 0)], [(WIDE, LONG), (0, LONG)]]
    model = build_face("tube", [*around, [(middle + u, v) for u, v in hole]])
    pcurves = model.pcurves
    ends = pcurves.points.reshape(-1, 2, 2)
    curved = CurveTable(
        pcurves.degrees + 1,
        pcurves.counts + 1,
        np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1).reshape(-1, 2),
        np.ones(3 * len(ends)),
        pcurves.is_rational,
        np.tile([0.0, 0, 0, 1, 1, 1], len(ends)),
    )
    prepared = prepare(replace(model, pcurves=curved))
    assert measure(prepared) == pytest.approx(WHOLE - 1, abs=1e-8)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_band_around_a_ring(axis: int) -> None:
    """Two loops around the same direction, in opposite senses."""
    sizes = (WIDE, LONG)

    def loop(across: float, along: float, sign: int) -> Loop:
        ends = [(along, across), (along + sign * sizes[axis], across)]
        return [end if axis == 0 else (end[1], end[0]) for end in ends]

    # With u along the loop the material is on the left above it, with v below it.
    first, second = (0.4, 1.1) if axis == 0 else (1.1, 0.4)
    prepared = prepare(build_face("ring", [loop(first, 0.3, 1), loop(second, 2.9, -1)]))
    assert measure(prepared) == pytest.approx(0.7 * sizes[axis], abs=1e-8)
    assert (prepared.edge_sources == SEAM).sum() == 1


@pytest.mark.parametrize("kind", KINDS)
def test_a_face_without_loops_is_its_whole_surface(kind: str) -> None:
    prepared = prepare(build_face(kind, []))
    assert measure(prepared) == pytest.approx(WHOLE, abs=1e-9)
    uses = np.bincount(prepared.coedge_edges)
    is_seam = prepared.edge_sources == SEAM
    np.testing.assert_array_equal(uses[is_seam], 2)
    np.testing.assert_array_equal(uses[~is_seam], 1)
    assert is_seam.sum() == {"tube": 1, "lens": 1, "ring": 2}[kind]
    assert prepared.is_degenerate.sum() == (2 if kind == "lens" else 0)
    assert len(prepared.vertices) == {"tube": 2, "lens": 2, "ring": 1}[kind]


def test_a_seam_splits_no_edge_at_a_common_vertex() -> None:
    band: Sequence[Loop] = [[(0.5, 0.3), (0.5 + WIDE, 0.3)], [(0.5 + WIDE, 1.5), (0.5, 1.5)]]
    prepared = prepare(build_face("tube", band))
    assert len(np.unique(prepared.coedge_edges)) == 3
    # With vertices elsewhere, one edge is split.
    moved: Sequence[Loop] = [band[0], [(1.2 + WIDE, 1.5), (1.2, 1.5)]]
    assert len(np.unique(prepare(build_face("tube", moved)).coedge_edges)) == 4


@pytest.mark.parametrize(
    "loops",
    [
        [[(0.0, 0.5), (WIDE, 0.5)]],  # nothing above
        [[(0.5, 0.5), (0.5, 1.0), (1.0, 1.0), (0.5, 0.5)]],  # a hole without a border about it
    ],
)
def test_material_without_a_border_is_refused(loops: Sequence[Loop]) -> None:
    with pytest.raises(InvalidRequest) as caught:
        prepare(build_face("tube", loops))
    assert caught.value.issues[0].code == "loop_reversed"
    assert caught.value.issues[0].pointer == "/faces/0/loops/0"
    assert not prepare(build_face("tube", loops, skips=True)).loop_counts.size
