"""Whether pieces of curves may be straight segments: measured on their nets, decided by a goal.

Every number depends on its own piece and on the goal alone, to the last bit.
"""

from dataclasses import dataclass
from math import cos, inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.chords import (
    bound_from_distances,
    find_row_maxima,
    measure_distances,
    project,
)
from service.engine.bounds.faces import DEPTH
from service.engine.bounds.goal import Goal
from service.errors import InvalidRequest, Issue

OF_NET = 0.95
"""Share of the tolerance by which the net of a piece may stray from its chord. As triangles along
a side grow narrow their nets shrink towards this one, so that in the end they are near enough."""

OF_CURVE = 0.7
"""Share of the tolerance by which the piece itself may: what is left is for the surface beside."""

SHAPELY = (1 / 16, 1 / 2, 1 / 2)
"""How far the net of a chain may stray, as a share of its chord, lest it is cut once, and that of
its halves, and of theirs: whatever the tolerance. So what turns back on itself is not lost between
two vertices; and two chains between the same two corners, as at the end of a wing, do not become
one segment unless both are nearly straight, turning by some twenty degrees at most."""

RETURNS = 8
"""Cuts of a chain that pieces may ask for which end where they began."""

CORNERS = 12
"""Halvings of an edge that its turning may ask for: at a cusp no number of them is enough."""

NEARLY_CLOSED = 2.0**-20
EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False, slots=True)
class Shapes:
    """What is known of pieces of curves; all of shape (M,).

    Attributes
    ----------
    net, curve : ndarray of float64
        How far the net, raised by one degree, and the curve may be from the chord. No surface is
        of less degree across its sides than one.
    apart : ndarray of float64
        How far the curve may be from the point of the chord at the same parameter; 0 where that
        does not matter.
    chord : ndarray of float64
        Length of the chord.
    cosine : ndarray of float64
        Least cosine between a leg of the net and the tangents at both ends.
    low, high : ndarray of float64, shape (M, 3)
        Box about the net.
    """

    net: FloatArray
    curve: FloatArray
    apart: FloatArray
    chord: FloatArray
    cosine: FloatArray
    low: FloatArray
    high: FloatArray

    def combine_runs(self, begin: Ints) -> "Shapes":
        """Runs of pieces, each against one chord, as one piece; `begin` are their first."""
        greatest, least = np.maximum.reduceat, np.minimum.reduceat
        return Shapes(
            greatest(self.net, begin),
            greatest(self.curve, begin),
            greatest(self.apart, begin),
            self.chord[begin],
            least(self.cosine, begin),
            least(self.low, begin),
            greatest(self.high, begin),
        )


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """Where nets were moved from, (M, 3), and what rounding may have done to them, (M,)."""

    origin: FloatArray
    slack: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class CutDecision:
    """Which pieces must be cut, and which of these end where they began; shape (M,).

    Some are `hopeless`: rounding leaves no room for what is `allowed`.
    """

    cut: Bools
    closed: Bools
    hopeless: Bools
    allowed: FloatArray


def measure_shapes(
    nets: FloatArray,
    chords: FloatArray,
    *,
    shares: FloatArray | None = None,
    tangents: tuple[FloatArray, FloatArray] | None = None,
) -> Shapes:
    """Measures pieces.

    Parameters
    ----------
    nets : ndarray of float64, shape (M, n+1, 3), or (M, n+1, 4) if homogeneous
    chords : ndarray of float64, shape (M, 2, 3)
    shares : ndarray of float64, shape (M, 2, 3), or None
        Ends of the part of the chord that belongs to each piece, if parameters matter.
    tangents : two arrays, or None
        Those of `find_tangents`, if turning matters.
    """
    points = project(nets, 3)
    weights = nets[..., 3] if nets.shape[2] == 4 else None
    curve = bound_from_distances(measure_distances(points, chords), weights)
    # Without weights the raised net is within 4/3 of the bound of the curve, at every degree.
    net = curve * (4 / 3)
    if weights is not None:
        rational = (weights != 1.0).any(axis=1)
        raised = project(_elevate(nets[rational]), 3)
        net[rational] = find_row_maxima(measure_distances(raised, chords[rational]))
    low = high = points[:, 0]
    for k in range(1, points.shape[1]):
        low, high = np.minimum(low, points[:, k]), np.maximum(high, points[:, k])
    cosine = np.ones(len(nets)) if tangents is None else _find_least_cosine(points, tangents)
    apart = np.zeros(len(nets)) if shares is None else _bound_apart(points, weights, shares)
    return Shapes(
        net, curve, apart, _measure_lengths(chords[:, 1] - chords[:, 0]), cosine, low, high
    )


def decide_cuts(
    found: Shapes, goal: Goal, place: Place, cuts: Ints, halvings: Ints | int = 0
) -> CutDecision:
    """Which pieces are no straight segments.

    A piece is cut that is too far from its chord (parameter by parameter where the goal has two
    sides) or turns too much; and, the first few times, one that strays too far for its length.

    Parameter by parameter, with D the way from the chord to the curve: on a flat strip beside the
    piece the affine map onto a triangle (a, c, d) differs from the chord's by the D of its corners.
    So the net of what is left, a blossom of D less shares of D(c) and D(d), is at most twice as
    long as that of D: within the two tolerances that are allowed between mesh and surface.

    Parameters
    ----------
    cuts, halvings : ndarray of int, shape (M,)
        Cuts that led from the chain to the piece, and how many of them halved its edge.
    """
    allowed = goal.find_allowed(_measure_distances_to_eye(found, goal, place.origin))
    slack = place.slack
    far = (found.net > OF_NET * allowed - slack) | (found.curve > OF_CURVE * allowed - slack)
    far |= found.apart > OF_NET * allowed - slack
    hopeless = far & ((OF_CURVE * allowed <= slack) | (halvings == DEPTH))
    real = found.net > slack
    share = np.array(SHAPELY)[np.minimum(cuts, len(SHAPELY) - 1)]
    bent = real & (found.net > share * found.chord) & (cuts < len(SHAPELY))
    closed = (found.chord == 0) | real & (found.chord <= NEARLY_CLOSED * found.net)
    closed &= cuts < RETURNS
    cut = far | bent | closed
    if goal.angle < inf:
        cut |= (found.cosine < cos(goal.angle)) & (halvings < CORNERS)
    return CutDecision(cut, closed, hopeless, allowed)


def refuse_hopeless(verdict: CutDecision, real: Bools, slack: FloatArray, goal: Goal) -> None:
    """Ends where a piece that is real, shape (M,), is hopeless.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if rounding leaves no room for it, or `DEPTH` halvings do not do.
    """
    hopeless = verdict.hopeless & real
    if hopeless.any():
        least = float(verdict.allowed[hopeless].min())
        raise _build_error(least, float(slack[hopeless].max()), goal)


def find_tangents(nets: FloatArray, slack: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors along curves (M, n+1, …) at both ends, shape (M, 3) each; 0 where there is none.

    The first and the last leg of the net that is longer than what rounding makes of none.
    """
    legs, length = _find_legs(project(nets, 3))
    real = length > slack[:, None]
    rows = np.arange(len(nets))
    found = []
    for at in (real.argmax(axis=1), real.shape[1] - 1 - real[:, ::-1].argmax(axis=1)):
        some = real[rows, at]
        unit = np.where(some, length[rows, at], 1.0)
        found.append(np.where(some[:, None], legs[rows, at] / unit[:, None], 0.0))
    return found[0], found[1]


def bound_rounding(size: FloatArray, far: FloatArray, degree: int) -> FloatArray:
    """What halving and moving may do to nets of some size that are so far from the origin.

    Each of the n levels of a halving takes means, right to half an ε of the largest coordinate;
    weights, quotients and distances are a few more, and the ends of a chord stand where they are
    stored.
    """
    slack: FloatArray = EPS * (size * (2.0 * DEPTH * degree + 16.0) + 2.0 * far)
    return slack


def _elevate(nets: FloatArray) -> FloatArray:
    """The same curves in the next degree, P*_i = i/(n+1) P_{i−1} + (1 − i/(n+1)) P_i."""
    degree = nets.shape[1] - 1
    share = (np.arange(1, degree + 1) / (degree + 1))[:, None]
    inner = share * nets[:, :-1] + (1.0 - share) * nets[:, 1:]
    return np.concatenate([nets[:, :1], inner, nets[:, -1:]], axis=1)


def _bound_apart(points: FloatArray, weights: FloatArray | None, shares: FloatArray) -> FloatArray:
    """Bounds of ‖C(t) − (1 − t) a − t b‖, from the net of that difference in the next degree.

    W (C − L):  N_k = (1 − k/(n+1)) w_k (P_k − a) + k/(n+1) w_{k−1} (P_{k−1} − b)
    """
    degree = points.shape[1] - 1
    share = (np.arange(degree + 2) / (degree + 1))[:, None]
    after = points - shares[:, :1]
    before = points - shares[:, 1:]
    least = np.ones(len(points))
    if weights is not None:
        after, before = weights[..., None] * after, weights[..., None] * before
        least = -find_row_maxima(-weights)
    none = np.zeros((len(points), 1, 3))
    after, before = np.concatenate([after, none], 1), np.concatenate([none, before], 1)
    return find_row_maxima(_measure_lengths((1.0 - share) * after + share * before)) / least


def _find_least_cosine(points: FloatArray, tangents: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Least cosine between the legs of nets and tangents; what has no direction does not count."""
    legs, length = _find_legs(points)
    least = np.ones(len(points))
    for tangent in tangents:
        along = legs[..., 0] * tangent[:, None, 0] + legs[..., 1] * tangent[:, None, 1]
        along += legs[..., 2] * tangent[:, None, 2]
        counts = (length > 0) & (tangent != 0).any(axis=1)[:, None]
        cosine = np.where(counts, along, 1.0) / np.where(counts, length, 1.0)
        least = np.minimum(least, -find_row_maxima(-cosine))
    return least


def _find_legs(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Differences of neighbours in nets, (M, n, 3), and their lengths."""
    legs = points[:, 1:] - points[:, :-1]
    return legs, _measure_lengths(legs)


def _measure_lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (…, 3), right also where their squares would vanish or be infinite."""
    x, y, z = (vectors[..., k] for k in range(3))
    size = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
    unit = np.where(size > 0, size, 1.0)
    x, y, z = x / unit, y / unit, z / unit
    length: FloatArray = unit * np.sqrt(x * x + y * y + z * z)
    return length


def _measure_distances_to_eye(found: Shapes, goal: Goal, origin: FloatArray) -> FloatArray:
    """Distances from the eye to the boxes; 0 where nobody looks."""
    if goal.view is None:
        return np.zeros(len(origin))
    eye = goal.view.eye - origin
    return _measure_lengths(np.maximum(np.maximum(found.low - eye, eye - found.high), 0.0))


def _build_error(allowed: float, slack: float, goal: Goal) -> InvalidRequest:
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The numbers of the answer are not so precise.",
            "/tolerance" if goal.view is None else "/pixel_tolerance",
            f"{allowed:.6g}",
            f"more than {4 * slack:.3g} for this surface",
        )
    )
