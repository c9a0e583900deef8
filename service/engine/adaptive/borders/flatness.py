"""Whether pieces of curves may be straight segments, decided by their shapes and a goal.

Every decision depends on its own piece and on the goal alone. Chains of several edges are cut at
the knot in the middle until each piece may be straight, or is a single edge.

Proof in docs/proofs.md: "Curves at equal parameters".
"""

from dataclasses import dataclass, replace
from math import cos, inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.borders.curve_shapes import (
    Shapes,
    find_tangents,
    measure_lengths,
    measure_shapes,
)
from service.engine.adaptive.borders.curves import Curves
from service.engine.adaptive.cutting.estimate import CURVE_SHARE
from service.engine.adaptive.cutting.normal_variation import find_chord
from service.engine.adaptive.limits import SidePieces
from service.engine.bounds.faces import DEPTH
from service.engine.bounds.goal import Goal, build_tolerance_error
from service.engine.vectors import project

NET_SHARE = 0.95
"""Share of the tolerance up to which the net of a piece may deviate from its chord. The nets of
narrow triangles along a side shrink towards this net, so they pass once they are narrow enough."""

DEVIATION_SHARES = (1 / 16, 1 / 2, 1 / 2)
"""Largest deviations of nets, as shares of their chords, for every tolerance: of a chain that was
not cut, of its halves, and of their halves. So a curve that turns back on itself always gets
vertices that show it. And two chains between the same two corners, as at the end of a wing, become
one segment only if both are nearly straight: they turn by at most some twenty degrees."""

MOST_CUTS_OF_CLOSED = 8
"""Number of cuts after which a piece is no longer cut for ending where it began; without a limit, a
piece that is one point would be cut for ever."""

MOST_HALVINGS_FOR_ANGLE = 12
"""Number of halvings of an edge after which it is no longer cut for an angle: at a cusp no number
of halvings is enough."""

NEARLY_CLOSED = 2.0**-20
"""A piece ends where it began if its chord is at most this share of the deviation of its net."""


@dataclass(frozen=True, eq=False, slots=True)
class CutDecision:
    """Which of M pieces must be cut, and why; all of shape (M,).

    Attributes
    ----------
    cut : ndarray of bool
        Pieces that must be cut.
    closed : ndarray of bool
        Pieces that must be cut because they end in their first point.
    hopeless : ndarray of bool
        Pieces that are too far from their chords, but that no cut helps: their rounding errors are
        too large, or they are results of `DEPTH` halvings.
    allowed : ndarray of float64
        Allowed deviations.
    """

    cut: Bools
    closed: Bools
    hopeless: Bools
    allowed: FloatArray


def decide_cuts(
    shapes: Shapes,
    goal: Goal,
    cuts: Ints,
    halvings: Ints | int = 0,
    *,
    origin: FloatArray,
    slack: FloatArray,
) -> CutDecision:
    """Decide which pieces must be cut.

    A piece is cut if it is too far from its chord (at equal parameters if the goal has two sides)
    or turns too much. After fewer than three cuts, it is also cut if its deviation is large for its
    length.

    Parameters
    ----------
    cuts, halvings : ndarray of int, shape (M,)
        Number of cuts that led from the chain to the piece, and how many of them halved its edge.
    origin : ndarray of float64, shape (M, 3)
        The points that were subtracted from nets.
    slack : ndarray of float64, shape (M,)
        Bounds of the rounding of nets.
    """
    allowed = goal.find_allowed(_measure_distances_to_eye(shapes, goal, origin))
    far = shapes.net > NET_SHARE * allowed - slack
    far |= shapes.curve > CURVE_SHARE * allowed - slack
    far |= shapes.apart > NET_SHARE * allowed - slack
    hopeless = far & ((CURVE_SHARE * allowed <= slack) | (halvings == DEPTH))
    deviates = shapes.net > slack
    share = np.array(DEVIATION_SHARES)[np.minimum(cuts, len(DEVIATION_SHARES) - 1)]
    bent = deviates & (shapes.net > share * shapes.chord) & (cuts < len(DEVIATION_SHARES))
    closed = (shapes.chord == 0) | deviates & (shapes.chord <= NEARLY_CLOSED * shapes.net)
    closed &= cuts < MOST_CUTS_OF_CLOSED
    cut = far | bent | closed
    if goal.angle < inf:
        cut |= (shapes.cosine < cos(goal.angle)) & (halvings < MOST_HALVINGS_FOR_ANGLE)
    return CutDecision(cut, closed, hopeless, allowed)


def refuse_hopeless(decision: CutDecision, exists: Bools, slack: FloatArray) -> None:
    """Raise an error if a hopeless piece exists; halves of a piece that is not cut do not exist.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if it is below the rounding errors, or if `DEPTH` halvings are not
        enough.
    """
    hopeless = decision.hopeless & exists
    if hopeless.any():
        least = float(decision.allowed[hopeless].min())
        # Well above the limit `slack` / `CURVE_SHARE`.
        enough = 4 * float(slack[hopeless].max())
        raise build_tolerance_error(f"{least:.6g}", f"more than {enough:.3g} for this surface")


def _measure_distances_to_eye(shapes: Shapes, goal: Goal, origin: FloatArray) -> FloatArray:
    """Distances from the eye to the boxes of pieces; 0 without a view."""
    if goal.view is None:
        return np.zeros(len(origin))
    eye = goal.view.eye - origin
    return measure_lengths(np.maximum(np.maximum(shapes.low - eye, eye - shapes.high), 0.0))


def cut_at_knots(
    curves: Curves, chains: Ints, goal: Goal, pieces: SidePieces
) -> tuple[Ints, Ints, Ints, Bools]:
    """Cut `chains`, of several edges each, at knots in the middle until pieces may be straight.

    Returns
    -------
    straight : ndarray of int
        First edges of straight pieces of several edges.
    row, cuts, forced : ndarrays of int, int and bool
        Single edges that remain to be halved, the number of cuts that led to each, and whether each
        must be cut in any case.
    """
    # The edges of each piece are first, …, last − 1.
    first, last = curves.start[chains], curves.start[chains + 1]
    cuts, forced = np.zeros_like(first), np.zeros(len(first), dtype=bool)
    straight, singles = [first[:0]], [(first[:0], cuts[:0], forced[:0])]
    while True:
        single = last - first == 1
        singles.append((first[single], cuts[single], forced[single]))
        first, last, cuts, forced = (column[~single] for column in (first, last, cuts, forced))
        if not len(first):
            row, cuts, forced = (np.concatenate(parts) for parts in zip(*singles, strict=True))
            return np.concatenate(straight), row, cuts, forced
        decision, slack = _judge_runs(curves, first, last, cuts, goal)
        refuse_hopeless(decision, np.ones(len(first), dtype=bool), slack)
        cut = decision.cut | forced
        straight.append(first[~cut])
        first, last = first[cut], last[cut]
        pieces.add(curves.uses[curves.owner[first]])
        middle = (first + last) // 2
        first, last = np.append(first, middle), np.append(middle, last)
        cuts, forced = np.tile(cuts[cut] + 1, 2), np.tile(decision.closed[cut], 2)


def _judge_runs(
    curves: Curves, first: Ints, last: Ints, cuts: Ints, goal: Goal
) -> tuple[CutDecision, FloatArray]:
    """Which runs of edges must be cut, and bounds of the rounding of the nets of each run.

    The nets of all edges of a run are compared with one chord.
    """
    count = last - first
    begin = np.cumsum(count) - count
    run, rows = expand_runs(count, first)
    owner = curves.owner[first]
    slack = curves.slack[owner]
    ends = np.stack([curves.nets[first, 0], curves.nets[last - 1, -1]], axis=1)
    tangents = None
    if goal.angle < inf:
        into, _ = find_tangents(curves.nets[first], slack)
        _, out = find_tangents(curves.nets[last - 1], slack)
        tangents = into[run], out[run]
    chords = project(ends, -1)
    chord_parts = None
    if goal.two_sided:
        # All spans have one length, so each has an equal share of the chord.
        step = (chords[:, 1] - chords[:, 0]) / count[:, None]
        number = (np.arange(len(run)) - begin[run])[:, None]
        low = chords[run, 0] + number * step[run]
        chord_parts = np.stack([low, low + step[run]], axis=1)
    shapes = measure_shapes(
        curves.nets[rows], chords[run], chord_parts=chord_parts, tangents=tangents
    )
    decision = decide_cuts(
        shapes.combine_runs(begin), goal, cuts, origin=curves.origin[owner], slack=slack
    )
    if curves.normals is not None:
        _, edge_turns = curves.normals.measure_turns(
            curves.edge[rows], curves.backward[rows], np.zeros(len(rows)), np.ones(len(rows))
        )
        far = np.add.reduceat(edge_turns, begin) > find_chord(goal.angle)
        decision = replace(decision, cut=decision.cut | far)
    return decision, slack
