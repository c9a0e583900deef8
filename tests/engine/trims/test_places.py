"""Places of faces: whole numbers over the boxes of parameter curves."""

import numpy as np
from hypothesis import given

from service.bases.arrays import FloatArray
from service.engine.trims.places import SIZE, Places
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import SurfaceTable
from tests.engine.trims.tables import build_surfaces, seeds


def draw_box(surfaces: FaceSurfaces, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Boxes of parameters, some small, some the whole domain."""
    shares = np.sort(rng.choice([0.0, 0.3, 0.31, 0.300001, 0.6, 1.0], (2, len(surfaces), 2)), 0)
    low, high = surfaces.low + shares * (surfaces.high - surfaces.low)
    return low, high


@given(seeds)
def test_surfaces_at_places_are_those_at_parameters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    surfaces = FaceSurfaces.of(build_surfaces(rng, 5))
    places = Places.of(surfaces, *draw_box(surfaces, rng))
    face = rng.integers(0, 5, 12)
    x = rng.integers(0, SIZE + 1, (12, 2))
    x[0], x[1] = 0, SIZE
    for at in (x, np.minimum(x + 0.25, SIZE)):
        parameters = places.to_parameters(face, at)
        np.testing.assert_allclose(places.to_places(face, parameters), at, rtol=0, atol=1e-3)
        partials = places.evaluate_partials(face, at, 2)
        moved = 2 * np.abs(partials[1:3]).max(axis=(0, 2)) + 1e-12
        expected = surfaces.evaluate(face, parameters)
        assert (np.abs(partials[0] - expected).max(axis=1) <= moved).all()
        np.testing.assert_allclose(places.evaluate(face, at), partials[0], rtol=0, atol=1e-11)
    # At real knots of places and parameters alike.
    of_parameters = surfaces.evaluate_partials(face, places.to_parameters(face, x), 1)[1:]
    unit = (places.extent / SIZE)[face].T[..., np.newaxis]
    np.testing.assert_allclose(
        places.evaluate_partials(face, x)[1:] / unit, of_parameters, rtol=1e-4, atol=1e-4
    )


@given(seeds)
def test_boxes_contain_their_parameter_curves_and_few_other_spans(seed: int) -> None:
    rng = np.random.default_rng(seed)
    surfaces = FaceSurfaces.of(build_surfaces(rng, 6))
    low, high = draw_box(surfaces, rng)
    places = Places.of(surfaces, low, high)
    face = np.arange(6)
    assert (places.to_places(face, low) >= -1e-6).all()
    assert (places.to_places(face, high) <= SIZE + 1e-6).all()
    for axis in range(2):
        last = places.first_knot[axis] + places.faces.spans[axis]
        first = places.first_knot[axis]
        knots = places.knots
        assert (knots[first] <= 0).all()
        assert (knots[last] >= SIZE).all()
        assert (knots[first + 1] > 0).all()
        assert (knots[last - 1] < SIZE).all()


def build_curved_strips(knots: FloatArray, count: int = 1) -> SurfaceTable:
    """`count` surfaces of degree (2, 1) with these inner knots along u in [0, 1]."""
    rows = len(knots) + 3
    u = np.concatenate([[0, 0, 0], knots, [1, 1, 1]])
    net = np.zeros((rows, 2, 3))
    # Greville abscissae, so that x is u.
    net[..., 0] = ((u[1 : rows + 1] + u[2 : rows + 2]) / 2)[:, np.newaxis]
    net[:, 1, 1] = 1.0
    net[..., 2] = np.square(net[..., 0])
    return SurfaceTable(
        np.tile([2, 1], (count, 1)),
        np.tile([rows, 2], (count, 1)),
        np.tile(net.reshape(-1, 3), (count, 1)),
        np.ones(count * rows * 2),
        np.zeros(count, bool),
        np.tile(np.concatenate([u, [0, 0, 1, 1]]), count),
    )


def test_knots_of_many_faces_do_not_overflow() -> None:
    surfaces = FaceSurfaces.of(build_curved_strips(np.array([0.25, 0.5]), 20_000))
    low, high = np.zeros((20_000, 2)), np.ones((20_000, 2))
    places = Places.of(surfaces, low, high)
    face = np.array([0, 19_999])
    points = places.evaluate(face, np.full((2, 2), SIZE // 2))
    np.testing.assert_allclose(points[:, :2], 0.5, atol=1e-9)
    begin, end = places.find_spans(face, 0, np.full(2, SIZE // 4), np.full(2, SIZE // 2))
    np.testing.assert_array_equal((begin, end), [[1, 1], [1, 1]])


def test_a_small_face_on_a_large_surface_keeps_its_digits() -> None:
    surfaces = FaceSurfaces.of(build_curved_strips(np.array([0.25, 0.500001, 0.9])))
    low, high = np.array([[0.5, 0.0]]), np.array([[0.500002, 1.0]])
    places = Places.of(surfaces, low, high)
    assert places.extent[0, 0] < 1e-4
    np.testing.assert_array_equal(places.faces.spans, [[2], [1]])
    parameters = np.array([[0.5000005, 0.5]])
    point = places.evaluate(np.zeros(1, np.intp), places.to_places(np.zeros(1, int), parameters))
    np.testing.assert_allclose(point[0, 0], 0.5000005, rtol=0, atol=1e-13)


def test_knots_closer_than_a_unit_have_no_places_between_them() -> None:
    close = 0.5 + np.array([0.0, 2.0**-33, 2.0**-32])
    surfaces = FaceSurfaces.of(build_curved_strips(np.array([0.25, *close, 0.75])))
    places = Places.of(surfaces, np.zeros((1, 2)), np.ones((1, 2)))
    half = SIZE // 2
    begin, end = places.knots_at(np.zeros(6, int), 0, np.arange(6))
    np.testing.assert_array_equal(end - begin, [SIZE // 4, SIZE // 4, 0, 0, SIZE // 4, SIZE // 4])
    face = np.zeros(1, np.intp)
    at_knot = np.array([half])
    assert places.find_spans(face, 0, at_knot, at_knot)[0] == 4
    assert places.find_spans(face, 0, at_knot - 1, at_knot)[1] == 1
    points = places.evaluate(np.zeros(3, int), np.array([[half + k, 0] for k in (-1, 0, 1)]))
    np.testing.assert_allclose(points[:, 0], 0.5, atol=2 / SIZE)
