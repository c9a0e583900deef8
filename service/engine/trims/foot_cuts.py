"""Pieces of curves of foot points, divided at a knot line of the surface or in the middle."""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_pieces import DEGREE, CurvesOnFaces, Pieces, list_nodes
from service.engine.trims.inversion import LAST_STEP
from service.engine.vectors import dot

STEPS = 8
"""The most steps towards a knot line."""

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
    curve, size = pieces.curve, pieces.size
    left = Pieces(curve, pieces.low, middle, size, excess, pieces.first, foot, guesses[0])
    right = Pieces(curve, middle, pieces.high, size, excess, foot, pieces.last, guesses[1])
    return Pieces.join([left, right])


def _find_cuts(
    work: CurvesOnFaces, pieces: Pieces, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Where pieces are divided: shares (m,) of their length, and the feet (2, m) there."""
    face = work.face[pieces.curve]
    share, axis, knot = _find_crossings(work.surfaces, face, points)
    foot = np.einsum("mj,jkm->mk", bernstein(DEGREE, share), points)
    crossing = (axis >= 0).nonzero()[0]
    is_found = np.zeros(len(share), bool)
    if len(crossing):
        chosen = pieces.take(crossing)
        share[crossing], foot[crossing], is_found[crossing] = _find_knot_feet(
            work, chosen, (share[crossing], foot[crossing]), axis[crossing], knot[crossing]
        )
    rows = (~is_found).nonzero()[0]
    if len(rows):
        share[rows] = 0.5
        guess = np.einsum("mj,jkm->mk", bernstein(DEGREE, share[rows]), points[..., rows])
        t = (pieces.low[rows] + pieces.high[rows]) / 2
        foot[rows] = work.find_feet(pieces.curve[rows], t, guess)
    return share, foot.T


def _find_knot_feet(
    work: CurvesOnFaces,
    pieces: Pieces,
    guess: tuple[FloatArray, FloatArray],
    axis: Ints,
    knot: FloatArray,
) -> tuple[FloatArray, FloatArray, Bools]:
    """Shares (m,) of pieces whose feet (m, 2) are on knot lines; and whether they were found.

    With the curve E and the surface S over the knot line, the two unknowns are the parameter t and
    the parameter v along the line. E(t) − S is to be normal to the surface, which gives two linear
    equations for a step of both.
    """
    face, every = work.face[pieces.curve], np.arange(len(axis))
    width = pieces.high - pieces.low
    share, foot = guess[0].copy(), guess[1].copy()
    foot[every, axis] = knot
    period = work.surfaces.period[face, 1 - axis]
    for _ in range(STEPS):
        point, speed = work.curves.evaluate_derivatives(pieces.curve, pieces.low + share * width)
        speed *= width[:, np.newaxis]
        image, *partials = work.surfaces.evaluate_partials(face, foot)
        across = np.where(axis[:, np.newaxis] == 0, partials[0], partials[1])
        along = np.where(axis[:, np.newaxis] == 0, partials[1], partials[0])
        rest = point - image
        # Both equations: d_share · speed − d_v · along + rest is normal to `across` and to `along`.
        a, b, c = dot(speed, across, -1), dot(along, across, -1), dot(rest, across, -1)
        d, e, f = dot(speed, along, -1), dot(along, along, -1), dot(rest, along, -1)
        determinant = b * d - a * e
        safe = np.where(determinant == 0, np.inf, determinant)
        step, slide = (c * e - b * f) / safe, (c * d - a * f) / safe
        share += step
        foot[every, 1 - axis] += slide
        inside = (share > END) & (share < 1 - END) & (determinant != 0)
        share = np.where(inside, share, 0.5)
        is_last = (np.abs(step) <= LAST_STEP) & (np.abs(slide) <= LAST_STEP * period)
        if (is_last | ~inside).all():
            break
    return share, foot, inside & is_last


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
