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
from service.engine.extent import find_unit_scales
from service.engine.points.places import round_to_ends
from service.engine.vectors import dot, length
from service.errors import MAX_ISSUES, InvalidRequest, Issue, format_number, pointer
from service.surface.curve_model import CurvePieces

CHUNK = 1 << 18
"""The most numbers in the work arrays of one chunk."""

ZERO_DERIVATIVE = 2.0**-40
"""A shorter derivative counts as zero, on a piece scaled to a size of about 1."""


@dataclass(frozen=True, eq=False)
class CurveSamples:
    """Samples of a curve: numbers of pieces, and parameters t ∈ [0, 1] in them, shapes (N,)."""

    piece: Ints
    t: FloatArray

    @staticmethod
    def uniform(count: int, divisions: int) -> "CurveSamples":
        """The samples that divide each of `count` pieces into equal intervals of t.

        They are count · divisions + 1. A joint of two pieces is one sample, at t = 0 of the second
        piece. The end of the curve is at t = 1 of its last piece.
        """
        number = np.arange(count * divisions + 1)
        piece = np.minimum(number // divisions, count - 1)
        return CurveSamples(piece, (number - piece * divisions) / divisions)

    @staticmethod
    def locate(parameters: FloatArray, breaks: FloatArray) -> "CurveSamples":
        """The samples at parameters (N,) of the curve's domain.

        A parameter between two pieces belongs to the second, the end of the domain to the last. A
        parameter that a few roundings led out of the domain is its end.

        Raises
        ------
        InvalidRequest
            `outside_domain`.
        """
        low, high = float(breaks[0]), float(breaks[-1])
        inside = round_to_ends(parameters, np.array(low), np.array(high))
        outside = np.flatnonzero(~((inside >= low) & (inside <= high)))[:MAX_ISSUES]
        if len(outside):
            raise InvalidRequest(
                *(
                    Issue(
                        "outside_domain",
                        "The parameter lies outside the curve.",
                        pointer(("parameters", row)),
                        format_number(parameters[row]),
                        f"{format_number(low)} to {format_number(high)}",
                    )
                    for row in outside.tolist()
                )
            )
        piece = np.searchsorted(breaks[1:-1], inside, side="right")
        begin, end = breaks[piece], breaks[piece + 1]
        return CurveSamples(piece, (inside - begin) / (end - begin))

    def __len__(self) -> int:
        return len(self.t)

    def chunks(self, width: int) -> Iterator[slice]:
        """Runs of samples that need at most `CHUNK` numbers, if each needs `width` numbers."""
        return row_slices(len(self), width, CHUNK)

    def parameters(self, breaks: FloatArray) -> FloatArray:
        """Parameters in the curve's domain, (N,), from its `breaks` between pieces.

        Joints and ends get the exact numbers of `breaks`.
        """
        low, high = breaks[self.piece], breaks[self.piece + 1]
        parameters = low + (high - low) * self.t
        parameters[self.t == 1.0] = high[self.t == 1.0]
        return parameters


def evaluate_positions(pieces: CurvePieces, samples: CurveSamples) -> FloatArray:
    """Points of the curve, shape (N, d); at t = 0 and t = 1 exactly the control points."""
    out = np.empty((len(samples), pieces.dimension))
    for rows in samples.chunks((pieces.degree + 1) * (pieces.dimension + 1)):
        piece, t = samples.piece[rows], samples.t[rows]
        weights = None if pieces.weights is None else pieces.weights[piece]
        points = evaluate_nets(pieces.points[piece], weights, bernstein(pieces.degree, t))
        for end, index in ((0.0, 0), (1.0, -1)):
            is_end = t == end
            points[is_end] = pieces.points[piece[is_end], index]
        out[rows] = points
    return out


def evaluate_tangents(
    pieces: CurvePieces, samples: CurveSamples, *, before: bool = False
) -> FloatArray:
    """Unit tangents, shape (N, d): limits from the right, or from the left if `before`.

    At a cusp, or at an end with repeated control points, C′ vanishes. Let C^(k) be the first
    derivative that does not vanish there. The limit from the right is the direction of C^(k)(t),
    the limit from the left that of (−1)^(k−1) C^(k)(t). The tangent at t = 1 is always the limit
    from the left, at t = 0 the limit from the right. A piece that is a single point gets the
    direction of the next piece that is not.

    For a rational curve, C − C(t) = X / w with X_i = w_i (P_i − C(t)): the first derivative of X
    that does not vanish has the same direction.
    """
    local_pieces = LocalPieces(pieces)
    out = np.empty((len(samples), pieces.dimension))
    for rows in samples.chunks((pieces.degree + 1) * (pieces.dimension + 1)):
        out[rows] = local_pieces.directions(samples.piece[rows], samples.t[rows], before)
    missing = np.flatnonzero(np.isnan(out[:, 0]))
    if len(missing):
        out[missing] = local_pieces.neighbour_directions(samples.piece[missing])
    return out


class LocalPieces:
    """The pieces translated by their middles, each scaled by a power of two to a size near 1."""

    def __init__(self, pieces: CurvePieces) -> None:
        low, high = pieces.points.min(axis=1), pieces.points.max(axis=1)
        middle = low + (high - low) / 2
        local = pieces.points - middle[:, None]
        size = np.abs(local).max(axis=(1, 2))
        self.scale: FloatArray = find_unit_scales(size)
        self.points: FloatArray = local * self.scale[:, None, None]
        self.weights: FloatArray | None = None
        if pieces.weights is not None:
            self.weights = pieces.weights / pieces.weights.max(axis=1, keepdims=True)
        # Far from zero, the rounding of the control points limits the precision, too.
        max_distance = np.abs(middle).max(axis=1) * self.scale
        self.zero_limit: FloatArray = ZERO_DERIVATIVE + 2.0**-50 * max_distance
        self.has_length: Bools = size > 0
        self.degree, self.dimension = pieces.degree, pieces.dimension
        self.closed = pieces.closed

    def directions(self, piece: Ints, t: FloatArray, before: bool) -> FloatArray:
        """Unit tangents at samples, (N, d); NaN where the piece is a single point."""
        points = self.points[piece]
        lower_basis = bernstein(self.degree - 1, t)
        # C′ up to a positive factor; for a rational curve X′.
        if self.weights is None:
            derivative = dot(lower_basis[:, :, None], np.diff(points, axis=1))
        else:
            weights = self.weights[piece]
            centre = evaluate_nets(points, weights, bernstein(self.degree, t))
            net = weights[:, :, None] * (points - centre[:, None])
            derivative = dot(lower_basis[:, :, None], np.diff(net, axis=1))
        lengths = length(derivative, -1)
        limit = self.zero_limit[piece]
        slow_rows = np.flatnonzero(lengths <= limit)
        if len(slow_rows):
            derivative[slow_rows] = self._limits(
                piece[slow_rows], t[slow_rows], limit[slow_rows], before
            )
            lengths[slow_rows] = length(derivative[slow_rows], -1)
        return derivative / lengths[:, None] + 0.0  # turns -0.0 into 0.0

    def _limits(self, piece: Ints, t: FloatArray, limit: FloatArray, before: bool) -> FloatArray:
        """Directions (N, d) at samples where C′ vanishes; NaN where all derivatives vanish."""
        points = self.points[piece]
        weights = np.ones(points.shape[:2]) if self.weights is None else self.weights[piece]
        centre = evaluate_nets(points, weights, bernstein(self.degree, t))
        net = weights[:, :, None] * (points - centre[:, None])
        from_left = (t == 1.0) | (before & (t > 0.0))
        directions = np.full(centre.shape, np.nan)
        best = np.zeros(len(t))
        for k in range(1, self.degree + 1):
            net = np.diff(net, axis=1)
            value = dot(bernstein(self.degree - k, t)[:, :, None], net)
            lengths = length(value, -1)
            # Each difference doubles the rounding error, so the limit of the k-th derivative is
            # 2^(k-1) times the limit of the first. The first derivative above its limit gives the
            # direction; if none is above, the largest one in units of its limit.
            scaled_length = lengths * 0.5 ** (k - 1)
            is_better = self.has_length[piece] & (best <= limit) & (scaled_length > best)
            sign = np.where(from_left & (k % 2 == 0), -1.0, 1.0)
            factor = sign[is_better] / lengths[is_better]
            directions[is_better] = factor[:, None] * value[is_better]
            best[is_better] = scaled_length[is_better]
        return directions

    def neighbour_directions(self, piece: Ints) -> FloatArray:
        """Directions at pieces that are single points, (N, d).

        They are the direction at the beginning of the next piece with length. At the end of an open
        curve, where all following pieces are single points, they are the direction at the end of
        the last piece with length. So if single points separate two pieces with length, the tangent
        changes at the first of these points.
        """
        long_pieces = np.flatnonzero(self.has_length)
        next_long_piece = np.searchsorted(long_pieces, piece)
        # A closed curve continues with its first piece.
        is_at_end = (next_long_piece == len(long_pieces)) & (not self.closed)
        pieces = long_pieces[
            np.where(is_at_end, next_long_piece - 1, next_long_piece % len(long_pieces))
        ]
        # Each distinct direction is computed once: at t = 0, or at t = 1 at the end of the curve.
        (piece, t), number = np.unique(np.stack([pieces, is_at_end]), axis=1, return_inverse=True)
        return self.directions(piece, t.astype(np.float64), False)[number.ravel()]


def evaluate_nets(points: FloatArray, weights: FloatArray | None, basis: FloatArray) -> FloatArray:
    """Points of curves, one for each row of control points: (N, n+1, d) → (N, d)."""
    if weights is None:
        return dot(basis[:, :, None], points)
    return dot((basis * weights)[:, :, None], points) / dot(basis, weights, -1)[:, None]
