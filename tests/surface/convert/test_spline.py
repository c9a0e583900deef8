"""Operations on B-splines: the same points by Cox and de Boor in exact arithmetic, and channels."""

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from service.bases import knots as knot
from service.errors import SurfaceError
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
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
from tests.oracles.exact import Net, surface_point, to_exact_net
from tests.oracles.splines import spline_surface_point, to_fractions
from tests.spline_strategies import knot_vectors
from tests.surface.convert.exact import convert_to, define_patch_values

Pair = tuple[Fraction, Fraction]
seeds = st.integers(0, 10**6)
NAMES = ("clamped", "uniform", "periodic")


@st.composite
def splines(draw: st.DrawFn, parted: bool = True) -> BsplineSurface:
    """Any knots, named or not; weights or none; channels of both forms."""
    degree, knots, counts = [], [], []
    for _ in range(2):
        p = draw(st.integers(1, 3))
        name = draw(st.sampled_from([*NAMES, None]))
        given: Knots
        if name is None:
            vector = draw(knot_vectors(st.just(p), parted, max_spans=3))
            given, count = vector.knots, vector.points
        else:
            given, count = name, p + draw(st.integers(1 if name != "periodic" else 3, 4))  # type: ignore[assignment]
        degree.append(p)
        knots.append(given)
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


def evaluate_values(surface: BsplineSurface, at: Pair) -> list[float]:
    """The point, then the values of the channels, each by its definition."""
    knots = to_fractions(surface.knot_vectors[0]), to_fractions(surface.knot_vectors[1])
    shape = surface.control_net.shape[:2]
    net = to_exact_net(surface.control_net, surface.weights)
    result = list(spline_surface_point(_wrap_net(surface, net), knots, surface.degree, at))
    share = []
    for axis in (0, 1):
        low, high = map(Fraction, find_domain(surface, axis))
        share.append((at[axis] - low) / (high - low))
    for _, _, _, carried in surface.channels.each():
        if carried.shape[:2] == shape:
            for column in range(carried.shape[-1]):
                # A point on the x axis for each number.
                line = to_exact_net(np.pad(carried[..., column, None], ((0, 0), (0, 0), (0, 2))))
                line = _wrap_net(surface, line)
                result.append(spline_surface_point(line, knots, surface.degree, at)[0])
        else:
            result += surface_point(to_exact_net(carried), share[0], share[1])
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
    """Parameters in every span: its beginning and within."""
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
    back: Callable[[Fraction, Fraction], Pair] = lambda u, v: (u, v),
) -> None:
    """Checks that the new surface equals the old one at the parameters that `back` returns."""
    for u, v in list_places(converted):
        np.testing.assert_allclose(
            evaluate_values(converted, (u, v)),
            evaluate_values(surface, back(u, v)),
            rtol=0,
            atol=4e-12,
        )


spline = partial(convert_to, BsplineSurface)


@settings(max_examples=6)
@given(splines(), st.integers(0, 2), st.integers(0, 2))
def test_elevated(surface: BsplineSurface, more_u: int, more_v: int) -> None:
    degree = surface.degree[0] + more_u, surface.degree[1] + more_v
    built = spline(surface, Elevate(degree))
    assert built.degree == degree
    assert_same(built, surface)
    for axis, more in enumerate((more_u, more_v)):
        if not more:
            assert built.knots[axis] is surface.knots[axis] or np.array_equal(
                built.knots[axis], surface.knots[axis]
            )
            continue
        old, new = (
            knot.multiplicities(s.knot_vectors[axis][s.degree[axis] : -s.degree[axis]])[1][1:-1]
            for s in (surface, built)
        )
        np.testing.assert_array_equal(new, old + more)


@settings(max_examples=6)
@given(splines(), st.tuples(*[st.floats(0, 1)] * 4), st.sampled_from(["u", "v", "uv"]))
def test_piece(
    surface: BsplineSurface, shares: tuple[float, float, float, float], which: str
) -> None:
    pieces: list[tuple[float, float] | None] = [None, None]
    for axis, name in enumerate("uv"):
        (low, high), (a, b) = find_domain(surface, axis), sorted(shares[2 * axis : 2 * axis + 2])
        if name in which:
            first, last = low + a * (high - low), low + b * (high - low)
            assume(_has_room(surface.knot_vectors[axis], first, last))
            pieces[axis] = first, last
    built = spline(surface, Restrict(*pieces))
    for axis, piece in enumerate(pieces):
        # A parameter that is so near to an end of the domain counts as that end.
        expected = piece or find_domain(surface, axis)
        np.testing.assert_allclose(find_domain(built, axis), expected, atol=1e-11)
    assert_same(built, surface)


def _has_room(knots: np.ndarray, first: float, last: float) -> bool:
    """Whether both ends are far enough from all knots."""
    gaps = np.diff(np.unique([*knots[(knots > first) & (knots < last)], first, last]))
    return first < last and float(gaps.min()) > 1e-5


@settings(max_examples=5)
@given(splines(parted=False))
def test_transposed_and_reversed(surface: BsplineSurface) -> None:
    assert_same(spline(surface, Transpose()), surface, lambda u, v: (v, u))
    for axis, name in enumerate("uv"):
        built = spline(surface, Reverse(name))  # type: ignore[arg-type]
        low, high = map(Fraction, find_domain(surface, axis))
        is_named = isinstance(surface.knots[axis], str)
        mirror = low + high if is_named else Fraction(0)
        assert find_domain(built, axis) == (float(mirror - high), float(mirror - low))
        ends = (lambda u, v, m=mirror: (m - u, v)) if axis == 0 else (
            lambda u, v, m=mirror: (u, m - v))  # fmt: skip
        assert_same(built, surface, ends)


@settings(max_examples=5)
@given(splines())
def test_bezier_patches(surface: BsplineSurface) -> None:
    built = convert(surface, [ToBezier()])
    assert isinstance(built, PatchSurface)
    assert (built.up, built.name, built.parts) == ("z", "sail", ())
    u, v = (
        to_fractions(knot.breaks(k, p))
        for k, p in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    cells = list(product(pairwise(u), pairwise(v)))
    assert len(built.patches) == len(cells)
    for number, ((a, b), (c, d)) in enumerate(cells):
        there = define_patch_values(built, number)
        for s, t in ((Fraction(0), Fraction(2, 7)), (Fraction(3, 8), Fraction(5, 8))):
            expected = evaluate_values(surface, (a + (b - a) * s, c + (d - c) * t))
            np.testing.assert_allclose(there(s, t), expected, rtol=0, atol=4e-12)


@settings(max_examples=6)
@given(splines(), st.floats(0.1, 0.9), st.none() | st.floats(0.1, 0.9))
def test_split(surface: BsplineSurface, share: float, other: float | None) -> None:
    """A group of splines over parts of the domain, which begin where another ends."""
    (low, high), (bottom, top) = find_domain(surface, 0), find_domain(surface, 1)
    u = low + share * (high - low)
    v = None if other is None else bottom + other * (top - bottom)
    assume(_has_room(surface.knot_vectors[0], low, u))
    assume(_has_room(surface.knot_vectors[0], u, high))
    if v is not None:
        assume(_has_room(surface.knot_vectors[1], bottom, v))
        assume(_has_room(surface.knot_vectors[1], v, top))
    built = convert(surface, [Split(u, v)])
    assert isinstance(built, GroupSurface)
    assert (built.up, built.name) == ("z", "sail")
    along_v = [(bottom, top)] if v is None else [(bottom, v), (v, top)]
    cells = list(product([(low, u), (u, high)], along_v))
    assert len(built.members) == len(cells)
    for member, cell in zip(built.members, cells, strict=True):
        piece = member.surface
        assert isinstance(piece, BsplineSurface)
        assert (find_domain(piece, 0), find_domain(piece, 1)) == cell
        assert_same(piece, surface)


@pytest.mark.parametrize("shape", [(3, 3), (6, 7)])
def test_white_stays_white(shape: tuple[int, int]) -> None:
    """Without clipping to the net, rounding would give invalid colours."""
    rng = np.random.default_rng(4)
    surface = BsplineSurface(
        rng.uniform(-1, 1, (6, 7, 3)), (2, 3), ("uniform", "periodic"),
        channels=Channels(colors=np.ones((*shape, 3))),
    )  # fmt: skip
    for operation in (ToBezier(), Elevate((5, 5)), Restrict(u=(0.3, 2.1))):
        built = convert(surface, [operation])
        assert isinstance(built, BsplineSurface | PatchSurface)
        assert built.channels.colors is not None
        assert (built.channels.colors == 1).all()


@pytest.mark.parametrize(
    "operation", [Elevate((4, 2)), Elevate((5, 4)), Restrict(v=(0.5, 2.25)), Reverse("u")]
)
@pytest.mark.parametrize("rational", [False, True])
def test_closed_surfaces_stay_closed(operation: Operation, rational: bool) -> None:
    rng = np.random.default_rng(3)
    weights = rng.uniform(0.2, 5, (7, 6)) if rational else None
    surface = BsplineSurface(
        rng.uniform(-1, 1, (7, 6, 3)), (3, 2), ("periodic", "clamped"), weights
    )
    built = convert(surface, [operation])
    before, after = (build_mesh(s.lower(), resolution=(3, 3)).report for s in (surface, built))
    assert after.closure == before.closure
    assert after.closure is not None
    assert after.closure.u == "C1"
    assert before.boundary_edges > 0
    if not isinstance(operation, Restrict):
        assert after.boundary_edges == before.boundary_edges


def test_a_parameter_near_a_knot_by_rounding_is_that_knot() -> None:
    for near, exact in (
        (Split(u=1 + 1e-12), Split(u=1.0)),
        (Restrict(u=(0.5, 1 + 1e-12)), Restrict(u=(0.5, 1.0))),
        (Restrict(v=(-1e-15, 2)), Restrict(v=(0.0, 2.0))),
    ):
        one, other = (
            build_mesh(convert(build_cubic(), [parameter]).lower()) for parameter in (near, exact)
        )
        assert np.array_equal(one.positions, other.positions)


def build_cubic(**more: object) -> BsplineSurface:
    net = np.random.default_rng(6).uniform(-1, 1, (6, 6, 3))
    return BsplineSurface(net, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("operation", "code", "pointer"),
    [
        (Elevate((3, 2)), "degree_too_low", "/degree/1"),
        (Restrict(u=(0, 3.5)), "out_of_range", "/u/1"),
        (Restrict(v=(-1, 2)), "out_of_range", "/v/0"),
        (Restrict(v=(0.5, 0.5 + 1e-15)), "knots_too_close", "/v"),
        (Restrict(u=(1e-15, 3e-15)), "knots_too_close", "/u"),  # one knot
        (Split(u=0.0), "out_of_range", "/u"),
        (Split(u=1.0, v=3.0), "out_of_range", "/v"),
        (Split(at=(0.25, 0.25, 0.5)), "unknown_field", "/at"),
    ],
)
def test_refusals(operation: Operation, code: str, pointer: str) -> None:
    with pytest.raises(SurfaceError) as caught:
        convert(build_cubic(), [Transpose(), operation])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == (code, f"/operations/1{pointer}")


def test_too_large_results_are_refused_before_they_are_built() -> None:
    for operation in (Elevate((4, 4)), ToBezier()):
        with pytest.raises(SurfaceError) as caught:
            convert(build_cubic(), [operation], SizeLimits(40))
        assert caught.value.issues[0].code == "too_many_control_points"
    with pytest.raises(SurfaceError) as caught:
        convert(build_cubic(), [Elevate((3, 9))], SizeLimits(degree=8))
    assert caught.value.issues[0].pointer == "/operations/0/degree/1"


def test_conversions_of_minutes_are_refused() -> None:
    knots = np.repeat(np.arange(800.0), 31)
    knots = np.concatenate([[0.0] * 2, knots, [799.0] * 2])
    net = np.zeros((len(knots) - 33, 2, 3))
    surface = BsplineSurface(net, (32, 1), (knots, "clamped"))
    with pytest.raises(SurfaceError) as caught:
        convert(surface, [Elevate((64, 1))])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("too_many_knots", "/operations/0/degree/0")
