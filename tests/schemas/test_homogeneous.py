"""Homogeneous control points and weights of 0, against nets in exact rational arithmetic."""

import math
from contextlib import suppress
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from oracles import exact, splines, triangles
from service.errors import InvalidRequest
from service.schemas.curves import CurveRequest
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits
from service.schemas.request import MeshRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.patches import PatchSurface

U = 2.0**-53
PARAMETERS = (Fraction(0), Fraction(2, 7), Fraction(1, 2), Fraction(9, 10), Fraction(1))
GRID = tuple(product(PARAMETERS, PARAMETERS))

STRIP: dict[str, Any] = {
    "control_net": [[[-1, 0, 0], [-1, 0, 1]], [[0, 1, 0], [0, 1, 1]], [[1, 0, 0], [1, 0, 1]]],
    "weights": [[1, 1], [0, 0], [1, 1]],
}
HALF_CYLINDER: dict[str, Any] = {
    "homogeneous": True,
    "control_net": [
        [[1, 0, 0, 1], [1, 0, 2, 1]], [[0, 1, 0, 0], [0, 1, 0, 0]], [[-1, 0, 0, 1], [-1, 0, 2, 1]],
    ],
}  # fmt: skip


def build(_limits: DocumentLimits = DEFAULT_LIMITS, **surface: Any) -> Any:
    return validate_document(MeshRequest, {"surface": surface}, _limits).to_surface()


def build_curve(**curve: Any) -> Any:
    return validate_document(CurveRequest, {"curve": curve}).to_curve()


def refuse(**surface: Any) -> tuple[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        build(**surface)
    issue = caught.value.issues[0]
    return issue.code, issue.pointer


def divide(point: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
    return tuple(x / point[-1] for x in point[:-1])


def to_homogeneous(points: Any, weights: Any) -> Any:
    """Exact only if the products are."""
    points, weights = np.asarray(points, float), np.asarray(weights, float)[..., np.newaxis]
    return np.concatenate([points * weights, weights], axis=-1)


def assert_is_near(surface: BezierSurface, net: Any, *, steps: int) -> None:
    """The surface is that of the homogeneous net up to the stated error."""
    net = np.asarray(net, float)
    assert surface.weights is not None
    raised, own = exact.to_exact_net(surface.control_net, surface.weights), exact.to_exact_net(net)
    largest = np.abs(net).max()
    for u, v in GRID:
        expected = exact.surface_point(own, u, v)
        got = exact.surface_point(raised, u, v)
        bound = (4 * steps + 8) * U * largest / float(expected[3])
        bound *= 1 + max(abs(float(x)) for x in divide(expected))
        for x, y in zip(divide(got), divide(expected), strict=True):
            assert abs(float(x - y)) <= bound


def test_a_point_of_weight_0_does_not_pull() -> None:
    surface = build(**STRIP)
    assert surface.degree == (3, 1)
    assert (surface.control_net[..., 1] == 0).all()
    assert (surface.weights > 0).all()
    assert_is_near(surface, to_homogeneous(STRIP["control_net"], STRIP["weights"]), steps=1)


def test_a_direction_makes_a_half_circle() -> None:
    surface = build(**HALF_CYLINDER)
    net = exact.to_exact_net(surface.control_net, surface.weights)
    for u, v in GRID:
        x, y, z = divide(exact.surface_point(net, u, v))
        assert abs(float(x * x + y * y) - 1) < 1e-15
        assert z == 2 * v
    assert_is_near(surface, HALF_CYLINDER["control_net"], steps=1)


def test_positive_weights_are_divided_without_raising() -> None:
    net = np.array([[[2, 0, 0, 2.0], [0, 3, 0, 1]], [[4, 0, 4, 4], [1, 1, 0, 0.5]]])
    surface = build(homogeneous=True, control_net=net.tolist())
    assert surface.degree == (1, 1)
    assert np.array_equal(surface.control_net, net[..., :3] / net[..., 3:])
    assert np.array_equal(surface.weights, net[..., 3])


def test_homogeneous_false_is_the_same_as_no_field() -> None:
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
    assert build(homogeneous=False, control_net=net).weights is None


def test_only_the_direction_that_needs_it_is_raised() -> None:
    net = np.ones((3, 4, 4))
    net[..., :3] = np.arange(36).reshape(3, 4, 3)
    net[1, :, 3] = 0
    assert build(homogeneous=True, control_net=net.tolist()).degree == (3, 3)
    assert build(homogeneous=True, control_net=net.swapaxes(0, 1).tolist()).degree == (3, 3)
    net[1, :, 3], net[:, 2, 3] = 1, 0
    surface = build(homogeneous=True, control_net=net.tolist())
    assert surface.degree[0] == 2
    assert surface.degree[1] > 3


@given(data=st.data())
def test_random_nets_are_the_same_surface(data: st.DataObject) -> None:
    p, q = data.draw(st.integers(2, 4)), data.draw(st.integers(1, 3))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    net = rng.normal(size=(p + 1, q + 1, 4)) * 10.0 ** rng.integers(-3, 4)
    net[..., 3] = rng.choice([1.0, 0.5, 0.0, -0.05], (p + 1, q + 1))
    net[[0, 0, -1, -1], [0, -1, 0, -1], 3] = 1
    assume((net[..., 3] <= 0).any())
    surface: Any = None
    with suppress(InvalidRequest):
        surface = build(homogeneous=True, control_net=net.tolist())
    assume(surface is not None)
    steps = sum(surface.degree) - p - q
    assert surface.weights.min() * 1e8 >= surface.weights.max()
    assert_is_near(surface, net, steps=steps)


@given(seed=st.integers(0, 2**32), reverse=st.booleans())
def test_a_border_is_raised_alike_from_both_sides(seed: int, reverse: bool) -> None:
    """Neighbours that need the same degree get equal borders, bit for bit, also when turned."""
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(2, 3, 3, 4))
    first[..., 3] = second[..., 3] = [[1, 0, 1], [1, 1, 1], [1, 0, 1]]
    second[0] = first[-1]
    other = second[:, ::-1] if reverse else second
    borders = [
        (each.control_net[row], each.weights[row])
        for net, row in ((first, -1), (other, 0))
        for each in [build(homogeneous=True, control_net=net.tolist())]
    ]
    order = slice(None, None, -1 if reverse else 1)
    for x, y in zip(*borders, strict=True):
        assert np.array_equal(x, y[order])


def test_triangles() -> None:
    rng = np.random.default_rng(1)
    net = rng.integers(-8, 8, (6, 4)).astype(float)
    net[:, 3] = [1, 0, 1, 0, 0.5, 1]
    rows = [net[:3].tolist(), net[3:5].tolist(), net[5:].tolist()]
    surface = build(type="triangle", homogeneous=True, control_net=rows)
    assert isinstance(surface, TriangleSurface)
    own = triangles.to_exact_triangle(net)
    raised = triangles.to_exact_triangle(surface.control_net, surface.weights)
    for place in triangles.places(5):
        expected = divide(triangles.value(own, place))
        got = divide(triangles.value(raised, place))
        assert [float(x) for x in got] == pytest.approx([float(x) for x in expected], abs=1e-14)


SPLINES = {
    "a circle in halves": (2, [0, 0, 0, 1, 1, 2, 2, 2], [1, 0, 1, 0, 1]),
    "smooth, a point that does not pull": (3, "clamped", [1, 1, 0, 1, 1, 1]),
    "uniform": (2, "uniform", [1, 0, 1, 1, 1]),
    "periodic": (3, "periodic", [1, 0, 1, 1, 0.25]),
    "degree 2, uneven": (2, [0, 0, 0, 0.25, 2, 2, 2], [1, 0, 0.5, 1]),
}


@pytest.mark.parametrize(("degree", "knots", "weights"), SPLINES.values(), ids=SPLINES)
@pytest.mark.parametrize("is_turned", [False, True])
def test_splines(degree: int, knots: Any, weights: list[float], is_turned: bool) -> None:
    rng = np.random.default_rng(3)
    net = np.empty((len(weights), 3, 4))
    net[..., :3] = rng.integers(-9, 9, (len(weights), 3, 3))
    net[..., 3] = np.array(weights)[:, np.newaxis]
    request: dict[str, Any] = {"degree": [degree, 2], "knots": [knots, "clamped"]}
    placed = net
    if is_turned:
        request = {"degree": [2, degree], "knots": ["clamped", knots]}
        placed = net.swapaxes(0, 1)
    surface = build(type="bspline", homogeneous=True, control_net=placed.tolist(), **request)
    u, v = request["knots"]
    plain: Any = BsplineSurface(placed[..., :3], tuple(request["degree"]), (u, v))
    assert max(surface.degree) == degree + 1
    axis = int(is_turned)
    old, new = plain.knot_vectors, surface.knot_vectors
    wrapped = plain._wrap(placed)
    own = [[tuple(map(Fraction, point)) for point in row] for row in wrapped.tolist()]
    raised = exact.to_exact_net(surface._wrap(surface.control_net), surface._wrap(surface.weights))
    low, high = (float(x) for x in (old[axis][degree], old[axis][-1 - degree]))
    for s, t in product(PARAMETERS[:-1], PARAMETERS[:-1]):
        along, across = Fraction(low) + s * (Fraction(high) - Fraction(low)), t
        place = (across, along) if is_turned else (along, across)
        expected, got = (
            splines.spline_surface_point(
                points,
                (splines.to_fractions(vectors[0]), splines.to_fractions(vectors[1])),
                p,
                place,
            )
            for points, vectors, p in ((own, old, plain.degree), (raised, new, surface.degree))
        )
        assert [float(x) for x in got] == pytest.approx([float(x) for x in expected], abs=1e-12)


def test_a_periodic_spline_stays_closed() -> None:
    surface = build(
        type="bspline",
        degree=[3, 1],
        knots=["periodic", "clamped"],
        control_net=[[[x, y, z] for z in (0, 1)] for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))],
        weights=[[1, 1], [0, 0], [1, 1], [1, 1]],
    )
    assert np.array_equal(surface.control_net[0], surface.control_net[-1])
    assert np.array_equal(surface.weights[0], surface.weights[-1])
    assert surface.knots[1] == "clamped"


def test_channels_of_a_spline_are_raised_with_it() -> None:
    net = [[[x, y, 0] for y in range(2)] for x in range(4)]
    fields: dict[str, Any] = {
        "type": "bspline", "degree": [2, 1], "control_net": net,
        "uvs": [[[x / 4, y] for y in range(2)] for x in range(4)],
        "attributes": {"heat": [[[1], [2]], [[3], [4]]], "six": [[[1], [2]]] * 6},
    }  # fmt: skip
    surface = build(**fields, weights=[[1, 1], [0, 0], [1, 1], [1, 1]])
    assert surface.control_net.shape[:2] == (6, 2)
    assert surface.channels.uvs.shape == (6, 2, 2)
    assert dict(surface.channels.attributes)["heat"].shape == (2, 2, 1)
    # With as many rows as the control points this Bézier net would count as a spline.
    assert dict(surface.channels.attributes)["six"].shape == (7, 2, 1)
    plain, half = build(**fields).lower(), surface.lower()
    for before, after in zip(plain.batches[0].channels, half.batches[0].channels, strict=True):
        low, high = (
            [exact.surface_point(exact.to_exact_net(net), *GRID[7]) for net in each.nets]
            for each in (before, after)
        )
        assert np.array(high, float) == pytest.approx(np.array(low, float), abs=1e-6)


def test_patches_of_one_degree_are_raised_alike_and_share_vertices() -> None:
    vertices = [[x, y, x * y] for x in range(5) for y in range(2)]
    weights = [1, 1, 0, 0, 1, 1, 1, 1, 1, 1]
    surface = build(
        type="patches", vertices=vertices, weights=weights, name="two",
        patches=[[[4, 5], [6, 7], [8, 9]], [[0, 1], [2, 3], [4, 5]]], parts={"first": [1]},
        uvs=[[x / 4, y] for x in range(5) for y in range(2)],
    )  # fmt: skip
    assert isinstance(surface, PatchSurface)
    assert surface.degree == (3, 1)
    assert len(surface.vertices) == 14
    assert surface.parts == (("first", (1,)),)
    assert isinstance(surface.patches, np.ndarray)
    first, second = surface.patches
    assert np.array_equal(first[0], second[-1])
    for number, columns in ((0, range(4, 10)), (1, range(6))):
        grid = surface.patches[number]
        assert surface.weights is not None
        single = BezierSurface(surface.vertices[grid], surface.weights[grid])
        own = to_homogeneous(np.array(vertices)[columns], np.array(weights)[columns])
        assert_is_near(single, own.reshape(3, 2, 4), steps=1)
    assert surface.channels.uvs is not None
    assert surface.channels.uvs[second[1, 0]].tolist() == pytest.approx([1 / 6, 0])


def test_patches_of_several_degrees_and_triangles() -> None:
    vertices = [[x, y, 0, 1] for x in range(3) for y in range(2)] + [[1, 3, 0, 0], [0, 5, 0, 1]]
    vertices[2] = [0, 0, 1, 0]
    surface = build(
        type="patches", homogeneous=True, vertices=vertices,
        patches=[[[0, 1], [4, 5]], [[0, 1], [2, 3], [4, 5]]], triangles=[[[0, 2, 4], [6, 1], [7]]],
    )  # fmt: skip
    assert isinstance(surface.patches, tuple)
    assert surface.patches[0].shape == (2, 2)
    assert surface.patches[1].shape[0] > 3
    assert surface.triangle_degree > 2
    assert (surface.weights > 0).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_curves(dimension: int) -> None:
    points = np.array([[1, 0, 2, 1], [0, 1, 0, 0], [-1, 0, 2, 1.0]])[
        :, [0, 1, 3] if dimension == 2 else slice(4)
    ]
    for fields in ({}, {"type": "bspline", "degree": 2}):
        curve = build_curve(homogeneous=True, control_points=points.tolist(), **fields)
        assert curve.control_points.shape == (4, dimension)
        assert curve.control_points[1, :2].tolist() == pytest.approx([1, 2])
        assert curve.weights.tolist() == pytest.approx([1, 1 / 3, 1 / 3, 1])


def test_parts_of_other_kinds_may_have_them() -> None:
    """Multipatches, members of groups, and the curves of tubes."""
    several = build(type="multipatch", surfaces=[HALF_CYLINDER, {**STRIP, "name": "strip"}])
    assert [single.degree for single in several.surfaces] == [(3, 1), (3, 1)]
    half = {"homogeneous": True, "control_points": [[1, 0, 0, 1], [0, 1, 0, 0], [-1, 0, 0, 1]]}
    tube = build(type="tube", curve=half, radius=0.1)
    assert tube.curve.degree == 3
    group = build(type="group", members=[{"surface": HALF_CYLINDER}, {"surface": STRIP}])
    assert [member.surface.degree for member in group.members] == [(3, 1), (3, 1)]


def test_a_negative_weight_makes_the_long_arc() -> None:
    """(1, −½, 1) is the arc of 240°, of which the middle is opposite to that of the short arc."""
    right = math.sqrt(3) / 2
    points = [[right, -0.5, 1], [0, 1, -0.5], [-right, -0.5, 1]]
    curve = build_curve(homogeneous=True, control_points=points)
    net = exact.to_exact_net([curve.control_points], [curve.weights])
    for t in PARAMETERS:
        x, y = divide(exact.surface_point(net, Fraction(0), t))
        assert abs(float(x * x + y * y) - 1) < 1e-14


VANISHING = [[1, 1, 1], [-1, -1, -1], [1, 1, 1]]


def weigh(weights: Any) -> dict[str, Any]:
    weights = np.asarray(weights, float)
    points = np.indices(weights.shape).transpose(1, 2, 0)
    net = np.concatenate([points * weights[..., None], 0 * points[..., :1], weights[..., None]], -1)
    return {"homogeneous": True, "control_net": net.tolist()}


def test_weights_that_vanish_are_refused() -> None:
    net = STRIP["control_net"]
    assert refuse(control_net=net, weights=[[1, 1], [0, 0], [0, 1]]) == (
        "weight_not_positive", "/surface/weights/2/0",
    )  # fmt: skip
    assert refuse(control_net=net, weights=[[0, 0]] * 3)[0] == "weight_not_positive"
    assert refuse(control_net=net, weights=[[1, 1], [-1, 0], [1, 1]]) == (
        "weight_not_positive", "/surface/weights/1/0",
    )  # fmt: skip
    assert refuse(**weigh(-np.ones((2, 2)))) == ("weight_not_positive", "/surface/control_net/0/0")
    assert refuse(**weigh(VANISHING)) == ("weight_not_positive", "/surface")
    assert refuse(**weigh([[1, 1, 1], [1, -4, 1], [1, 1, 1]])) == (
        "weight_not_positive",
        "/surface",
    )
    assert refuse(**weigh([[1, -1, 1], [1, 1, 1]])) == ("weight_not_positive", "/surface")
    assert refuse(**weigh([[1, 1], [-0.995, -0.995], [1, 1]])) == ("degree_too_high", "/surface")
    assert refuse(**weigh([[1] + [0] * 40 + [1]] * 2)) == ("weight_not_positive", "/surface")
    assert refuse(**weigh([[1, 0, 1e-9]] * 2)) == ("weight_not_positive", "/surface")
    assert refuse(**weigh([[1, 1], [1, 1e-9]])) == ("weight_ratio", "/surface")
    fields: dict[str, Any] = {"type": "bspline", "degree": [2, 1]}
    assert refuse(**fields, **weigh(np.array([[1, 1, -1, 1, 1]] * 2).T)) == (
        "weight_not_positive", "/surface",
    )  # fmt: skip
    assert refuse(**fields, **weigh(np.array([[0, 1, 0, 1, 1]] * 2).T)) == (
        "weight_not_positive", "/surface/control_net/0/0",
    )  # fmt: skip


def test_a_place_where_the_weights_vanish_is_named() -> None:
    with pytest.raises(InvalidRequest) as caught:
        build(**weigh(VANISHING))
    assert caught.value.issues[0].got == "0 at u = 0.5, v = 0"
    with pytest.raises(InvalidRequest) as caught:
        build_curve(
            type="bspline", degree=1, control_points=[[0, 0], [1, 1], [2, 0]], weights=[1, 0, 1]
        )
    assert caught.value.issues[0].got == "0 at t = 1"


def test_wrong_forms_are_refused() -> None:
    net = STRIP["control_net"]
    assert refuse(control_net=net, homogeneous=True)[0] == "wrong_dimension"
    assert refuse(control_net=HALF_CYLINDER["control_net"])[0] == "wrong_dimension"
    assert refuse(**HALF_CYLINDER, weights=STRIP["weights"]) == (
        "conflicting_options", "/surface/weights",
    )  # fmt: skip
    assert refuse(control_net=net, homogeneous=1)[0] == "wrong_type"
    with pytest.raises(InvalidRequest) as caught:
        build(control_net=HALF_CYLINDER["control_net"])
    assert "`homogeneous`: true" in caught.value.issues[0].needed


def test_limits_count_the_raised_control_points() -> None:
    patch = {"control_net": HALF_CYLINDER["control_net"], "homogeneous": True}
    assert build(DocumentLimits(max_control_points=8), **patch).degree == (3, 1)
    with pytest.raises(InvalidRequest) as caught:
        build(DocumentLimits(max_control_points=7), **patch)
    assert caught.value.issues[0].code == "too_many_control_points"
    group = {"type": "group", "members": [{"surface": patch}] * 3}
    with pytest.raises(InvalidRequest) as caught:
        build(DocumentLimits(max_control_points=20), **group)
    assert caught.value.issues[0].code == "too_many_control_points"
    with pytest.raises(InvalidRequest) as caught:
        build(DocumentLimits(max_degree=2), **patch)
    assert caught.value.issues[0].code == "degree_too_high"


def test_breps_may_have_them_in_surfaces_edges_and_pcurves() -> None:
    half = [[1, 0, 0, 1], [0, 1, 0, 0], [-1, 0, 0, 1]]
    brep: dict[str, Any] = {
        "type": "brep",
        "vertices": [[1, 0, 0], [-1, 0, 0]],
        "edges": [
            {"vertices": [0, 1], "curve": {"homogeneous": True, "control_points": half}},
            {"vertices": [1, 0]},
        ],
        "faces": [{
            "surface": {"control_net": [[[-2, -2, 0], [-2, 2, 0]], [[2, -2, 0], [2, 2, 0]]]},
            "loops": [{"edges": [0, 1], "pcurves": [
                {"homogeneous": True,
                 "control_points": [[0.75, 0.5, 1], [0, 0.25, 0], [0.25, 0.5, 1]]},
                None,
            ]}],
        }, {"surface": HALF_CYLINDER}, {"surface": STRIP}],
    }  # fmt: skip
    document = definition(build(**brep))
    edge = document["edges"][0]["curve"]
    pcurve = document["faces"][0]["loops"][0]["pcurves"][0]
    for curve, middle in ((edge, [1, 2, 0]), (pcurve, [0.75, 1])):
        assert "homogeneous" not in curve
        assert curve["control_points"][1].tolist() == pytest.approx(middle)
        assert curve["weights"].tolist() == pytest.approx([1, 1 / 3, 1 / 3, 1])
    for face in document["faces"][1:]:
        assert face["surface"]["control_net"].shape == (4, 2, 3)
    brep["edges"][0]["curve"]["control_points"][0][3] = 0
    assert refuse(**brep) == ("weight_not_positive", "/surface/edges/0/curve/control_points/0")
