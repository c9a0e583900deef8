"""Whether pieces of curves may be straight segments, decided by their shapes and a goal.

Every decision depends on its own piece and on the goal alone.
"""

from dataclasses import dataclass
from math import cos, inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.borders.curve_shapes import Shapes, measure_lengths
from service.engine.bounds.faces import DEPTH
from service.engine.bounds.goal import Goal
from service.errors import InvalidRequest, Issue

OF_NET = 0.95
"""Share of the tolerance up to which the net of a piece may deviate from its chord. The nets of
narrow triangles along a side shrink towards this net, so they pass once they are narrow enough."""

OF_CURVE = 0.7
"""Share of the tolerance up to which the piece itself may deviate from its chord; the rest is for
the surface beside it."""

SHAPELY = (1 / 16, 1 / 2, 1 / 2)
"""Largest deviation of the net of a chain, as a share of its chord, without a cut, whatever the
tolerance; then that of its halves, and of their halves. So a curve that turns back on itself is not
lost between two vertices; and two chains between the same two corners, as at the end of a wing, do
not become one segment unless both are nearly straight, turning by some twenty degrees at most."""

RETURNS = 8
"""Number of cuts after which a piece is no longer cut because it ends where it began."""

CORNERS = 12
"""Number of halvings of an edge after which it is no longer cut for an angle: at a cusp no number
of halvings is enough."""

NEARLY_CLOSED = 2.0**-20


@dataclass(frozen=True, eq=False, slots=True)
class CutDecision:
    """Which of M pieces must be cut, and why; all of shape (M,).

    Attributes
    ----------
    cut : ndarray of bool
        Pieces that must be cut.
    closed : ndarray of bool
        Those that must be cut because they end where they began.
    hopeless : ndarray of bool
        Those of which rounding is larger than a cut can help with.
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

    A piece is cut if it is too far from its chord (at equal parameters where the goal has two
    sides) or turns too much; and, in the first few cuts, if its deviation is large for its length.

    Why equal parameters are enough for two sides: let D be the vector from the chord to the curve.
    On a flat strip beside the piece the affine map onto a triangle (a, c, d) differs from that of
    the chord by the D of its corners. So the net of the difference to the surface, a blossom of D
    less shares of D(c) and D(d), is at most twice as long as that of D: within the two tolerances
    that are allowed between mesh and surface.

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
    far = (shapes.net > OF_NET * allowed - slack) | (shapes.curve > OF_CURVE * allowed - slack)
    far |= shapes.apart > OF_NET * allowed - slack
    hopeless = far & ((OF_CURVE * allowed <= slack) | (halvings == DEPTH))
    real = shapes.net > slack
    share = np.array(SHAPELY)[np.minimum(cuts, len(SHAPELY) - 1)]
    bent = real & (shapes.net > share * shapes.chord) & (cuts < len(SHAPELY))
    closed = (shapes.chord == 0) | real & (shapes.chord <= NEARLY_CLOSED * shapes.net)
    closed &= cuts < RETURNS
    cut = far | bent | closed
    if goal.angle < inf:
        cut |= (shapes.cosine < cos(goal.angle)) & (halvings < CORNERS)
    return CutDecision(cut, closed, hopeless, allowed)


def refuse_hopeless(decision: CutDecision, real: Bools, slack: FloatArray, goal: Goal) -> None:
    """Raise an error if a real piece, shape (M,), is hopeless.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if rounding leaves no room for it, or `DEPTH` halvings do not do.
    """
    hopeless = decision.hopeless & real
    if hopeless.any():
        least = float(decision.allowed[hopeless].min())
        raise _build_error(least, float(slack[hopeless].max()), goal)


def _measure_distances_to_eye(shapes: Shapes, goal: Goal, origin: FloatArray) -> FloatArray:
    """Distances from the eye to the boxes of pieces; 0 without a view."""
    if goal.view is None:
        return np.zeros(len(origin))
    eye = goal.view.eye - origin
    return measure_lengths(np.maximum(np.maximum(shapes.low - eye, eye - shapes.high), 0.0))


def _build_error(allowed: float, slack: float, goal: Goal) -> InvalidRequest:
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The tolerance is below the precision of the numbers in the response.",
            "/tolerance" if goal.view is None else "/pixel_tolerance",
            f"{allowed:.6g}",
            f"more than {4 * slack:.3g} for this surface",
        )
    )
