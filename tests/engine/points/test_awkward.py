"""Points of degenerate and extreme surfaces: finite numbers or null, without warnings."""

from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.encoders.json_mesh import points_bound
from service.encoders.text import json_document
from service.engine.points.evaluate import evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, Part, PatchModel
from tests.strategies import Array, degenerate_nets, triangle_nets, weights_like

NARROWEST_DOMAIN, WIDEST_DOMAIN = np.array([0.0, 1e-200]), np.array([-1e300, 1e300])
"""Second partials by parameters of these domains are too large, and too small, for float64."""

whole_places = st.lists(st.tuples(*[st.sampled_from([0, 1, 5, 8])] * 2), min_size=1, max_size=4)
"""Places (u, v) in eighths or, on triangles, (s, t) in sixteenths."""

scales = st.sampled_from([1.0, 1e-300, 1e-30, 1e30, 3e38])


def check_columns(model: PatchModel, query: PointsQuery) -> dict[str, Any]:
    """Checks that positions are finite, normals are unit vectors, and columns are valid JSON.

    Returns the columns of the JSON.
    """
    result = evaluate_points(model, locate(model, query), query.order)
    assert np.isfinite(result["positions"]).all()
    np.testing.assert_allclose(np.linalg.norm(result["normals"], axis=1), 1, atol=1e-12)
    content = json_document(result)
    assert len(content) <= points_bound(len(query.places), query.order)
    columns: dict[str, Any] = orjson.loads(content)
    assert set(columns) == set(result)
    return columns


def build_model(batch: Patches, domain: Domain | None = None) -> PatchModel:
    """A model of one batch."""
    domains = () if domain is None else (domain,)
    return PatchModel("model", (batch,), (Part("model", 0, 1),), "y", domains)


def scale_net(net: Array, scale: float) -> Array:
    """A batch of one net, (1, …), scaled: a net of size 8 gets the size `scale`."""
    return net[None] * (scale / 8)


@given(degenerate_nets(), whole_places, scales, st.data())
def test_points_of_degenerate_patches_are_valid(
    net: Array, places: list[tuple[int, int]], scale: float, data: st.DataObject
) -> None:
    weights = data.draw(st.none() | weights_like(net))
    batch = TensorPatches(scale_net(net, scale), None if weights is None else weights[None])
    uv = np.array(places) / 8
    check_columns(build_model(batch), PointsQuery(uv, patch=None, order=2))
    nearby = np.clip(uv + 1e-9, 0, 1)
    check_columns(build_model(batch), PointsQuery(nearby, patch=None, order=2))


@given(triangle_nets(), whole_places, scales, st.data())
def test_points_of_degenerate_triangles_are_valid(
    net: Array, places: list[tuple[int, int]], scale: float, data: st.DataObject
) -> None:
    net = net.copy()
    net[data.draw(st.lists(st.integers(0, len(net) - 1)))] = net[0]
    weights = data.draw(st.none() | weights_like(net))
    batch = TrianglePatches(scale_net(net, scale), None if weights is None else weights[None])
    rst = np.array([(16 - a - b, a, b) for a, b in places]) / 16
    check_columns(build_model(batch), PointsQuery(rst, patch=None, order=2))


@pytest.mark.parametrize(
    ("knots", "duu"), [(NARROWEST_DOMAIN, None), (WIDEST_DOMAIN, 0.0)], ids=["narrow", "wide"]
)
def test_partials_too_large_for_float64_are_null_and_too_small_ones_are_zero(
    knots: Array, duu: float | None
) -> None:
    net = np.random.default_rng(1).standard_normal((1, 3, 3, 3)) * 1e30
    model = build_model(TensorPatches(net), Domain(knots, np.array([0.0, 1.0])))
    uv = np.array([[knots[0], 0.5], [knots[1], 1.0]])
    columns = check_columns(model, PointsQuery(uv, patch=None, order=2))
    assert columns["duu"] == [[duu] * 3] * 2
