"""The patch and the local parameters of each place, also at knots and at ends of domains."""

from typing import Any

import numpy as np
import pytest

from oracles.exact import split
from service.engine.points.evaluate import evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.errors import InvalidRequest
from service.surface.batches import TensorPatches
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.patches import PatchSurface
from tests.strategies import Array, build_cube, build_mixed_model, build_model

KNOTS_U, KNOTS_V = np.array([-1.0, 0.5, 4.0]), np.array([2.0, 3.0])


def build_pieces() -> tuple[Array, PatchModel]:
    """A net, and a model of its two halves over the domain [−1, 4] × [2, 3], split at u = 1/2."""
    net = np.arange(36.0).reshape(4, 3, 3) ** 1.5
    halves = np.stack(split(net, 0.3))  # u = −1 + 0.3 · 5 = 1/2
    domain = Domain(KNOTS_U, KNOTS_V)
    return net, PatchModel(
        "model", (TensorPatches(halves),), (Part("model", 0, 2),), "y", (domain,)
    )


def test_a_knot_belongs_to_the_span_that_begins_there_and_the_end_to_the_last_span() -> None:
    _, model = build_pieces()
    uv = np.array([[-1, 2], [0.5, 2.5], [np.nextafter(0.5, 0), 2.5], [4, 3], [2.25, 3]])
    result = locate(model, PointsQuery(uv, patch=None, order=0))
    np.testing.assert_array_equal(result.patch, [0, 1, 0, 1, 1])
    np.testing.assert_array_equal(result.local[[0, 1, 3, 4]], [[0, 0], [0, 0.5], [1, 1], [0.5, 1]])
    assert 1 - 1e-15 < result.local[2, 0] <= 1
    np.testing.assert_array_equal(result.widths[:, 0], [1.5, 3.5, 1.5, 3.5, 3.5])


def test_patches_of_a_domain_are_numbered_with_v_fastest() -> None:
    net = np.zeros((6, 2, 2, 3))
    domain = Domain(np.array([0.0, 1, 2]), np.array([0.0, 1, 2, 3]))
    model = PatchModel("model", (TensorPatches(net),), (Part("model", 0, 6),), "y", (domain,))
    uv = np.array([[u + 0.5, v + 0.5] for u in range(2) for v in range(3)])
    np.testing.assert_array_equal(
        locate(model, PointsQuery(uv, patch=None, order=0)).patch, np.arange(6)
    )


def test_partials_are_derivatives_by_the_parameters_of_the_surface() -> None:
    """Compares with the chain rule for the whole net over [0, 1]², u = −1 + 5 t and v = 2 + s."""
    net, model = build_pieces()
    whole_net = build_model([net])
    t, s = np.array([0.1, 0.3, 0.55, 1.0]), np.array([0.0, 0.25, 1.0, 0.5])
    uv = np.stack([-1 + 5 * t, 2 + s], axis=1)
    result = evaluate_points(model, locate(model, PointsQuery(uv, patch=None, order=2)), 2)
    expected = evaluate_points(
        whole_net, locate(whole_net, PointsQuery(np.stack([t, s], axis=1), patch=None, order=2)), 2
    )
    for name, factor in (("positions", 1), ("du", 5), ("dv", 1), ("duu", 25), ("duv", 5)):
        np.testing.assert_allclose(result[name] * factor, expected[name], atol=1e-9, err_msg=name)
    for name in ("normals", "gaussian_curvature", "mean_curvature", "principal_curvatures"):
        np.testing.assert_allclose(result[name], expected[name], atol=1e-9, err_msg=name)


def test_patches_are_numbered_as_in_the_request() -> None:
    """The model has its patches in another order, because of parts and batches."""
    vertices = np.concatenate([face.reshape(-1, 3) for face in build_cube()])
    grids = np.arange(24).reshape(6, 2, 2)
    surface = PatchSurface(vertices, grids, parts=(("odd", (5, 1, 3)), ("two", (2,))))
    model = surface.lower()
    middles_query = PointsQuery(np.full((6, 2), 0.5), np.arange(6), 0)
    middles = evaluate_points(model, locate(model, middles_query), 0)["positions"]
    np.testing.assert_array_equal(middles, vertices[grids].mean(axis=(1, 2)))
    fifth_patch = PointsQuery(np.full((2, 2), 0.5), np.array(4), 0)
    positions = evaluate_points(model, locate(model, fifth_patch), 0)["positions"]
    np.testing.assert_array_equal(positions, middles[[4, 4]])


def list_refusals(model: PatchModel, uv: Any, patch: Any = None) -> list[tuple[str, str]]:
    """(code, pointer) of each issue with which a query is refused."""
    query = PointsQuery(np.array(uv, dtype=float), None if patch is None else np.array(patch), 0)
    with pytest.raises(InvalidRequest) as caught:
        locate(model, query)
    return [(issue.code, issue.pointer) for issue in caught.value.issues]


def test_invalid_parameters_and_patch_numbers_are_refused() -> None:
    _, model = build_pieces()
    outside = [[-1, 2], [-1.1, 2], [4, 3.5], [0, 2], [5, 0]]
    assert list_refusals(model, outside) == [
        ("outside_domain", f"/uv/{place}") for place in ("1/0", "2/1", "4/0", "4/1")
    ]
    assert list_refusals(model, [[0, 2]], 0) == [("unexpected_patch", "/patch")]
    cube = build_model(build_cube())
    assert list_refusals(cube, [[0, 0], [0.5, 1.5]], [0, 0]) == [("outside_domain", "/uv/1/1")]
    assert list_refusals(cube, [[0, 0]]) == [("missing_field", "/patch")]
    assert list_refusals(cube, [[0, 0], [0, 0]], [0]) == [("wrong_length", "/patch")]
    assert list_refusals(cube, [[0, 0], [0, 0]], [0, 6]) == [("index_out_of_range", "/patch/1")]
    assert list_refusals(cube, [[0, 0], [0, 0]], -1) == [("index_out_of_range", "/patch")]
    # An error lists at most 20 issues.
    assert len(list_refusals(cube, np.full((50, 2), 2.0), 0)) == 20


def test_triangles_take_barycentric_places_and_grids_take_uv() -> None:
    square, triangle = np.zeros((2, 2, 3)), np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 8]])
    model = build_mixed_model([square, triangle])
    # The sum of coordinates may differ from 1 by 1e-9.
    places = np.array([[0.5, 0.25, 0.25], [0, 0, 1], [1 + 5e-10, 0, 0]])
    result = locate(model, PointsQuery(places, np.array(1), 0))
    np.testing.assert_allclose(result.local, places[:, 1:], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(evaluate_points(model, result, 0)["positions"][0], [1, 1, 2])
    assert list_refusals(model, places[:1], [0]) == [("wrong_parameters", "/barycentric/0")]
    assert list_refusals(model, [[0, 0], [0, 0]], [0, 1]) == [("wrong_parameters", "/uv/1")]
    # The first is valid. The others do not have the sum 1, or have a negative coordinate.
    barycentric = [[1, 0, 0], [0.5, 0.5, 1e-8], [0.5, 0.5, -1e-12], [0.5, 0.6, 0]]
    assert list_refusals(model, barycentric, 1) == [
        ("outside_domain", f"/barycentric/{row}") for row in (1, 2, 3)
    ]
    assert list_refusals(build_model([square]), places[:1]) == [
        ("wrong_parameters", "/barycentric/0")
    ]
    _, pieces = build_pieces()
    assert list_refusals(pieces, places[:1]) == [("wrong_parameters", "/barycentric/0")]


def test_a_parameter_beyond_an_end_by_a_few_roundings_is_the_end() -> None:
    """`3 * 0.1 / 0.3` exceeds 1 by a rounding; 1e-9 beyond the end is outside."""
    _, pieces = build_pieces()
    above, below = np.nextafter(4, 5), np.nextafter(np.nextafter(-1, -2), -2)
    result = locate(pieces, PointsQuery(np.array([[above, 3], [below, 2]]), patch=None, order=0))
    np.testing.assert_array_equal(result.patch, [1, 0])
    np.testing.assert_array_equal(result.local, [[1, 1], [0, 0]])
    patches = build_model([np.zeros((2, 2, 3))] * 2)
    uv = np.array([[1 + 4e-16, -2e-16]])
    local = locate(patches, PointsQuery(uv, patch=np.array(1), order=0)).local
    np.testing.assert_array_equal(local, [[1, 0]])
    for outside in ([[1 + 1e-9, 0.5]], [[0.5, -1e-14]]):
        with pytest.raises(InvalidRequest):
            locate(patches, PointsQuery(np.array(outside), patch=np.array(0), order=0))
