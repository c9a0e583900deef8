"""Pieces of periodic splines that go over the seam."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.points.evaluate import evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.errors import InvalidRequest
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.convert.operations import Restrict, Transpose
from service.surface.convert.refine_spline import find_domain
from service.surface.convert.table import convert
from tests.spline_strategies import random_points, random_weights


def evaluate(surface: BsplineSurface, uv: np.ndarray) -> np.ndarray:
    model = surface.lower()
    return np.asarray(
        evaluate_points(model, locate(model, PointsQuery(uv, patch=None, order=0)), 0)["positions"]
    )


def restrict(surface: BsplineSurface, operation: Restrict) -> BsplineSurface:
    result = convert(surface, [operation])
    assert isinstance(result, BsplineSurface)
    return result


@given(
    st.integers(0, 10**6),
    st.integers(1, 4),
    st.integers(3, 7),
    st.tuples(st.floats(-1, 1), st.floats(0.05, 1)),
    st.tuples(st.booleans(), st.booleans()),
)
def test_a_piece_over_the_seam_has_the_parameters_and_points_of_the_spline(
    seed: int, degree: int, count: int, share: tuple[float, float], kind: tuple[bool, bool]
) -> None:
    """It begins up to one period below the domain, or within it; u and v may be exchanged."""
    is_rational, is_exchanged = kind
    weights = random_weights(count, seed, 3) if is_rational else None
    net = random_points(count, seed, 3)
    colors = np.random.default_rng(seed).uniform(0, 1, (count, 3, 3))
    surface = BsplineSurface(
        net, (degree, 2), ("periodic", "clamped"), weights, channels=Channels(colors)
    )
    first, last = share[0] * count, sum(share) * count
    u = np.linspace(first, last, 7)[1:-1]
    uv = np.stack([u, np.full(5, 0.3)], axis=1)
    wrapped = np.stack([u % count, uv[:, 1]], axis=1)
    expected = evaluate(surface, wrapped)
    if is_exchanged:
        exchanged = convert(surface, [Transpose()])
        assert isinstance(exchanged, BsplineSurface)
        piece = restrict(exchanged, Restrict(v=(first, last)))
        uv = uv[:, ::-1]
    else:
        piece = restrict(surface, Restrict(u=(first, last)))
    assert find_domain(piece, int(is_exchanged)) == pytest.approx((first, last), abs=1e-9)
    np.testing.assert_allclose(evaluate(piece, uv), expected, atol=1e-11)
    assert piece.channels.colors is not None
    assert piece.channels.colors.shape == piece.control_net.shape


@pytest.mark.parametrize(
    ("piece", "pointer"),
    [((-5.5, -5.2), "/u/0"), ((5.5, 6), "/u/0"), ((4.0, 9.5), "/u/1"), ((-1.0, 4.5), "/u/1")],
)
def test_pieces_are_at_most_one_period_long_and_begin_one_period_below(
    piece: tuple[float, float], pointer: str
) -> None:
    surface = BsplineSurface(random_points(5, 1, 2), (3, 1), ("periodic", "clamped"))
    with pytest.raises(InvalidRequest) as refusal:
        convert(surface, [Restrict(u=piece)])
    assert [(issue.code, issue.pointer) for issue in refusal.value.issues] == [
        ("out_of_range", f"/operations/0{pointer}")
    ]
