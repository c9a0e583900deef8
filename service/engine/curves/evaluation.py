"""Points and unit tangents of a curve's pieces, at any parameters.

All sums are formed term by term. So the bits of a sample depend on its piece and its parameter
alone, and not on the samples that are computed together with it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.engine.extent import powers_of_two
from service.surface.curve_pieces import CurvePieces

CHUNK = 1 << 18
"""Coordinates of the points in one chunk."""

STILL = 2.0**-40
"""A derivative below this counts as zero, on a piece scaled to a size of about 1."""


@dataclass(frozen=True, eq=False)
class CurveSamples:
    """Places on a curve: numbers of pieces, and parameters t ∈ [0, 1] in them, shapes (N,)."""

    piece: Ints
    t: FloatArray

    @staticmethod
    def uniform(count: int, divisions: int) -> "CurveSamples":
        """R divisions of each of S pieces: S R + 1 samples.

        Joints occur once, at t = 0 of the piece that follows.

        The end of the curve is at t = 1 of its last piece.
        """
        number = np.arange(count * divisions + 1)
        piece = np.minimum(number // divisions, count - 1)
        return CurveSamples(piece, (number - piece * divisions) / divisions)

    def __len__(self) -> int:
        return len(self.t)

    def chunks(self, width: int) -> Iterator[slice]:
        """Runs of samples with at most `CHUNK` numbers, if each sample needs `width` numbers."""
        return row_slices(len(self), width, CHUNK)

    def parameters(self, breaks: FloatArray) -> FloatArray:
        """Parameters in the curve's domain; joints and ends are exact."""
        low, high = breaks[self.piece], breaks[self.piece + 1]
        parameters = low + (high - low) * self.t
        parameters[self.t == 1.0] = high[self.t == 1.0]
        return parameters


def evaluate_positions(pieces: CurvePieces, at: CurveSamples) -> FloatArray:
    """Points C, shape (N, d); at t = 0 and t = 1 the control points themselves."""
    out = np.empty((len(at), pieces.dimension))
    for rows in at.chunks((pieces.degree + 1) * (pieces.dimension + 1)):
        piece, t = at.piece[rows], at.t[rows]
        weights = None if pieces.weights is None else pieces.weights[piece]
        place = _point(pieces.points[piece], weights, bernstein(pieces.degree, t))
        for end, index in ((0.0, 0), (1.0, -1)):
            is_end = t == end
            place[is_end] = pieces.points[piece[is_end], index]
        out[rows] = place
    return out


def evaluate_tangents(pieces: CurvePieces, at: CurveSamples, *, before: bool = False) -> FloatArray:
    """Unit tangents, shape (N, d): limits from the right, or from the left if `before`.

    Where C′ vanishes, at a cusp or at an end with repeated control points, the limit is the
    direction of the first derivative that does not vanish: C^(k)(t) from the right, (−1)^(k−1)
    C^(k)(t) from the left. At t = 1 it is always the limit from the left, at t = 0 the limit from
    the right. A piece that is one point takes the direction of the next piece that is longer.

    For a rational curve, C − C(t) = X / w with X_i = w_i (P_i − C(t)): the first derivative of X
    that does not vanish has the same direction.
    """
    shape = _Local(pieces)
    out = np.empty((len(at), pieces.dimension))
    for rows in at.chunks((pieces.degree + 1) * (pieces.dimension + 1)):
        out[rows] = shape.directions(at.piece[rows], at.t[rows], before)
    missing = np.flatnonzero(np.isnan(out[:, 0]))
    if len(missing):
        out[missing] = shape.neighbour_directions(at.piece[missing])
    return out


class _Local:
    """The pieces about their own middles, each scaled by a power of two to a size near 1."""

    def __init__(self, pieces: CurvePieces) -> None:
        low, high = pieces.points.min(axis=1), pieces.points.max(axis=1)
        middle = low + (high - low) / 2
        local = pieces.points - middle[:, None]
        size = np.abs(local).max(axis=(1, 2))
        scale = powers_of_two(size)
        self.points: FloatArray = local * scale[:, None, None]
        self.weights: FloatArray | None = None
        if pieces.weights is not None:
            self.weights = pieces.weights / pieces.weights.max(axis=1, keepdims=True)
        # Far from zero, the rounding of the points themselves limits the precision, too.
        far = np.abs(middle).max(axis=1) * scale
        self.still: FloatArray = STILL + 2.0**-50 * far
        self.solid: Bools = size > 0
        self.degree, self.dimension = pieces.degree, pieces.dimension
        self.closed = pieces.closed

    def directions(self, piece: Ints, t: FloatArray, before: bool) -> FloatArray:
        """Unit tangents at some samples; NaN where the piece is one point."""
        points = self.points[piece]
        steps = np.diff(points, axis=1)
        below = bernstein(self.degree - 1, t)
        if self.weights is None:
            first = _sum(below, steps)
        else:
            weights = self.weights[piece]
            centre = _point(points, weights, bernstein(self.degree, t))
            net = weights[:, :, None] * (points - centre[:, None])
            first = _sum(below, np.diff(net, axis=1))
        length = np.sqrt((first * first).sum(axis=1))
        limit = self.still[piece]
        slow = np.flatnonzero(length <= limit)
        if len(slow):
            first[slow] = self._limits(piece[slow], t[slow], limit[slow], before)
            length[slow] = np.sqrt((first[slow] * first[slow]).sum(axis=1))
        tangent: FloatArray = first / length[:, None] + 0.0
        return tangent

    def _limits(self, piece: Ints, t: FloatArray, limit: FloatArray, before: bool) -> FloatArray:
        """Directions where the first derivative vanishes; NaN where all do."""
        points = self.points[piece]
        weights = np.ones(points.shape[:2]) if self.weights is None else self.weights[piece]
        centre = _point(points, weights, bernstein(self.degree, t))
        net = weights[:, :, None] * (points - centre[:, None])
        from_left = (t == 1.0) | (before & (t > 0.0))
        directions = np.full(centre.shape, np.nan)
        best = np.zeros(len(t))
        for k in range(1, self.degree + 1):
            net = np.diff(net, axis=1)
            value = _sum(bernstein(self.degree - k, t), net)
            length = np.sqrt((value * value).sum(axis=1))
            # The first derivative above its limit; if rounding hides all of them, the largest in
            # units of its limit.
            clear = length * 0.5 ** (k - 1)
            is_better = self.solid[piece] & (best <= limit) & (clear > best)
            sign = np.where(from_left & (k % 2 == 0), -1.0, 1.0)
            directions[is_better] = (sign[is_better] / length[is_better])[:, None] * value[
                is_better
            ]
            best[is_better] = clear[is_better]
        return directions

    def neighbour_directions(self, piece: Ints) -> FloatArray:
        """Directions at pieces that are one point: of the next longer piece, else of the last one.

        So a corner between longer pieces is at the first of the pieces that are one point.
        """
        solid_pieces = np.flatnonzero(self.solid)
        after = np.searchsorted(solid_pieces, piece)
        # A closed curve continues with its first piece.
        back = (after == len(solid_pieces)) & (not self.closed)
        pieces = solid_pieces[np.where(back, after - 1, after % len(solid_pieces))]
        ends, number = np.unique(np.stack([pieces, back]), axis=1, return_inverse=True)
        return self.directions(ends[0], ends[1].astype(np.float64), False)[number.ravel()]


def _sum(basis: FloatArray, net: FloatArray) -> FloatArray:
    """Σ_i B_i Q_i row by row and term by term: (N, m), (N, m, d) → (N, d)."""
    total = basis[:, 0, None] * net[:, 0]
    for i in range(1, net.shape[1]):
        total += basis[:, i, None] * net[:, i]
    return total


def _point(points: FloatArray, weights: FloatArray | None, basis: FloatArray) -> FloatArray:
    """Points of curves, one for each row of control points: (N, n+1, d) → (N, d)."""
    if weights is None:
        return _sum(basis, points)
    share = basis * weights
    total = share[:, 0].copy()
    for i in range(1, share.shape[1]):
        total += share[:, i]
    return _sum(share, points) / total[:, None]
