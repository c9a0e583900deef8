"""Points and unit tangents of a curve's pieces, at any parameters.

Everything is summed term by term: the bits of a sample depend on its piece and its parameter alone,
not on the samples that are computed together with it.
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
"""Coordinates of gathered points that are worked on at a time."""

STILL = 2.0**-40
"""A derivative below this, where the piece is about 1 in size, is taken for zero."""


@dataclass(frozen=True, eq=False)
class CurveSamples:
    """Places on a curve: numbers of pieces, and parameters t ∈ [0, 1] in them, shapes (N,)."""

    piece: Ints
    t: FloatArray

    @staticmethod
    def uniform(count: int, divisions: int) -> "CurveSamples":
        """R divisions of each of S pieces: S R + 1 samples, joints once, at t = 0 of what follows.

        The end of the curve is at t = 1 of its last piece.
        """
        number = np.arange(count * divisions + 1)
        piece = np.minimum(number // divisions, count - 1)
        return CurveSamples(piece, (number - piece * divisions) / divisions)

    def __len__(self) -> int:
        return len(self.t)

    def chunks(self, width: int) -> Iterator[slice]:
        """Runs of samples for which `width` numbers each are not too many at once."""
        return row_slices(len(self), width, CHUNK)

    def parameters(self, breaks: FloatArray) -> FloatArray:
        """Parameters in the curve's parameters domain, joints and ends exact."""
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
    """Unit tangents, shape (N, d): limits from behind the sample, or from before it.

    Where C′ vanishes, at a cusp or at an end with repeated control points, the limit is that of
    the first derivative that does not: C^(k)(t) from the right, (−1)^(k−1) C^(k)(t) from the
    left. At t = 1 it is always that from the left, at t = 0 that from the right. A piece that is
    one point takes the direction of the next that is not.

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
        # What the points were rounded to counts, too, where the curve is far from zero.
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
        left = (t == 1.0) | (before & (t > 0.0))
        out = np.full(centre.shape, np.nan)
        best = np.zeros(len(t))
        for k in range(1, self.degree + 1):
            net = np.diff(net, axis=1)
            value = _sum(bernstein(self.degree - k, t), net)
            length = np.sqrt((value * value).sum(axis=1))
            # The first above the limit is the one; where rounding hides all of them, the clearest.
            clear = length * 0.5 ** (k - 1)
            is_better = self.solid[piece] & (best <= limit) & (clear > best)
            sign = np.where(left & (k % 2 == 0), -1.0, 1.0)
            out[is_better] = (sign[is_better] / length[is_better])[:, None] * value[is_better]
            best[is_better] = clear[is_better]
        return out

    def neighbour_directions(self, piece: Ints) -> FloatArray:
        """Directions at pieces that are one point: of the next that is none, else of the last.

        So a corner that such pieces hide is at the first of them.
        """
        solid = np.flatnonzero(self.solid)
        after = np.searchsorted(solid, piece)
        # A closed curve goes on with its first piece.
        back = (after == len(solid)) & (not self.closed)
        chosen = solid[np.where(back, after - 1, after % len(solid))]
        ends, number = np.unique(np.stack([chosen, back]), axis=1, return_inverse=True)
        return self.directions(ends[0], ends[1].astype(np.float64), False)[number.ravel()]


def _sum(basis: FloatArray, net: FloatArray) -> FloatArray:
    """Σ_i B_i Q_i row by row and term by term: (N, m), (N, m, d) → (N, d)."""
    total = basis[:, 0, None] * net[:, 0]
    for i in range(1, net.shape[1]):
        total += basis[:, i, None] * net[:, i]
    return total


def _point(points: FloatArray, weights: FloatArray | None, basis: FloatArray) -> FloatArray:
    """Points of one row of control points each: (N, n+1, d) → (N, d)."""
    if weights is None:
        return _sum(basis, points)
    share = basis * weights
    total = share[:, 0].copy()
    for i in range(1, share.shape[1]):
        total += share[:, i]
    return _sum(share, points) / total[:, None]
