"""Points of difficult nets: only numbers and nulls, without exceptions or warnings."""

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.encoders import json_points
from service.engine.points.evaluate import evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, Part, PatchModel
from tests.strategies import Array, degenerate_nets, triangle_nets, weights_like

WIDE = np.array([0.0, 1e-200]), np.array([-1e300, 1e300])
"""Domains in which the chain rule leaves float64."""

steps = st.lists(st.tuples(*[st.sampled_from([0, 1, 5, 8])] * 2), min_size=1, max_size=4)
scales = st.sampled_from([1.0, 1e-300, 1e-30, 1e30, 3e38])


def check(model: PatchModel, query: PointsQuery) -> None:
    result = evaluate_points(model, locate(model, query), query.order)
    assert np.isfinite(result["positions"]).all()
    np.testing.assert_allclose(np.linalg.norm(result["normals"], axis=1), 1, atol=1e-12)
    content = json_points.encode(result)
    assert len(content) <= json_points.byte_bound(len(query.places), query.order)
    assert set(orjson.loads(content)) == set(result)


def build_model(batch: Patches, domain: Domain | None = None) -> PatchModel:
    domains = () if domain is None else (domain,)
    return PatchModel("model", (batch,), (Part("model", 0, 1),), "y", domains)


def scale_net(net: Array, scale: float) -> Array:
    """The net with its largest coordinate brought to `scale`, nearly."""
    return net[None] * (scale / 8)


@given(degenerate_nets(), steps, scales, st.data())
def test_degenerate_patches(
    net: Array, places: list[tuple[int, int]], scale: float, data: st.DataObject
) -> None:
    weights = data.draw(st.none() | weights_like(net))
    batch = TensorPatches(scale_net(net, scale), None if weights is None else weights[None])
    uv = np.array(places) / 8
    check(build_model(batch), PointsQuery(uv, None, 2))
    beside = np.clip(uv + 1e-9, 0, 1)
    check(build_model(batch), PointsQuery(beside, None, 2))


@given(triangle_nets(), steps, scales, st.data())
def test_degenerate_triangles(
    net: Array, places: list[tuple[int, int]], scale: float, data: st.DataObject
) -> None:
    net = net.copy()
    net[data.draw(st.lists(st.integers(0, len(net) - 1)))] = net[0]
    weights = data.draw(st.none() | weights_like(net))
    batch = TrianglePatches(scale_net(net, scale), None if weights is None else weights[None])
    rst = np.array([(16 - a - b, a, b) for a, b in places]) / 16
    check(build_model(batch), PointsQuery(rst, None, 2))


@pytest.mark.parametrize("wide", WIDE, ids=["narrow", "wide"])
def test_partials_beyond_double_precision_are_null(wide: Array) -> None:
    net = np.random.default_rng(1).standard_normal((1, 3, 3, 3)) * 1e30
    model = build_model(TensorPatches(net), Domain(wide, np.array([0.0, 1.0])))
    uv = np.array([[wide[0], 0.5], [wide[1], 1.0]])
    check(model, PointsQuery(uv, None, 2))
