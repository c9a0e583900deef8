"""Pieces of curves of foot points, divided at a knot line of the surface or in the middle."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_pieces import DEGREE, CurvesOnFaces, Pieces, list_nodes

STEPS = 6
"""Steps of regula falsi towards the knot line."""

CLOSE = 1e-14
"""A foot this close to a knot, as a share of the domain, is at it."""

END = 2.0**-20
"""A crossing in the first or the last part of a piece, up to this share, does not divide it."""


def divide_pieces(
    work: CurvesOnFaces, pieces: Pieces, points: FloatArray, excess: FloatArray
) -> Pieces:
    """Both parts of all pieces; `points` (n + 1, 2, m) are the control points of the pieces."""
    count = len(pieces.curve)
    if not count:
        return pieces
    share, foot = _find_cuts(work, pieces, points)
    middle = pieces.low + share * (pieces.high - pieces.low)
    guesses = []
    for begin, size in ((np.zeros(count), share), (share, 1.0 - share)):
        x = begin + size * list_nodes()[1:-1, np.newaxis]
        basis = bernstein(DEGREE, x.ravel()).reshape(DEGREE - 1, count, DEGREE + 1)
        guesses.append(np.einsum("imj,jkm->ikm", basis, points))
    left = Pieces(pieces.curve, pieces.low, middle, excess, pieces.first, foot, guesses[0])
    right = Pieces(pieces.curve, middle, pieces.high, excess, foot, pieces.last, guesses[1])
    return Pieces.join([left, right])


def _find_cuts(
    work: CurvesOnFaces, pieces: Pieces, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Where pieces are divided: shares (m,) of their length, and the feet (2, m) there."""
    count = len(pieces.curve)
    face = work.face[pieces.curve]
    share, axis, knot = _find_crossings(work.surfaces, face, points)
    foot = np.zeros((count, 2))

    def find_foot(rows: Ints) -> FloatArray:
        """The feet (r, 2) at the present shares of some pieces."""
        guess = np.einsum("mj,jkm->mk", bernstein(DEGREE, share[rows]), points[..., rows])
        t = pieces.low[rows] + share[rows] * (pieces.high - pieces.low)[rows]
        return work.find_feet(pieces.curve[rows], t, guess)[0]

    every = np.arange(count)
    low, high = np.zeros(count), np.ones(count)
    low_value = points[0, axis, every] - knot
    high_value = points[-1, axis, every] - knot
    active = every
    for _ in range(STEPS):
        foot[active] = find_foot(active)
        active = active[axis[active] >= 0]
        value = foot[active, axis[active]] - knot[active]
        is_low = (value < 0) == (low_value[active] < 0)
        low[active] = np.where(is_low, share[active], low[active])
        low_value[active] = np.where(is_low, value, low_value[active])
        high[active] = np.where(is_low, high[active], share[active])
        high_value[active] = np.where(is_low, high_value[active], value)
        width = work.surfaces.period[face[active], axis[active]]
        active = active[np.abs(value) > CLOSE * width]
        if not len(active):
            break
        a, b = low_value[active], high_value[active]
        new = low[active] - a * (high - low)[active] / np.where(a == b, 1.0, b - a)
        share[active] = np.where(a == b, (low + high)[active] / 2, new)
    rows = (~((share > END) & (share < 1 - END))).nonzero()[0]
    if len(rows):
        share[rows] = 0.5
        foot[rows] = find_foot(rows)
    return share, foot.T


def _find_crossings(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray
) -> tuple[FloatArray, Ints, FloatArray]:
    """Where pieces cross the knot line nearest to their middle: share (m,), axis or −1, knot."""
    count = points.shape[2]
    share, axis, knot = np.full(count, 0.5), np.full(count, -1), np.zeros(count)
    nodes = np.einsum("ij,jkm->ikm", bernstein(DEGREE, list_nodes()), points)
    every = np.arange(count)
    for a in range(2):
        first, last = nodes[0, a], nodes[-1, a]
        middle = (first + last) / 2
        near = _find_near_knot(surfaces, face, a, middle)
        margin = 1e-9 * surfaces.period[face, a]
        low, high = np.minimum(first, last) + margin, np.maximum(first, last) - margin
        rows = ((near > low) & (near < high) & (axis < 0)).nonzero()[0]
        if not len(rows):
            continue
        value = (nodes[:, a, rows] - near[rows]) * np.sign(last - first)[rows]
        k = np.maximum((value >= 0).argmax(axis=0), 1)
        before, after = value[k - 1, np.arange(len(rows))], value[k, np.arange(len(rows))]
        x = list_nodes()
        share[rows] = x[k - 1] + (x[k] - x[k - 1]) * (-before / (after - before))
        axis[every[rows]], knot[rows] = a, near[rows]
    return share, axis, knot


def _find_near_knot(
    surfaces: ClosedSurfaces, face: Ints, axis: int, value: FloatArray
) -> FloatArray:
    """The inner knot nearest to values (m,) along an axis; infinite if a surface has one span.

    Along closed axes the sides are knots, too, and all knots recur.
    """
    span = surfaces.find_spans(face, axis, value)
    left, right = surfaces.list_knots(face, axis, span)
    is_open = ~surfaces.is_closed[face, axis]
    left = np.where(is_open & (span == 0), -np.inf, left)
    is_last = span + 1 == surfaces.surfaces.faces.spans[axis, face]
    right = np.where(is_open & is_last, np.inf, right)
    return np.where(np.abs(left - value) <= np.abs(right - value), left, right)
