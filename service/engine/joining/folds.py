"""Open edges that run back along themselves, and where they turn.

A tube that is pinched flat has at its end a curve that is passed twice, there and back. If the
curve turns inside an edge, both halves of the edge are one curve: a cut at the turn makes them one
edge with two sides, for meshes and for measures alike. A Bézier curve C that runs back along itself
is an even function about the parameter τ of the turn: C(τ + s) = C(τ − s). So C′ vanishes at τ, and
has opposite directions on both sides of it. No curve but a point is even about two parameters: it
would be periodic.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.joining.open_edges import OpenEdges, evaluate_curves, evaluate_with_slope
from service.engine.vectors import dot, length

BISECTIONS = 54
"""Bisections of an interval of parameters, until it is as short as their rounding."""

MIN_TURN = 2.0**-10
"""The least parameter of a turn, and the largest is 1 less this: shorter pieces are no edges."""


def find_folds(edges: OpenEdges, radius: float) -> tuple[Ints, FloatArray, FloatArray]:
    """The open edges that run back along themselves, and the parameters of their turns.

    Only edges that may do so as a whole or in part are examined: those along which the direction
    of the curve is reversed between two neighbouring samples.

    Parameters
    ----------
    radius : float
        Model units. An edge runs back along itself if the root mean square of the distances of
        samples on both sides of the turn is at most this.

    Returns
    -------
    edge : ndarray of int, shape (K,)
        Numbers of edges, each once.
    at, slack : ndarrays of float64, shape (K,)
        The parameters of the turns, and the largest difference of parameters that count as equal.
    """
    found: list[tuple[Ints, FloatArray]] = []
    for group in edges.curves:
        degree = group.points.shape[1] - 1
        if degree < 2:
            continue
        samples = np.linspace(0, 1, 4 * degree + 2)
        curves, weights = group.points, group.weights
        slopes = np.stack(
            [evaluate_with_slope(curves, weights, np.full(len(curves), t))[1] for t in samples], 1
        )
        is_turn = dot(slopes[:, 1:], slopes[:, :-1], -1) < 0
        rows, before = np.nonzero(is_turn)
        if not len(rows):
            continue
        nets, w = curves[rows], None if weights is None else weights[rows]
        direction = slopes[rows, before]
        at = _find_turns(nets, w, direction, samples[before], samples[before + 1])
        is_fold = _is_even(nets, w, at, radius) & (at > MIN_TURN) & (at < 1 - MIN_TURN)
        rows, first = np.unique(rows[is_fold], return_index=True)
        found.append((group.ids[rows], at[is_fold][first]))
    if not found:
        return np.empty(0, np.intp), np.empty(0), np.empty(0)
    edge, at = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return edge, at, np.full(len(edge), 2.0**-26)


def _find_turns(
    nets: FloatArray,
    weights: FloatArray | None,
    direction: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Parameters (m,) in [low, high] where the slope has no part along the direction (m, 3)."""
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        _, slope = evaluate_with_slope(nets, weights, middle)
        is_before = dot(slope, direction, -1) > 0
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    return (low + high) / 2


def _is_even(nets: FloatArray, weights: FloatArray | None, at: FloatArray, radius: float) -> Bools:
    """Whether curves (m, n+1, 3) are even functions about the parameters `at`, up to rounding."""
    degree = nets.shape[1] - 1
    shares = np.arange(1, 2 * degree + 2) / (2 * degree + 1)
    reach = np.minimum(at, 1 - at)[:, None] * shares
    there, back = (evaluate_curves(nets, weights, at[:, None] + k * reach) for k in (-1, 1))
    gaps = length(there - back, -1)
    is_even: Bools = np.sqrt(np.square(gaps).mean(axis=1)) <= radius
    return is_even
