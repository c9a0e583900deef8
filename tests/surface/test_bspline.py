"""B-spline surfaces: their lowering to Bézier patches, compared in exact arithmetic; refusals."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.exact import to_exact_net
from oracles.splines import spline_surface_point, to_fractions
from service.bases import knots as knot
from service.bases.bernstein import bernstein
from service.engine.accuracy import Accuracy
from service.errors import InvalidRequest, Issue
from service.surface import bspline
from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import build_mesh
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

Array = np.ndarray[Any, np.dtype[np.float64]]

LOCAL_PARAMETERS = np.array([0.0, 0.25, 0.6, 1.0])
"""Parameters of a patch, over [0, 1], at which tests evaluate it along u and along v."""

small_knots = knot_vectors(st.integers(1, 4), max_spans=3)
seeds = st.integers(0, 10**6)


def build_surface(u: KnotVector, v: KnotVector, seed: int, is_rational: bool) -> BsplineSurface:
    """A random surface over these knots, with or without weights."""
    net = random_points(u.point_count, seed, v.point_count)
    weights = random_weights(u.point_count, seed + 1, v.point_count) if is_rational else None
    return BsplineSurface(net, (u.degree, v.degree), (u.knots, v.knots), weights)


def evaluate_model(model: PatchModel, t: Array = LOCAL_PARAMETERS) -> Array:
    """Points (P, m, m, 3) of all patches at local parameters t × t, as sums of basis functions."""
    (batch,) = model.batches
    assert isinstance(batch, TensorPatches)
    p, q = batch.degree
    grid = np.einsum("ai,bj->abij", bernstein(p, t), bernstein(q, t))
    if batch.weights is None:
        polynomial: Array = np.einsum("abij,pijd->pabd", grid, batch.points)
        return polynomial
    weighted_basis = grid * batch.weights[:, None, None]
    total = weighted_basis.sum(axis=(-2, -1))
    points: Array = np.einsum("pabij,pijd->pabd", weighted_basis, batch.points) / total[..., None]
    return points


def list_parameters(model: PatchModel, t: Array = LOCAL_PARAMETERS) -> tuple[Array, Array]:
    """The parameters u and v in the domain, (P, m) each, at local parameters t of all patches."""
    assert model.domain is not None
    u, v = (b[:-1, None] + np.diff(b)[:, None] * t for b in (model.domain.u, model.domain.v))
    return np.repeat(u, len(v), axis=0), np.tile(v, (len(u), 1))


@given(small_knots, small_knots, seeds, st.booleans())
def test_patches_agree_with_the_recursion_of_cox_and_de_boor(
    u: KnotVector, v: KnotVector, seed: int, is_rational: bool
) -> None:
    """Points are compared at local parameters 0 and 0.75 of every patch, in exact arithmetic."""
    surface = build_surface(u, v, seed, is_rational)
    model = surface.lower()
    net = to_exact_net(surface.control_net, surface.weights)
    exact_knots = to_fractions(u.knots), to_fractions(v.knots)
    t = np.array([0.0, 0.75])
    actual = evaluate_model(model, t)
    for k, (us, vs) in enumerate(zip(*list_parameters(model, t), strict=True)):
        for a, b in np.ndindex(2, 2):
            place = Fraction(us[a]), Fraction(vs[b])
            expected = spline_surface_point(net, exact_knots, surface.degree, place)
            np.testing.assert_allclose(actual[k, a, b], [float(x) for x in expected], atol=1e-13)


def test_a_spline_of_one_span_is_lowered_to_its_own_net() -> None:
    """Over clamped knots of one span, a B-spline is a Bézier patch."""
    net, weights = random_points(4, 3, 3), random_weights(4, 3, 3)
    model = BsplineSurface(net, (3, 2), weights=weights, up="z", name="bowl").lower()
    (batch,) = model.batches
    np.testing.assert_array_equal(batch.points, net[None])
    np.testing.assert_array_equal(batch.weights, weights[None])
    assert (model.name, model.up, model.parts) == ("bowl", "z", (Part("bowl", 0, 1),))


@given(knot_vectors(), knot_vectors(), seeds, st.booleans())
def test_patches_share_their_edges_bit_for_bit(
    u: KnotVector, v: KnotVector, seed: int, is_rational: bool
) -> None:
    """Neighbouring patches have equal control points and weights on their common side."""
    model = build_surface(u, v, seed, is_rational).lower()
    (batch,), domain = model.batches, model.domain
    assert domain is not None
    np.testing.assert_array_equal(domain.u, knot.breaks(u.knots, u.degree))
    np.testing.assert_array_equal(domain.v, knot.breaks(v.knots, v.degree))
    for net in (batch.points, batch.weights):
        if net is not None:
            grid = net.reshape(len(domain.u) - 1, len(domain.v) - 1, *net.shape[1:])
            np.testing.assert_array_equal(grid[:-1, :, -1], grid[1:, :, 0])
            np.testing.assert_array_equal(grid[:, :-1, :, -1], grid[:, 1:, :, 0])


@given(knot_vectors(), knot_vectors(), seeds, st.booleans())
def test_the_reversed_surface_has_reversed_patches(
    u: KnotVector, v: KnotVector, seed: int, is_rational: bool
) -> None:
    """u and v are reversed at once; points and weights are equal bit for bit."""
    forward = build_surface(u, v, seed, is_rational)
    # 3 − u is exact, because the knots of the strategy are multiples of 1/16.
    backward = BsplineSurface(
        forward.control_net[::-1, ::-1],
        forward.degree,
        (3 - u.knots[::-1], 3 - v.knots[::-1]),
        None if forward.weights is None else forward.weights[::-1, ::-1],
    )
    (expected,), (batch,) = forward.lower().batches, backward.lower().batches
    np.testing.assert_array_equal(batch.points[::-1, ::-1, ::-1], expected.points)
    if expected.weights is not None and batch.weights is not None:
        np.testing.assert_array_equal(batch.weights[::-1, ::-1, ::-1], expected.weights)


def test_lowering_in_small_blocks_gives_the_same_patches(monkeypatch: pytest.MonkeyPatch) -> None:
    """The service lowers large nets in blocks, so that it needs little memory at a time."""
    surface = BsplineSurface(random_points(9, 1, 8), weights=random_weights(9, 1, 8))
    (expected,) = surface.lower().batches
    monkeypatch.setattr(bspline, "BLOCK_POINTS", 1)
    (in_blocks,) = surface.lower().batches
    np.testing.assert_array_equal(in_blocks.points, expected.points)
    np.testing.assert_array_equal(in_blocks.weights, expected.weights)


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("degree", [(3, 3), (2, 1), (4, 5)])
def test_periodic_directions_close(degree: tuple[int, int], is_rational: bool) -> None:
    """n distinct control points give n spans, and the last patch shares its side with the first."""
    net, weights = random_points(5, 3, 4), random_weights(5, 4, 4) if is_rational else None
    model = BsplineSurface(net, degree, ("periodic", "periodic"), weights).lower()
    assert model.patch_count == 20
    p, q = degree
    for grid in (model.batches[0].points, model.batches[0].weights):
        if grid is not None:
            patches = grid.reshape(5, 4, p + 1, q + 1, -1)
            np.testing.assert_array_equal(patches[-1, :, -1], patches[0, :, 0])
            np.testing.assert_array_equal(patches[:, -1, :, -1], patches[:, 0, :, 0])


def test_equal_control_points_at_a_pole_give_a_collapsed_side() -> None:
    """The first and the last row of control points are equal; their weights differ."""
    net, weights = random_points(7, 3, 6), random_weights(7, 4, 6)
    net[0], net[-1] = (0.1, 0.2, 0.7), (-0.3, 1 / 3, 9.1)
    model = BsplineSurface(net, (3, 2), ("clamped", "periodic"), weights).lower()
    # 4 × 6 patches with four sides each: u = 0, u = 1, v = 0 and v = 1.
    is_collapsed = model.batches[0].collapsed.reshape(4, 6, 4)
    assert is_collapsed[0, :, 0].all()
    assert is_collapsed[-1, :, 1].all()
    assert is_collapsed.sum() == 12


def test_a_surface_is_frozen_and_copies_the_arrays_of_the_caller() -> None:
    """Later changes of these arrays have no effect; the arrays of the surface are read-only."""
    net, knots = random_points(4, 1, 4), knot.clamped_knots(4, 3)
    surface = BsplineSurface(net, knots=(knots, "clamped"))
    original_net = net.copy()
    net[:], knots[:] = 7, 7
    np.testing.assert_array_equal(surface.control_net, original_net)
    np.testing.assert_array_equal(surface.knots[0], knot.clamped_knots(4, 3))
    (batch,) = surface.lower().batches
    for array in (surface.control_net, surface.knots[0], batch.points):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0  # type: ignore[index]


VALID_FIELDS: dict[str, Any] = {"control_net": np.zeros((5, 4, 3)), "degree": (2, 3)}
KNOTS = [0, 0, 0, 1, 2, 3, 3, 3]
"""Valid knots along u for `VALID_FIELDS`."""


def list_issues(**fields: Any) -> tuple[Issue, ...]:
    """The issues of the surface of `VALID_FIELDS` with these fields replaced."""
    with pytest.raises(InvalidRequest) as caught:
        BsplineSurface(**(VALID_FIELDS | fields))
    return caught.value.issues


def replace_u_knots(*vector: float) -> dict[str, Any]:
    """The field `knots` with this vector along u, and clamped knots along v."""
    return {"knots": (np.array(vector), "clamped")}


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({"degree": (0, 3)}, "out_of_range", "/degree/0"),
        ({"degree": (2, 65)}, "degree_too_high", "/degree/1"),
        ({"degree": (5, 3)}, "too_few_points", "/control_net"),
        ({"degree": (2, 4)}, "too_few_points", "/control_net"),
        (
            {"control_net": np.zeros((2, 4, 3)), "knots": ("periodic", "clamped")},
            "too_few_points",
            "/control_net",
        ),
        ({"knots": ("clamped", "open")}, "wrong_value", "/knots/1"),
        (replace_u_knots(*KNOTS[1:]), "wrong_length", "/knots/0"),
        (replace_u_knots(*KNOTS, 3), "wrong_length", "/knots/0"),
        (replace_u_knots(0, 0, 0, 2, 1, 3, 3, 3), "knots_decrease", "/knots/0/4"),
        (replace_u_knots(0, 0, 0, np.nan, 1, 3, 3, 3), "not_finite", "/knots/0/3"),
        (replace_u_knots(0, 0, 0, 1, 2, 3, 3, np.inf), "not_finite", "/knots/0/7"),
        (replace_u_knots(0, 0, 0, 1, 2, 3, 3, 1e39), "knot_too_large", "/knots/0/7"),
        (replace_u_knots(0, 0, 0, 0, 2, 3, 3, 3), "knot_multiplicity", "/knots/0/3"),
        (replace_u_knots(0, 0, 1, 1, 1, 1, 3, 3), "knot_multiplicity", "/knots/0/5"),
        (replace_u_knots(-1, 0, 1, 1, 1, 1, 2, 3), "knot_multiplicity", "/knots/0/5"),
        (
            {"degree": (4, 3), **replace_u_knots(0, 0, 0, 1, 2, 2, 3, 3, 3, 3)},
            "empty_domain",
            "/knots/0",
        ),
        (replace_u_knots(0, 0, 0, 1e-320, 3e-320, 3e-320, 1, 1), "knots_too_close", "/knots/0/3"),
        ({"weights": np.ones((4, 5))}, "weights_shape", "/weights"),
        ({"weights": np.zeros((5, 4))}, "weight_not_positive", "/weights/0/0"),
        ({"control_net": np.zeros((5, 4, 2))}, "wrong_dimension", "/control_net"),
        ({"up": "x"}, "wrong_value", "/up"),
    ],
)
def test_invalid_fields_are_refused_with_code_and_pointer(
    fields: dict[str, Any], code: str, pointer: str
) -> None:
    """The issue also has texts for `got` and `needed`."""
    issue = list_issues(**fields)[0]
    assert (issue.code, issue.pointer) == (code, pointer)
    assert issue.got
    assert issue.needed


def test_the_issue_names_the_needed_number_of_knots() -> None:
    """n + p + 1 knots are needed; the first and the last of them may be omitted."""
    (issue,) = list_issues(**replace_u_knots(*KNOTS[1:]))
    assert (issue.got, issue.needed) == ("7 knots", "8 = 5 + 2 + 1, or 6")


ROUNDING = 1e-13
"""A difference of knots, relative to the domain, that is due to rounding."""


@pytest.mark.parametrize(
    ("u_knots", "expected", "merged_count"),
    [
        ([0, 0, 0, 1, 1 + ROUNDING, 3, 3, 3], [0, 0, 0, 1, 1, 3, 3, 3], 1),
        ([0, 0, 0, 1, 1 + 1e-9, 3, 3, 3], [0, 0, 0, 1, 1 + 1e-9, 3, 3, 3], 0),
        ([-ROUNDING, 0, ROUNDING, 1, 2, 3, 3, 3 + ROUNDING], [ROUNDING] * 3 + [1, 2, 3, 3, 3], 3),
        ([0, 0, 0, 1, 1 + ROUNDING, 1 + 2 * ROUNDING, 3, 3, 3], None, 0),
        ([1e6, 1e6, 1e6, 1e6 + 1e-3, 1e6 + 0.5, 1e6 + 1, 1e6 + 1, 1e6 + 1], None, 0),
    ],
    ids=["rounding", "not rounding", "at the ends", "more than p are kept", "far from zero"],
)
def test_knots_that_differ_by_rounding_are_made_equal(
    u_knots: list[float], expected: list[float] | None, merged_count: int
) -> None:
    """`expected` are the knots of the computation; None if they are those of the request."""
    net = np.random.default_rng(1).random((len(u_knots) - 3, 4, 3))
    surface = BsplineSurface(net, (2, 3), (np.array(u_knots), "clamped"))
    exact = BsplineSurface(net, (2, 3), (np.array(expected or u_knots), "clamped"))
    assert surface.knots[0].tolist() == u_knots  # type: ignore[union-attr]
    np.testing.assert_array_equal(surface.knot_vectors[0], expected or u_knots)
    model, exact_model = surface.lower(), exact.lower()
    assert np.array_equal(model.batches[0].points, exact_model.batches[0].points)
    for accuracy in (None, Accuracy(tolerance=0.1)):
        assert build_mesh(model, accuracy=accuracy).report.merged_knots == merged_count


def test_the_first_and_the_last_knot_may_be_omitted() -> None:
    """Some systems omit the first and the last knot, which do not affect the surface."""
    net = np.random.default_rng(2).random((5, 4, 3))
    all_knots = np.array([-1, 0, 0, 1, 2, 3, 3.5, 4])
    points, expected = (
        BsplineSurface(net, (2, 3), (knots, "clamped")).lower().batches[0].points
        for knots in (all_knots[1:-1], all_knots)
    )
    np.testing.assert_allclose(points, expected, atol=1e-15)
    # The omitted knots are equal to their neighbours: here 0 would occur four times.
    assert list_issues(**replace_u_knots(0, 0, 0, 1, 3, 3))[0].code == "knot_multiplicity"


def test_surfaces_just_within_the_limits_are_accepted() -> None:
    """The first has the highest degree, the second a large domain and a knot of multiplicity p + 1.

    Weights whose ratio is twice the limit are refused.
    """
    assert BsplineSurface(np.zeros((65, 2, 3)), (64, 1)).lower().patch_count == 1
    knots = np.array([-7e8, -7e8, -7e8, -1e6, -1e6, -1e6, 5e8, 5e8, 5e8])
    discontinuous = BsplineSurface(np.zeros((6, 2, 3)), (2, 1), (knots, "uniform"))
    assert discontinuous.lower().patch_count == 2
    weights = np.ones((4, 4))
    weights[0, 0] = 0.5 / MAX_WEIGHT_RATIO
    with pytest.raises(InvalidRequest):
        BsplineSurface(np.zeros((4, 4, 3)), weights=weights)


def test_too_many_patches_are_refused_because_of_their_number() -> None:
    """A patch of degree 1 has few control points, but needs as much work as any other patch."""
    (issue,) = list_issues(control_net=np.zeros((1010, 1010, 3)), degree=(1, 1))
    assert (issue.code, issue.pointer) == ("too_many_spans", "/control_net")
    assert issue.got == "1009 × 1009 spans"


@pytest.mark.parametrize(
    ("shape", "degree"),
    [
        ((1010, 1010), (3, 3)),  # 1007² patches of 4² points; the limit is 16 million
        ((1100, 2), (64, 1)),  # 1036 spans along u, whose extraction operators have 65² entries
        ((200, 200), (30, 30)),
    ],
)
def test_too_many_bezier_points_are_refused_before_they_are_computed(
    shape: tuple[int, int], degree: tuple[int, int]
) -> None:
    """The surface is refused when it is created, not when it is lowered."""
    (issue,) = list_issues(control_net=np.zeros((*shape, 3)), degree=degree)
    assert (issue.code, issue.pointer) == ("too_many_bezier_points", "/control_net")
    assert f"of degree {degree[0]}" in issue.got
