"""Hypothesis strategies for knot vectors and for splines over them.

Knots are multiples of 1/16, so sums and differences of knots are exact too, for example in a
reversed knot vector.
"""

from itertools import accumulate
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Array = NDArray[np.float64]


class KnotVector(NamedTuple):
    """A knot vector and its degree, which functions of `service.bases.knots` take as `*vector`."""

    knots: Array
    degree: int

    @property
    def point_count(self) -> int:
        """Number of control points."""
        return len(self.knots) - self.degree - 1


@st.composite
def knot_vectors(
    draw: st.DrawFn,
    degree: st.SearchStrategy[int] | None = None,
    discontinuous: bool = False,
    max_spans: int = 5,
) -> KnotVector:
    """Knot vectors of any domain, clamped at both ends, at one or at none.

    Each inner knot occurs at most p times. With `discontinuous` some occur p + 1 times, where the
    curve may jump.
    """
    p = draw(st.integers(1, 5) if degree is None else degree)
    spans = draw(st.integers(1, max_spans))
    step = st.integers(1, 40)
    steps = draw(st.lists(step, min_size=spans, max_size=spans))
    breaks = list(accumulate(steps, initial=draw(st.integers(-50, 50))))
    max_multiplicity = p + 1 if discontinuous else p
    inner_knots: list[int] = []
    for knot in breaks[1:-1]:
        inner_knots += [knot] * draw(st.integers(1, max_multiplicity))
    gap = st.integers(0, 20)
    gaps_before = draw(st.just([0] * p) | st.lists(gap, min_size=p, max_size=p))
    gaps_after = draw(st.just([0] * p) | st.lists(gap, min_size=p, max_size=p))
    outer_knots_before = [breaks[0] - x for x in accumulate(gaps_before)]
    outer_knots_after = [breaks[-1] + x for x in accumulate(gaps_after)]
    return KnotVector(
        np.array(
            [*reversed(outer_knots_before), breaks[0], *inner_knots, breaks[-1], *outer_knots_after]
        )
        / 16,
        p,
    )


def random_points(count: int, seed: int, *shape: int) -> Array:
    """Random control points, shape (count, *shape, 3)."""
    return np.random.default_rng(seed).uniform(-4, 4, (count, *shape, 3))


def random_weights(count: int, seed: int, *shape: int) -> Array:
    """Random weights in [0.2, 5], shape (count, *shape)."""
    return np.random.default_rng(seed).uniform(0.2, 5, (count, *shape))
