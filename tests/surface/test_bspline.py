"""B-spline surfaces: exact lowering, compared with oracles and other libraries; refusals."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases import knots as knot
from service.bases.bernstein import bernstein
from service.engine.adaptive.tolerance_spec import Accuracy
from service.errors import InvalidRequest, Issue
from service.surface import bspline
from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import build_mesh
from tests.oracles.exact import to_exact_net
from tests.oracles.splines import spline_surface_point, to_fractions
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

Array = np.ndarray[Any, np.dtype[np.float64]]

PLACES = np.array([0.0, 0.25, 0.6, 1.0])
"""Local parameters at which patches are compared."""

small_knots = knot_vectors(st.integers(1, 4), max_spans=3)
seeds = st.integers(0, 10**6)


def build_surface(u: KnotVector, v: KnotVector, seed: int, rational: bool) -> BsplineSurface:
    """A random surface over given knots."""
    net = random_points(u.points, seed, v.points)
    weights = random_weights(u.points, seed + 1, v.points) if rational else None
    return BsplineSurface(net, (u.degree, v.degree), (u.knots, v.knots), weights)


def evaluate_model(model: PatchModel, at: Array = PLACES) -> Array:
    """Points of all patches at local parameters at × at: (P, m, m, 3), by plain products."""
    (batch,) = model.batches
    assert isinstance(batch, TensorPatches)
    p, q = batch.degree
    grid = np.einsum("ai,bj->abij", bernstein(p, at), bernstein(q, at))
    if batch.weights is None:
        plain: Array = np.einsum("abij,pijd->pabd", grid, batch.points)
        return plain
    shares = grid * batch.weights[:, None, None]
    total = shares.sum(axis=(-2, -1))
    rational: Array = np.einsum("pabij,pijd->pabd", shares, batch.points) / total[..., None]
    return rational


def list_parameters(model: PatchModel, at: Array = PLACES) -> tuple[Array, Array]:
    """The domain's parameters at the same places: (P, m) each."""
    assert model.domain is not None
    u, v = (b[:-1, None] + np.diff(b)[:, None] * at for b in (model.domain.u, model.domain.v))
    return np.repeat(u, len(v), axis=0), np.tile(v, (len(u), 1))


@given(small_knots, small_knots, seeds, st.booleans())
def test_is_the_surface_of_cox_and_de_boor(
    u: KnotVector, v: KnotVector, seed: int, rational: bool
) -> None:
    """Checked in exact arithmetic, at inner parameters of every patch and at its borders."""
    surface = build_surface(u, v, seed, rational)
    model = surface.lower()
    net = to_exact_net(surface.control_net, surface.weights)
    exact = to_fractions(u.knots), to_fractions(v.knots)
    at = np.array([0.0, 0.75])
    actual = evaluate_model(model, at)
    for k, (us, vs) in enumerate(zip(*list_parameters(model, at), strict=True)):
        for a, b in np.ndindex(2, 2):
            place = Fraction(us[a]), Fraction(vs[b])
            expected = spline_surface_point(net, exact, surface.degree, place)
            np.testing.assert_allclose(actual[k, a, b], [float(x) for x in expected], atol=1e-13)


def test_one_span_keeps_its_control_net() -> None:
    """Making a surface does not lower it."""
    net, weights = random_points(4, 3, 3), random_weights(4, 3, 3)
    model = BsplineSurface(net, (3, 2), weights=weights, up="z", name="bowl").lower()
    (batch,) = model.batches
    np.testing.assert_array_equal(batch.points, net[None])
    np.testing.assert_array_equal(batch.weights, weights[None])
    assert (model.name, model.up, model.parts) == ("bowl", "z", (Part("bowl", 0, 1),))


@given(knot_vectors(), knot_vectors(), seeds, st.booleans())
def test_patches_share_their_edges_bit_for_bit(
    u: KnotVector, v: KnotVector, seed: int, rational: bool
) -> None:
    """Control points and weights of the common side."""
    model = build_surface(u, v, seed, rational).lower()
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
    u: KnotVector, v: KnotVector, seed: int, rational: bool
) -> None:
    """Bit for bit, in both directions at once."""
    forward = build_surface(u, v, seed, rational)
    there = BsplineSurface(
        forward.control_net[::-1, ::-1],
        forward.degree,
        (3 - u.knots[::-1], 3 - v.knots[::-1]),
        None if forward.weights is None else forward.weights[::-1, ::-1],
    )
    (forth,), (back,) = forward.lower().batches, there.lower().batches
    np.testing.assert_array_equal(back.points[::-1, ::-1, ::-1], forth.points)
    if forth.weights is not None and back.weights is not None:
        np.testing.assert_array_equal(back.weights[::-1, ::-1, ::-1], forth.weights)


def test_blocks_give_the_same_patches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Large nets are lowered piece by piece."""
    surface = BsplineSurface(random_points(9, 1, 8), weights=random_weights(9, 1, 8))
    (at_once,) = surface.lower().batches
    monkeypatch.setattr(bspline, "BLOCK_POINTS", 1)
    (in_turn,) = surface.lower().batches
    np.testing.assert_array_equal(in_turn.points, at_once.points)
    np.testing.assert_array_equal(in_turn.weights, at_once.weights)


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize("degree", [(3, 3), (2, 1), (4, 5)])
def test_periodic_directions_close(degree: tuple[int, int], rational: bool) -> None:
    """The distinct control points, given once: as many spans, and the last meets the first."""
    net, weights = random_points(5, 3, 4), random_weights(5, 4, 4) if rational else None
    model = BsplineSurface(net, degree, ("periodic", "periodic"), weights).lower()
    assert model.patch_count == 20
    p, q = degree
    for grid in (model.batches[0].points, model.batches[0].weights):
        if grid is not None:
            patches = grid.reshape(5, 4, p + 1, q + 1, -1)
            np.testing.assert_array_equal(patches[-1, :, -1], patches[0, :, 0])
            np.testing.assert_array_equal(patches[:, -1, :, -1], patches[:, 0, :, 0])


def test_a_pole_stays_one_point() -> None:
    """The equal control points of a NURBS sphere's pole, with their different weights."""
    net, weights = random_points(7, 3, 6), random_weights(7, 4, 6)
    net[0], net[-1] = (0.1, 0.2, 0.7), (-0.3, 1 / 3, 9.1)
    model = BsplineSurface(net, (3, 2), ("clamped", "periodic"), weights).lower()
    collapsed = model.batches[0].collapsed.reshape(4, 6, 4)
    assert collapsed[0, :, 0].all()
    assert collapsed[-1, :, 1].all()
    assert collapsed.sum() == 12


def test_is_frozen_and_copies_its_input() -> None:
    """Later changes of the caller's arrays have no effect; arrays of the surface are read-only."""
    net, knots = random_points(4, 1, 4), knot.clamped_knots(4, 3)
    surface = BsplineSurface(net, knots=(knots, "clamped"))
    before = net.copy()
    net[:], knots[:] = 7, 7
    np.testing.assert_array_equal(surface.control_net, before)
    np.testing.assert_array_equal(surface.knots[0], knot.clamped_knots(4, 3))
    (batch,) = surface.lower().batches
    for array in (surface.control_net, surface.knots[0], batch.points):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0  # type: ignore[index]


GOOD: dict[str, Any] = {"control_net": np.zeros((5, 4, 3)), "degree": (2, 3)}
KNOTS = [0, 0, 0, 1, 2, 3, 3, 3]


def list_issues(**fields: Any) -> tuple[Issue, ...]:
    """The issues of the good surface with these fields replaced."""
    with pytest.raises(InvalidRequest) as caught:
        BsplineSurface(**(GOOD | fields))
    return caught.value.issues


def replace_u_knots(*vector: float) -> dict[str, Any]:
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
def test_refuses_and_points(fields: dict[str, Any], code: str, pointer: str) -> None:
    """Code and pointer of the issue; its got and needed have texts."""
    issue = list_issues(**fields)[0]
    assert (issue.code, issue.pointer) == (code, pointer)
    assert issue.got
    assert issue.needed


def test_the_issue_names_the_number_of_knots() -> None:
    """n + p + 1, added up."""
    (issue,) = list_issues(**replace_u_knots(*KNOTS[1:]))
    assert (issue.got, issue.needed) == ("7 knots", "8 = 5 + 2 + 1, or 6")


ROUNDED = 1e-13
"""Differences of computed knots, as a share of the domain."""


@pytest.mark.parametrize(
    ("given", "expected", "count"),
    [
        ([0, 0, 0, 1, 1 + ROUNDED, 3, 3, 3], [0, 0, 0, 1, 1, 3, 3, 3], 1),
        ([0, 0, 0, 1, 1 + 1e-9, 3, 3, 3], [0, 0, 0, 1, 1 + 1e-9, 3, 3, 3], 0),
        ([-ROUNDED, 0, ROUNDED, 1, 2, 3, 3, 3 + ROUNDED], [ROUNDED] * 3 + [1, 2, 3, 3, 3], 3),
        ([0, 0, 0, 1, 1 + ROUNDED, 1 + 2 * ROUNDED, 3, 3, 3], None, 0),
        ([1e6, 1e6, 1e6, 1e6 + 1e-3, 1e6 + 0.5, 1e6 + 1, 1e6 + 1, 1e6 + 1], None, 0),
    ],
    ids=["equal", "near", "at the ends", "never more than p", "far from zero"],
)
def test_knots_that_differ_by_rounding_are_made_equal(
    given: list[float], expected: list[float] | None, count: int
) -> None:
    net = np.random.default_rng(1).random((len(given) - 3, 4, 3))
    surface = BsplineSurface(net, (2, 3), (np.array(given), "clamped"))
    exact = BsplineSurface(net, (2, 3), (np.array(expected or given), "clamped"))
    assert surface.knots[0].tolist() == given  # type: ignore[union-attr]
    np.testing.assert_array_equal(surface.knot_vectors[0], expected or given)
    model, other = surface.lower(), exact.lower()
    assert np.array_equal(model.batches[0].points, other.batches[0].points)
    for accuracy in (None, Accuracy(tolerance=0.1)):
        assert build_mesh(model, accuracy=accuracy).report.merged_knots == count


def test_the_first_and_the_last_knot_may_be_left_out() -> None:
    """Some systems write knots without the first and the last, which do not affect the domain."""
    net = np.random.default_rng(2).random((5, 4, 3))
    whole = np.array([-1, 0, 0, 1, 2, 3, 3.5, 4])
    short, long = (
        BsplineSurface(net, (2, 3), (knots, "clamped")) for knots in (whole[1:-1], whole)
    )
    points, expected = (surface.lower().batches[0].points for surface in (short, long))
    np.testing.assert_allclose(points, expected, atol=1e-15)
    assert list_issues(**replace_u_knots(0, 0, 0, 1, 3, 3))[0].code == "knot_multiplicity"


def test_accepts_surfaces_just_within_the_limits() -> None:
    """The highest degree, knots of full multiplicity, a domain of any place and size."""
    assert BsplineSurface(np.zeros((65, 2, 3)), (64, 1)).lower().patch_count == 1
    parted = np.array([-7e8, -7e8, -7e8, -1e6, -1e6, -1e6, 5e8, 5e8, 5e8])
    assert BsplineSurface(np.zeros((6, 2, 3)), (2, 1), (parted, "uniform")).lower().patch_count == 2
    weights = np.ones((4, 4))
    weights[0, 0] = 0.5 / MAX_WEIGHT_RATIO
    with pytest.raises(InvalidRequest):
        BsplineSurface(np.zeros((4, 4, 3)), weights=weights)


def test_too_many_patches_are_refused_by_number() -> None:
    """Patches of degree 1 have few control points, and cost as much."""
    (issue,) = list_issues(control_net=np.zeros((710, 710, 3)), degree=(1, 1))
    assert (issue.code, issue.pointer) == ("too_many_spans", "/control_net")
    assert issue.got == "709 × 709 spans"


@pytest.mark.parametrize(
    ("shape", "degree"), [((505, 505), (3, 3)), ((1100, 2), (64, 1)), ((200, 200), (30, 30))]
)
def test_too_many_bezier_points_are_refused_by_number(
    shape: tuple[int, int], degree: tuple[int, int]
) -> None:
    """The error is raised before any patch is made."""
    (issue,) = list_issues(control_net=np.zeros((*shape, 3)), degree=degree)
    assert (issue.code, issue.pointer) == ("too_many_bezier_points", "/control_net")
    assert f"of degree {degree[0]}" in issue.got
