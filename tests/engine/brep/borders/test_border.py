"""Polygons of loops: closed, shared by faces, renewed without new measures, moved by units."""

import numpy as np
import pytest

from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import build_border, renew_border, shift_corners
from service.engine.brep.borders.border_measure import measure_border
from service.engine.brep.borders.border_vertices import BorderVertices
from service.engine.brep.borders.halving import halve_pieces
from service.engine.brep.borders.sampling import sample_edges
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE
from tests.engine.brep.polygons import build_polygons
from tests.engine.brep.sheets import Against, Curve, Loop, hole, line, prepare_sheets

CUT = Curve([(5, 0), (3, 4), (7, 6), (5, 10)])
LEFT: Loop = [line((0, 0), (5, 0)), CUT, line((5, 10), (0, 10)), line((0, 10), (0, 0))]
RIGHT: Loop = [
    line((5, 0), (10, 0)),
    line((10, 0), (10, 10)),
    line((10, 10), (5, 10)),
    Against(CUT),
]


@pytest.fixture(scope="module")
def prepared() -> PreparedBrep:
    """Two bent faces with a common edge, and a hole in one of them."""
    return prepare_sheets([[LEFT], [RIGHT, hole((8, 5), 1)]], bend=0.02)


def test_both_faces_of_an_edge_have_its_vertices(prepared: PreparedBrep) -> None:
    samples = sample_edges(prepared, 0.05)
    border = build_border(prepared, samples)
    assert (np.diff(border.faces) >= 0).all()
    assert (np.diff(border.loops) >= 0).all()
    np.testing.assert_array_equal(border.ends, border.begins[border.nexts])
    np.testing.assert_array_equal(border.loops, border.loops[border.nexts])
    assert sorted(border.nexts.tolist()) == list(range(len(border.faces)))
    images = np.flatnonzero(np.bincount(border.samples)[border.samples] == 2)
    assert len(images) > 8
    first, second = np.split(
        images[border.samples[images].argsort(kind="stable")].reshape(-1, 2), 2, 1
    )
    np.testing.assert_array_equal(border.begin_vertices[first], border.end_vertices[second])
    np.testing.assert_array_equal(border.end_vertices[first], border.begin_vertices[second])
    # Corners are the points of the surface at the vertices, up to rounded places.
    points = prepared.places.evaluate(border.faces, border.begins)
    assert np.abs(points - samples.positions[border.begin_vertices]).max() < 40 / SIZE


def test_a_renewed_border_is_as_a_new_one(prepared: PreparedBrep) -> None:
    samples, goal = sample_edges(prepared, 0.3), Goal(0.3)
    border = measure_border(prepared, samples, build_border(prepared, samples), goal)
    border = shift_corners(border, np.array([0]), np.array([[1, 0]]))
    assert np.isnan(border.segment_bounds).sum() == 2
    chosen = border.samples[[1, 5, len(border.faces) - 2]]
    halved, source = halve_pieces(prepared, samples, chosen)
    renewed, new = renew_border(prepared, halved, border, source), build_border(prepared, halved)
    for name in ("faces", "loops", "nexts", "coedges", "samples", "rows", "offsets", "places"):
        np.testing.assert_array_equal(getattr(renewed, name), getattr(new, name))
    for name in ("begin_vertices", "end_vertices"):
        np.testing.assert_array_equal(getattr(renewed, name), getattr(new, name))
    moved = (renewed.begins != new.begins).any(axis=1)
    assert moved.sum() == 1
    np.testing.assert_array_equal(renewed.shifts.sum(axis=0), [1, 0])
    kept = ~np.isnan(renewed.segment_bounds)
    assert 0 < kept.sum() < len(border.faces)
    measured = measure_border(prepared, halved, new, goal)
    for name in ("segment_bounds", "sliver_bounds"):
        np.testing.assert_array_equal(getattr(renewed, name)[kept], getattr(measured, name)[kept])


def test_corners_are_numbered_face_by_face() -> None:
    triangle = [(0, 0), (8, 0), (0, 8)]
    twice = [(0, 0), (5, 5), (10, 0), (10, 10), (5, 5), (5, 5), (0, 10)]
    polygons = build_polygons([triangle], [], [twice])
    vertices = BorderVertices.of(polygons, 3)
    assert vertices.faces.tolist() == [0] * 3 + [2] * 5
    assert vertices.offsets.tolist() == [0, 3, 3, 8]
    assert vertices.places.tolist() == [*map(list, triangle), *map(list, dict.fromkeys(twice))]
    # A side without a length has no segment.
    assert vertices.pieces.tolist() == [0, 1, 2, 3, 4, 5, 6, 8, 9]
    assert vertices.segment_offsets.tolist() == [0, 3, 3, 9]
    begins = vertices.places[vertices.segments[:, 0]]
    np.testing.assert_array_equal(begins, polygons.begins[vertices.pieces])
    ends = vertices.places[vertices.segments[:, 1]]
    np.testing.assert_array_equal(ends, polygons.ends[vertices.pieces])
    np.testing.assert_array_equal(
        vertices.vertices[vertices.segments[:, 0]], polygons.begin_vertices[vertices.pieces]
    )
