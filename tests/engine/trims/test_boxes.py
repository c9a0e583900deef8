"""Boxes of parts: about their faces, whatever surfaces carry them."""

import numpy as np
from hypothesis import given

from service.engine.trims.boxes import find_part_box
from service.engine.trims.places import Places
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import SurfaceTable
from tests.engine.trims.tables import build_surfaces, seeds
from tests.engine.trims.test_places import build_curved_strips, draw_box


@given(seeds)
def test_the_box_contains_the_faces_and_is_in_the_box_of_their_nets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = build_surfaces(rng, 4)
    surfaces = FaceSurfaces.of(table)
    low, high = draw_box(surfaces, rng)
    places = Places.of(surfaces, low, high)
    face = np.arange(4)
    ends = [places.to_places(face, end) for end in (low, high)]
    vertex = surfaces.evaluate(face[:1], low[:1])
    box = find_part_box(places, *ends, vertex)
    faces = np.repeat(face, 20)
    parameters = low[faces] + rng.random((80, 2)) * (high - low)[faces]
    points = surfaces.evaluate(faces, parameters)
    assert (box[0] <= points.min(axis=0) + 1e-6).all()
    assert (points.max(axis=0) - 1e-6 <= box[1]).all()
    assert (table.points.min(axis=0) - 1e-9 <= box[0]).all()
    assert (box[1] <= table.points.max(axis=0) + 1e-9).all()


def test_a_face_on_a_larger_surface_has_the_same_box() -> None:
    boxes = []
    for knots in (np.array([0.25, 0.5]), np.array([0.25, 0.5, 0.75])):
        surfaces = FaceSurfaces.of(build_curved_strips(knots))
        low, high = np.array([[0.25, 0.0]]), np.array([[0.4, 1.0]])
        places = Places.of(surfaces, low, high)
        face = np.zeros(1, np.intp)
        ends = [places.to_places(face, end) for end in (low, high)]
        boxes.append(find_part_box(places, *ends, np.full((1, 3), 0.3)))
    np.testing.assert_allclose(boxes[0], boxes[1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(boxes[0][1][:2], [0.4, 1.0], rtol=0, atol=1e-9)


def test_faces_without_curves_do_not_count() -> None:
    table = build_curved_strips(np.array([0.5]), 2)
    surfaces = FaceSurfaces.of(
        SurfaceTable(
            table.degrees,
            table.counts,
            table.points + np.repeat([0.0, 50.0], len(table.points) // 2)[:, np.newaxis],
            table.weights,
            table.is_rational,
            table.knots,
        )
    )
    low, high = np.array([[0.0, 0.0], [np.inf, np.inf]]), np.array([[1.0, 1.0], [-np.inf, -np.inf]])
    places = Places.of(surfaces, low, high)
    scaled = low * 2.0**30, high * 2.0**30
    box = find_part_box(places, *scaled, np.zeros((1, 3)))
    assert box[1].max() <= 1.0
