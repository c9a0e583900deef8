"""Operations on B-splines keep points and channels, computed by Cox and de Boor in fractions."""

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from oracles.exact import Net, surface_point, to_exact_net
from oracles.splines import spline_surface_point, to_fractions
from service.bases import knots as knot
from service.errors import SurfaceError
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
    Insert,
    Operation,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    Transpose,
)
from service.surface.convert.refine_spline import find_domain
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.knots import Knots
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh
from tests.spline_strategies import knot_vectors
from tests.surface.convert.exact import build_patch_evaluator, convert_to

Pair = tuple[Fraction, Fraction]
seeds = st.integers(0, 10**6)
NAMES = ("clamped", "uniform", "periodic")


@st.composite
def splines(draw: st.DrawFn, may_be_discontinuous: bool = True) -> BsplineSurface:
    """B-splines with named or explicit knots, with or without weights, and with channels.

    A channel may have a value for each control point, or be a Bézier net of its own.
    """
    degree, knots, counts = [], [], []
    for _ in range(2):
        p = draw(st.integers(1, 3))
        name = draw(st.sampled_from([*NAMES, None]))
        axis_knots: Knots
        if name is None:
            vector = draw(knot_vectors(st.just(p), may_be_discontinuous, max_spans=3))
            axis_knots, count = vector.knots, vector.point_count
        else:
            least = 3 if name == "periodic" else 1  # a periodic spline has at least 3 points
            axis_knots, count = name, p + draw(st.integers(least, 4))  # type: ignore[assignment]
        degree.append(p)
        knots.append(axis_knots)
        counts.append(count)
    rng = np.random.default_rng(draw(seeds))
    channels = Channels(
        rng.uniform(0, 1, (2, 3, 3)),
        None,
        (("heat", rng.uniform(-4, 4, (*counts, 1))), ("flow", rng.uniform(-4, 4, (1, 2, 2)))),
    )
    weights = rng.uniform(0.2, 5, counts) if draw(st.booleans()) else None
    return BsplineSurface(
        rng.uniform(-4, 4, (*counts, 3)),
        (degree[0], degree[1]),
        (knots[0], knots[1]),
        weights,
        "z",
        "sail",
        channels,
    )


def evaluate_values(surface: BsplineSurface, place: Pair) -> list[float]:
    """The point at `place`, then the values of the channels, each by its definition."""
    knots = to_fractions(surface.knot_vectors[0]), to_fractions(surface.knot_vectors[1])
    shape = surface.control_net.shape[:2]
    net = to_exact_net(surface.control_net, surface.weights)
    result = list(spline_surface_point(_wrap_net(surface, net), knots, surface.degree, place))
    unit_place = []
    for axis in (0, 1):
        low, high = map(Fraction, find_domain(surface, axis))
        unit_place.append((place[axis] - low) / (high - low))
    for _, _, _, values in surface.channels.each():
        if values.shape[:2] == shape:
            for column in range(values.shape[-1]):
                # Each number becomes the x coordinate of a point, whose other coordinates are 0.
                line = to_exact_net(np.pad(values[..., column, None], ((0, 0), (0, 0), (0, 2))))
                line = _wrap_net(surface, line)
                result.append(spline_surface_point(line, knots, surface.degree, place)[0])
        else:
            result += surface_point(to_exact_net(values), unit_place[0], unit_place[1])
    return [float(x) for x in result]


def _wrap_net(surface: BsplineSurface, net: Net) -> Net:
    """The net with its first points repeated at the end, along periodic directions."""
    u, v = (isinstance(k, str) and k == "periodic" for k in surface.knots)
    p, q = surface.degree
    if v:
        net = [[row[j % len(row)] for j in range(len(row) + q)] for row in net]
    if u:
        net = [net[i % len(net)] for i in range(len(net) + p)]
    return net


def list_places(surface: BsplineSurface) -> list[Pair]:
    """About four of the places whose u and v are at the beginning of a span or 3/8 into it."""
    result: list[list[Fraction]] = []
    for axis in (0, 1):
        breaks = to_fractions(knot.breaks(surface.knot_vectors[axis], surface.degree[axis]))
        result.append(
            [a + (b - a) * s for a, b in pairwise(breaks) for s in (Fraction(0), Fraction(3, 8))]
        )
    return list(product(result[0], result[1]))[:: max(1, len(result[0]) * len(result[1]) // 4)]


def assert_same(
    converted: BsplineSurface,
    surface: BsplineSurface,
    change: Callable[[Fraction, Fraction], Pair] = lambda u, v: (u, v),
) -> None:
    """Checks that `converted` at (u, v) has the values of `surface` at change(u, v)."""
    for u, v in list_places(converted):
        np.testing.assert_allclose(
            evaluate_values(converted, (u, v)),
            evaluate_values(surface, change(u, v)),
            rtol=0,
            atol=4e-12,
        )


convert_to_spline = partial(convert_to, BsplineSurface)


@settings(max_examples=6)
@given(splines(), st.integers(0, 2), st.integers(0, 2))
def test_elevation_keeps_points_and_continuity(
    surface: BsplineSurface, steps_u: int, steps_v: int
) -> None:
    degree = surface.degree[0] + steps_u, surface.degree[1] + steps_v
    result = convert_to_spline(surface, Elevate(degree))
    assert result.degree == degree
    assert_same(result, surface)
    for axis, degree_steps in enumerate((steps_u, steps_v)):
        if not degree_steps:  # the knots, a name or an array, are kept
            assert result.knots[axis] is surface.knots[axis] or np.array_equal(
                result.knots[axis], surface.knots[axis]
            )
            continue
        # The multiplicities of inner knots grow by as much as the degree.
        old, new = (
            np.unique(s.knot_vectors[axis][n:-n], return_counts=True)[1][1:-1]
            for s, n in ((surface, surface.degree[axis]), (result, result.degree[axis]))
        )
        np.testing.assert_array_equal(new, old + degree_steps)


@settings(max_examples=6)
@given(splines(), st.tuples(*[st.floats(0, 1)] * 4), st.sampled_from(["u", "v", "uv"]))
def test_a_restricted_spline_has_the_points_of_the_spline(
    surface: BsplineSurface, shares: tuple[float, float, float, float], directions: str
) -> None:
    intervals: list[tuple[float, float] | None] = [None, None]
    for axis, name in enumerate("uv"):
        (low, high), (a, b) = find_domain(surface, axis), sorted(shares[2 * axis : 2 * axis + 2])
        if name in directions:
            begin, end = low + a * (high - low), low + b * (high - low)
            assume(_has_room(surface.knot_vectors[axis], begin, end))
            intervals[axis] = begin, end
    result = convert_to_spline(surface, Restrict(intervals[0], intervals[1]))
    for axis, interval in enumerate(intervals):
        # A parameter within rounding of an end of the domain counts as that end.
        expected = interval or find_domain(surface, axis)
        np.testing.assert_allclose(find_domain(result, axis), expected, atol=1e-11)
    assert_same(result, surface)


def _has_room(knots: np.ndarray, begin: float, end: float) -> bool:
    """Whether `begin` < `end`, and these and the knots between them are more than 1e-5 apart."""
    gaps = np.diff(np.unique([*knots[(knots > begin) & (knots < end)], begin, end]))
    return begin < end and float(gaps.min()) > 1e-5


@settings(max_examples=6)
@given(splines(may_be_discontinuous=False), st.floats(0, 1), st.floats(0, 1))
def test_an_inserted_knot_keeps_the_points(
    surface: BsplineSurface, share_u: float, share_v: float
) -> None:
    """A share of 0 stands for a direction without a new knot."""
    places: list[float | None] = [None, None]
    for axis, share in enumerate((share_u, share_v)):
        low, high = find_domain(surface, axis)
        if _has_room(surface.knot_vectors[axis], low, low + share * (high - low)) and share < 1:
            assume(_has_room(surface.knot_vectors[axis], low + share * (high - low), high))
            places[axis] = low + share * (high - low)
            # A knot may have the highest multiplicity already.
            assume(places[axis] not in surface.knot_vectors[axis])
    assume(places != [None, None])
    result = convert_to_spline(surface, Insert(places[0], places[1]))
    assert_same(result, surface)
    for axis, place in enumerate(places):
        if place is None:
            assert result.control_net.shape[axis] == surface.control_net.shape[axis]
        else:
            degree, (low, high) = surface.degree[axis], find_domain(surface, axis)
            old = surface.knot_vectors[axis]
            inner = old[(old > low) & (old < high)]
            expected = [*[low] * (degree + 1), *sorted([*inner, place]), *[high] * (degree + 1)]
            assert result.knot_vectors[axis].tolist() == pytest.approx(expected, abs=1e-12)


def test_a_knot_is_inserted_up_to_the_degree() -> None:
    """With a knot of multiplicity 3 a cubic spline has a control point on the surface."""
    surface = build_cubic()
    result = convert(surface, [Insert(u=1.0), Insert(v=0.5), Insert(u=1.0)])
    assert isinstance(result, BsplineSurface)
    assert result.knot_vectors[0].tolist() == [0, 0, 0, 0, 1, 1, 1, 2, 3, 3, 3, 3]
    assert result.control_net.shape == (8, 7, 3)
    with pytest.raises(SurfaceError) as caught:
        convert(result, [Insert(u=1 + 1e-14)])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("knot_multiplicity", "/operations/0/u")


@settings(max_examples=5)
@given(splines(may_be_discontinuous=False))
def test_transposed_and_reversed_splines_have_the_same_points(surface: BsplineSurface) -> None:
    assert_same(convert_to_spline(surface, Transpose()), surface, lambda u, v: (v, u))
    for axis, name in enumerate("uv"):
        result = convert_to_spline(surface, Reverse(name))  # type: ignore[arg-type]
        low, high = map(Fraction, find_domain(surface, axis))
        # Knots with a name stay the same; explicit knots are negated.
        is_named = isinstance(surface.knots[axis], str)
        mirror = low + high if is_named else Fraction(0)
        assert find_domain(result, axis) == (float(mirror - high), float(mirror - low))
        reverse = (lambda u, v, m=mirror: (m - u, v)) if axis == 0 else (
            lambda u, v, m=mirror: (u, m - v))  # fmt: skip
        assert_same(result, surface, reverse)


@settings(max_examples=5)
@given(splines())
def test_bezier_patches_of_a_spline_have_its_points(surface: BsplineSurface) -> None:
    result = convert(surface, [ToBezier()])
    assert isinstance(result, PatchSurface)
    assert (result.up, result.name, result.parts) == ("z", "sail", ())
    u, v = (
        to_fractions(knot.breaks(k, p))
        for k, p in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    cells = list(product(pairwise(u), pairwise(v)))
    assert len(result.patches) == len(cells)
    for number, ((a, b), (c, d)) in enumerate(cells):
        evaluate = build_patch_evaluator(result, number)
        for s, t in ((Fraction(0), Fraction(2, 7)), (Fraction(3, 8), Fraction(5, 8))):
            expected = evaluate_values(surface, (a + (b - a) * s, c + (d - c) * t))
            np.testing.assert_allclose(evaluate(s, t), expected, rtol=0, atol=4e-12)


@settings(max_examples=6)
@given(splines(), st.floats(0.1, 0.9), st.none() | st.floats(0.1, 0.9))
def test_parts_of_a_split_spline_have_its_points(
    surface: BsplineSurface, u_share: float, v_share: float | None
) -> None:
    """The result is a group of splines over the parts of the domain."""
    (low, high), (bottom, top) = find_domain(surface, 0), find_domain(surface, 1)
    u = low + u_share * (high - low)
    v = None if v_share is None else bottom + v_share * (top - bottom)
    assume(_has_room(surface.knot_vectors[0], low, u))
    assume(_has_room(surface.knot_vectors[0], u, high))
    if v is not None:
        assume(_has_room(surface.knot_vectors[1], bottom, v))
        assume(_has_room(surface.knot_vectors[1], v, top))
    result = convert(surface, [Split(u, v)])
    assert isinstance(result, GroupSurface)
    assert (result.up, result.name) == ("z", "sail")
    along_v = [(bottom, top)] if v is None else [(bottom, v), (v, top)]
    cells = list(product([(low, u), (u, high)], along_v))
    assert len(result.members) == len(cells)
    for member, cell in zip(result.members, cells, strict=True):
        part = member.surface
        assert isinstance(part, BsplineSurface)
        assert (find_domain(part, 0), find_domain(part, 1)) == cell
        assert_same(part, surface)


@pytest.mark.parametrize("shape", [(3, 3), (6, 7)])
def test_white_colors_stay_white(shape: tuple[int, int]) -> None:
    """Without clipping, rounding would make some colours larger than 1, which is invalid."""
    rng = np.random.default_rng(4)
    surface = BsplineSurface(
        rng.uniform(-1, 1, (6, 7, 3)), (2, 3), ("uniform", "periodic"),
        channels=Channels(colors=np.ones((*shape, 3))),
    )  # fmt: skip
    for operation in (ToBezier(), Elevate((5, 5)), Restrict(u=(0.3, 2.1))):
        result = convert(surface, [operation])
        assert isinstance(result, BsplineSurface | PatchSurface)
        assert result.channels.colors is not None
        assert (result.channels.colors == 1).all()


@pytest.mark.parametrize(
    "operation",
    [Elevate((4, 2)), Elevate((5, 4)), Insert(2.5, 1.5), Restrict(v=(0.5, 2.25)), Reverse("u")],
)
@pytest.mark.parametrize("is_rational", [False, True])
def test_closed_surfaces_stay_closed(operation: Operation, is_rational: bool) -> None:
    rng = np.random.default_rng(3)
    weights = rng.uniform(0.2, 5, (7, 6)) if is_rational else None
    surface = BsplineSurface(
        rng.uniform(-1, 1, (7, 6, 3)), (3, 2), ("periodic", "clamped"), weights
    )
    result = convert(surface, [operation])
    before, after = (build_mesh(s.lower(), resolution=(3, 3)).report for s in (surface, result))
    assert after.closure == before.closure
    assert after.closure is not None
    assert after.closure.u == "C1"
    assert before.boundary_edges > 0
    if not isinstance(operation, Insert | Restrict):
        assert after.boundary_edges == before.boundary_edges


def test_a_parameter_within_rounding_of_a_knot_is_that_knot() -> None:
    for near_operation, exact_operation in (
        (Split(u=1 + 1e-12), Split(u=1.0)),
        (Restrict(u=(0.5, 1 + 1e-12)), Restrict(u=(0.5, 1.0))),
        (Restrict(v=(-1e-15, 2)), Restrict(v=(0.0, 2.0))),
    ):
        near_mesh, exact_mesh = (
            build_mesh(convert(build_cubic(), [operation]).lower())
            for operation in (near_operation, exact_operation)
        )
        assert np.array_equal(near_mesh.positions, exact_mesh.positions)


def build_cubic() -> BsplineSurface:
    """A bicubic spline over clamped knots with the domain [0, 3]²."""
    return BsplineSurface(np.random.default_rng(6).uniform(-1, 1, (6, 6, 3)))


@pytest.mark.parametrize(
    ("operation", "code", "pointer"),
    [
        (Elevate((3, 2)), "degree_too_low", "/degree/1"),
        (Restrict(u=(0, 3.5)), "out_of_range", "/u/1"),
        (Restrict(v=(-1, 2)), "out_of_range", "/v/0"),
        (Restrict(v=(0.5, 0.5 + 1e-15)), "knots_too_close", "/v"),
        (Restrict(u=(1e-15, 3e-15)), "knots_too_close", "/u"),  # both ends are the same knot
        (Split(u=0.0), "out_of_range", "/u"),
        (Split(u=1.0, v=3.0), "out_of_range", "/v"),
        (Split(at=(0.25, 0.25, 0.5)), "unknown_field", "/at"),
        (Insert(u=0.0), "out_of_range", "/u"),
        (Insert(u=1.5, v=3.5), "out_of_range", "/v"),
        (Insert(u=1e-9, patch=0), "unexpected_patch", "/patch"),
    ],
)
def test_refused_operations_on_a_spline(operation: Operation, code: str, pointer: str) -> None:
    # The pointer counts the operations. The transposed spline has the same degrees and domain.
    with pytest.raises(SurfaceError) as caught:
        convert(build_cubic(), [Transpose(), operation])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == (code, f"/operations/1{pointer}")


def test_too_large_results_are_refused_before_they_are_built() -> None:
    """The spline has 36 control points, the results would have 81 and 144."""
    for operation in (Elevate((4, 4)), ToBezier()):
        with pytest.raises(SurfaceError) as caught:
            convert(build_cubic(), [operation], SizeLimits(40))
        assert caught.value.issues[0].code == "too_many_control_points"
    with pytest.raises(SurfaceError) as caught:
        convert(build_cubic(), [Elevate((3, 9))], SizeLimits(degree=8))
    assert caught.value.issues[0].pointer == "/operations/0/degree/1"


def test_conversions_that_would_take_minutes_are_refused() -> None:
    """Elevation by 32 degrees would make about 50,000 knots, of multiplicity 63."""
    knots = np.repeat(np.arange(800.0), 31)
    knots = np.concatenate([[0.0] * 2, knots, [799.0] * 2])  # the ends have multiplicity p + 1
    net = np.zeros((len(knots) - 33, 2, 3))
    surface = BsplineSurface(net, (32, 1), (knots, "clamped"))
    with pytest.raises(SurfaceError) as caught:
        convert(surface, [Elevate((64, 1))])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("too_many_knots", "/operations/0/degree/0")
