"""Channels of surfaces: which are refused, how they are copied, and how they are lowered."""

from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.exact import surface_point, to_exact_net
from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from service.errors import InvalidRequest
from service.surface.batches import Channel
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.channel_values import MAX_ATTRIBUTES
from service.surface.channels import MAX_DIMENSION, MAX_NUMBERS, Channels, keep_channels
from service.surface.checks import MAX_DEGREE
from service.surface.patches import PatchSurface
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

SQUARE = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
ONE = np.ones((1, 1, 1))


def read_issue(**channels: Any) -> tuple[str, str]:
    """Code and pointer of the only issue."""
    with pytest.raises(InvalidRequest) as caught:
        BezierSurface(SQUARE, channels=Channels(**channels))
    (issue,) = caught.value.issues
    return issue.code, issue.pointer


@pytest.mark.parametrize(
    ("colors", "code", "pointer"),
    [
        ([[[1.0, 0]]], "wrong_dimension", "/colors"),
        ([[[1.0, 0, 0, 1, 0]]], "wrong_dimension", "/colors"),
        ([[[1.0, 0, 0], [1, 0, 1.5]]], "out_of_range", "/colors/0/1/2"),
        ([[[1.0, -0.01, 0]]], "out_of_range", "/colors/0/0/1"),
        ([[[1.0, np.nan, 0]]], "not_finite", "/colors/0/0/1"),
        (np.ones((1, 3)), "channel_shape", "/colors"),
        (np.ones((MAX_DEGREE + 2, 1, 3)), "degree_too_high", "/colors"),
        (np.ones((0, 1, 3)), "wrong_dimension", "/colors"),
    ],
)
def test_invalid_colors_are_refused(colors: Any, code: str, pointer: str) -> None:
    assert read_issue(colors=np.array(colors)) == (code, pointer)


def test_invalid_texture_coordinates_are_refused() -> None:
    assert read_issue(uvs=np.ones((2, 2, 3))) == ("wrong_dimension", "/uvs")
    assert read_issue(uvs=np.array([[[1e39, 0]]])) == ("coordinate_too_large", "/uvs/0/0/0")


def test_invalid_attributes_are_refused() -> None:
    too_many_columns = np.ones((1, 1, MAX_DIMENSION + 1))
    assert read_issue(attributes=(("a", too_many_columns),)) == ("wrong_dimension", "/attributes/a")
    infinite_value = np.array([[[0.0], [np.inf]]])
    assert read_issue(attributes=(("a", infinite_value),)) == ("not_finite", "/attributes/a/0/1/0")


@pytest.mark.parametrize("name", ["", "1st", "_x", "a b", "ä", "a/b", "a" * 33, "a\n"], ids=repr)
def test_invalid_names_of_attributes_are_refused(name: str) -> None:
    code, pointer = read_issue(attributes=((name, ONE),))
    assert code == "wrong_value"
    assert len(pointer) < 64  # long names are shortened


@pytest.mark.parametrize(
    ("names", "refused_name"),
    # glTF writes names in upper case, and splits a long attribute `b` into `B_0`, `B_1`, ….
    [(("temp", "TEMP"), "TEMP"), (("flow", "Flow_0"), "Flow_0"), (("b_12", "b"), "b_12")],
)
def test_names_that_formats_could_not_distinguish_are_refused(
    names: tuple[str, ...], refused_name: str
) -> None:
    attributes = tuple((name, ONE) for name in names)
    assert read_issue(attributes=attributes) == ("name_clash", f"/attributes/{refused_name}")


def test_the_number_of_attributes_is_limited() -> None:
    attributes = tuple((f"a{k}", ONE) for k in range(MAX_ATTRIBUTES + 1))
    assert len(Channels(attributes=attributes[1:]).attributes) == MAX_ATTRIBUTES
    assert read_issue(attributes=attributes) == ("wrong_length", "/attributes")


def test_channels_of_patches_need_one_value_for_each_vertex() -> None:
    vertices, index = SQUARE.reshape(4, 3), np.arange(4).reshape(1, 2, 2)
    for colors in (np.ones((3, 3)), np.ones((5, 3)), np.ones((2, 2, 3))):
        with pytest.raises(InvalidRequest) as caught:
            PatchSurface(vertices, index, channels=Channels(colors))
        assert [(i.code, i.pointer) for i in caught.value.issues] == [("channel_shape", "/colors")]


def test_channel_values_that_too_many_patches_share_are_refused() -> None:
    """A small document could otherwise need much memory, when values are copied to the patches."""
    vertices = SQUARE.reshape(4, 3)
    # Every patch gets values of 16 numbers at its 4 control points.
    patches = np.zeros((MAX_NUMBERS // (4 * 16) + 1, 2, 2), dtype=np.int64)
    with pytest.raises(InvalidRequest) as caught:
        PatchSurface(vertices, patches, channels=Channels(attributes=(("a", np.ones((4, 16))),)))
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("too_many_values", "/attributes/a")
    fewer_values = Channels(attributes=(("a", np.ones((4, 15))),))
    assert PatchSurface(vertices, patches, channels=fewer_values).channels is fewer_values


def test_values_are_copied_and_read_only() -> None:
    array = np.zeros((1, 1, 3))
    colors = Channels(array).colors
    array[:] = 1
    assert colors is not None
    assert not colors.any()
    assert not colors.flags.writeable


def test_keep_channels_drops_channels_of_other_kinds() -> None:
    channels = Channels(np.ones((1, 1, 3)), np.ones((1, 1, 2)), (("a", ONE), ("b", ONE)))
    model = BezierSurface(SQUARE, channels=channels).lower()
    assert keep_channels(model, lambda _: True) is model
    for kind, names in (("attribute", ["a", "b"]), ("uvs", ["uvs"]), ("none", [])):
        (batch,) = keep_channels(model, partial(_has_kind, kind)).batches
        assert [channel.name for channel in batch.channels] == names


def _has_kind(kind: str, channel: Channel) -> bool:
    return channel.kind == kind


small_knots = knot_vectors(st.integers(1, 4), max_spans=3)


def build_spline(
    u: KnotVector, v: KnotVector, channels: Channels, is_rational: bool
) -> BsplineSurface:
    net = random_points(u.point_count, 7, v.point_count)
    weights = random_weights(u.point_count, 8, v.point_count) if is_rational else None
    degree, knots = (u.degree, v.degree), (u.knots, v.knots)
    return BsplineSurface(net, degree, knots, weights, channels=channels)


@given(small_knots, small_knots, st.booleans())
def test_a_channel_with_the_shape_of_the_control_net_is_a_spline_without_weights(
    u: KnotVector, v: KnotVector, is_rational: bool
) -> None:
    """The attribute `position` is the control net, so its values are points of the surface."""
    # The control net that `build_spline` makes.
    net = random_points(u.point_count, 7, v.point_count)
    channels = Channels(
        attributes=(("position", net), ("wide", np.concatenate([net, net], axis=2)))
    )
    (batch,) = build_spline(u, v, channels, is_rational).lower().batches
    (plain,) = build_spline(u, v, Channels(), is_rational=False).lower().batches
    position, wide = (channel.nets for channel in batch.channels)
    np.testing.assert_array_equal(position, plain.points)
    np.testing.assert_array_equal(wide, np.concatenate([position, position], axis=3))


@given(small_knots, small_knots, st.data())
def test_a_channel_of_another_shape_is_one_bezier_net_over_the_domain(
    u: KnotVector, v: KnotVector, data: st.DataObject
) -> None:
    """Values at all vertices of a mesh agree with exact de Casteljau at their parameters."""
    shape = data.draw(st.tuples(st.integers(1, 6), st.integers(1, 6)))
    if shape == (u.point_count, v.point_count):
        shape = (7, 1)  # no control net has one column
    net = np.random.default_rng(shape).random((*shape, 2))
    model = build_spline(u, v, Channels(attributes=(("heat", net),)), is_rational=True).lower()
    assert model.domain is not None
    mesh = tessellate(model, MeshOptions((2, 2), uvs=True))
    ((_, heat),) = mesh.attributes
    assert mesh.uvs is not None
    low = model.domain.u[0], model.domain.v[0]
    high = model.domain.u[-1], model.domain.v[-1]
    exact = to_exact_net(net)
    for place, result in zip(mesh.uvs.tolist(), heat, strict=True):
        t = [
            (Fraction(x) - Fraction(float(a))) / (Fraction(float(b)) - Fraction(float(a)))
            for x, a, b in zip(place, low, high, strict=True)
        ]
        expected = surface_point(exact, min(t[0], Fraction(1)), min(t[1], Fraction(1)))
        np.testing.assert_allclose(result, [float(x) for x in expected], atol=1e-13)


def test_channels_of_splines_of_too_high_degree_or_with_too_many_values_are_refused() -> None:
    """The limit of degrees is for channels that are Bézier nets.

    The limit of values is for the nets of all patches, and for the matrices that restrict a net to
    the spans: here both have 2100 × 64² numbers.
    """
    random = np.random.default_rng(1)
    net = random.random((MAX_DEGREE + 10, 4, 3))
    assert BsplineSurface(net, channels=Channels(net)).lower().batches[0].channels
    with pytest.raises(InvalidRequest) as caught:
        BsplineSurface(net, channels=Channels(net[1:]))
    assert caught.value.issues[0].code == "degree_too_high"
    spans = 2100
    for heat in (np.ones((64, 1, 1)), np.ones((64, 64, 1))):
        with pytest.raises(InvalidRequest) as caught:
            BsplineSurface(
                random.random((spans + 1, 2, 3)),
                (1, 1),
                channels=Channels(attributes=(("h", heat),)),
            )
        (issue,) = caught.value.issues
        assert (issue.code, issue.pointer) == ("too_many_values", "/attributes/h")
